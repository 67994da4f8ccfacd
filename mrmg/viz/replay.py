"""A mission to be watched: where everything is at any time, and the clock that runs."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mrmg.errors import Fault, RunFolderError
from mrmg.plans import Plan, plan_in_force
from mrmg.scene.loading import load_scene
from mrmg.scene.types import Scene
from mrmg.simulation.log import ExecutionLog
from mrmg.viz.film import Film
from mrmg.viz.overlay import Reading
from mrmg.viz.video_options import VideoOptions, ticks_at

SPEEDS = (1, 2, 4, 8, 16, 32)
"""Mission seconds per second that a viewer offers."""


class Replay:
    """A driven mission, with a time that is set or runs on."""

    def __init__(self, scene: Scene, plan: Plan, log: ExecutionLog) -> None:
        """Start at the beginning, paused."""
        self.film = Film(scene, plan, log, VideoOptions())
        self.time_s = 0.0
        self.speed = 4.0
        self.playing = False

    @property
    def end_s(self) -> float:
        """Time of the log's end."""
        return float(self.film.log.time_s[-1])

    @property
    def tick(self) -> int:
        """The log's last tick that is not after the time."""
        return int(ticks_at(self.film.log, np.array(self.time_s)))

    def reading(self) -> Reading:
        """Return what is shown at the time."""
        return self.film.reading(self.tick)

    def seek(self, time_s: float) -> None:
        """Set the time, held within the mission."""
        self.time_s = min(max(time_s, 0.0), self.end_s)

    def advance(self, passed_s: float) -> None:
        """Let real time pass; at the end the replay stops."""
        if self.playing:
            self.seek(self.time_s + self.speed * passed_s)
            self.playing = self.time_s < self.end_s

    def toggle(self) -> None:
        """Play or pause; at the end, play from the beginning."""
        if not self.playing and self.time_s >= self.end_s:
            self.time_s = 0.0
        self.playing = not self.playing


def replay_of(run_folder: Path, *, trust_code: bool = False) -> Replay:
    """Return the replay of a run.

    Args:
        run_folder: the run, driven.
        trust_code: whether robot models may bring Python code (`loading.trust`).

    Raises:
        RunFolderError: if the run was not driven yet, or cannot be read.
    """
    scene = load_scene(run_folder / "scene.yaml", trust_code=trust_code)
    needed = {
        "plan.json": "missing: there is no plan; view the scene instead",
        "log.json": "missing: nothing was driven; run 'mrmg execute'",
    }
    for name, reason in needed.items():
        if not (run_folder / name).exists():
            raise RunFolderError(str(run_folder), [Fault(name, reason)])
    return Replay(scene, plan_in_force(run_folder), ExecutionLog.load(run_folder))


def spoken(scene: Scene, reading: Reading) -> tuple[str, list[tuple[str, str]]]:
    """Return a reading in words: the mission's line, and (robot, line) for each."""
    mission = f"{reading.clock}, {reading.goals_of(scene)}, {reading.used} used"
    lines = [
        (robot.robot, f"{robot.percent}, {robot.speed_m_s:.1f} m/s, {robot.way('to')}")
        for robot in reading.robots
    ]
    return mission, lines
