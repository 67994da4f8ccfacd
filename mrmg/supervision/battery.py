"""Following a robot's battery on the way, by the rule that all visits are judged by."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mrmg.energy.metering import TimedStates, battery_content
from mrmg.energy.visits import Stay, first_stay, is_at, visit_of
from mrmg.scene.types import Robot, Scene


class BatteryTracker:
    """The battery content of one robot, from its draws and the visits of its tour.

    Attributes:
        charge_J: battery content now.
    """

    def __init__(self, scene: Scene, robot: Robot) -> None:
        """Start with the robot's start energy."""
        self.charge_J = robot.battery.start_J
        self._scene, self._robot = scene, robot
        self._targets = {target.id: target for target in scene.targets()}
        self.follow(())

    def follow(self, tour: Sequence[str]) -> None:
        """Expect the visits of a tour from now on."""
        self._tour = list(tour)
        self._begun_J = self.charge_J
        self._time_s = np.zeros(0)
        self._poses, self._draw_J = np.zeros((0, 3)), np.zeros(0)

    def add(self, time_s: np.ndarray, poses: np.ndarray, draw_J: np.ndarray) -> None:
        """Take in some ticks.

        Args:
            time_s: of the state before the first tick and after each, shape (n + 1,).
            poses: x, y [m] and yaw [rad] at these times, shape (n + 1, 3).
            draw_J: energy drawn over each tick, shape (n,).
        """
        if not len(self._time_s):
            self._time_s, self._poses = time_s[:1], poses[:1]
        self._time_s = np.concatenate([self._time_s, time_s[1:]])
        self._poses = np.concatenate([self._poses, poses[1:]])
        self._draw_J = np.concatenate([self._draw_J, draw_J])
        stays = self._stays()
        visits = [
            visit_of(self._robot.id, self._targets[name], self._time_s, stay.first)
            for name, stay in zip(self._tour, stays, strict=False)
        ]
        motion = TimedStates(
            robot=self._robot.id, time_s=self._time_s, state=self._poses
        )
        content_J, arrival_J = battery_content(
            self._scene, motion, self._draw_J, visits, {0: self._begun_J}
        )
        self.charge_J = float(content_J[-1])
        takes_time = self._robot.battery.takes_time_to_fill
        if visits and visits[-1].kind == "station" and takes_time:
            # It goes on giving: what comes next depends on when this began.
            self._tour = self._tour[len(stays) - 1 :]
            self._keep(visits[-1].step, arrival_J[-1])
        else:
            self._tour = self._tour[len(stays) :]
            over = stays[-1].over if stays else 0
            first = max(over, self._since_when_at_target())
            self._keep(first, float(content_J[first]))

    def _keep(self, first: int, content_J: float) -> None:
        """Forget what was before a state, at which the battery had this content."""
        self._begun_J = content_J
        self._time_s, self._poses = self._time_s[first:], self._poses[first:]
        self._draw_J = self._draw_J[first:]

    def _stays(self) -> list[Stay]:
        """Return the visits of the tour that are complete, in order."""
        stays: list[Stay] = []
        for name in self._tour:
            start = stays[-1].over if stays else 0
            stay = first_stay(self._targets[name], self._time_s, self._poses, start)
            if stay is None:
                break
            stays.append(stay)
        return stays

    def _since_when_at_target(self) -> int:
        """Return the state since which the robot is at its next target, else now."""
        last = len(self._time_s) - 1
        if not self._tour:
            return last
        away = ~is_at(self._targets[self._tour[0]], self._poses)
        return min(last, int(np.flatnonzero(np.append(True, away))[-1]))
