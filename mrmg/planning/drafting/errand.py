"""What one robot is to drive, and what was learnt about it so far."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from mrmg.planning.drafting._band_kernels import Surface
from mrmg.planning.drafting.band import SPACINGS_M, Path, tightened
from mrmg.planning.drafting.tracking import SlowPlace
from mrmg.planning.problem.problem import Problem
from mrmg.plans import Trajectory

WALL = 0.5
"""Share of the room it needs that a path lacks only where it leads through a wall."""


@dataclass
class Errand:
    """One robot's way, and what was learnt about it.

    Attributes:
        tour: numbers of its targets.
        path: its way.
        surface: what the way is priced on.
        before: how the robot drove before, and the steps of its visits; None if it did
            not.
        repeated: number of steps that it drives as before.
        swerves: places that it was led round.
        slow: places that it passes slowly.
        longer_s: how much longer it stands at stops than its path says, shape (L,).
        cost_m: what the way takes, in metres of plain ground.
    """

    tour: list[int]
    path: Path
    surface: Surface
    before: tuple[Trajectory, list[int]] | None = None
    repeated: int = 0
    swerves: list[np.ndarray] = field(default_factory=list)
    slow: list[SlowPlace] = field(default_factory=list)
    longer_s: np.ndarray = field(init=False)
    cost_m: float = 0.0

    def __post_init__(self) -> None:
        self.longer_s = np.zeros(len(self.tour))

    def tighten(self, problem: Problem, spacings_m: Sequence[float]) -> None:
        """Draw the path tight; one without targets only leads out of the way."""
        if not self.tour:
            return
        targets = problem.mission.targets
        path, self.cost_m = tightened(targets, self.surface, self.path, spacings_m)
        if (
            len(spacings_m) > 1
            and lack_m(self.surface, path) > WALL * self.surface.room
        ):
            self.tighten(problem, SPACINGS_M[-1:])  # few nodes slip through thin walls
        else:
            self.path = path

    def controls(self) -> np.ndarray:
        """Return the controls that it repeats, shape (n, 2)."""
        if self.before is None:
            return np.zeros((0, 2))
        return self.before[0].control[: self.repeated]


def lack_m(surface: Surface, path: Path) -> float:
    """Return the most clearance that a path lacks, but for where it begins [m]."""
    if len(path.node) < 2:
        return 0.0
    chord = np.diff(path.node, axis=0)
    nose = chord / np.maximum(np.hypot(*chord.T), 1e-9)[:, None]
    nose = nose * path.gear[:, None]
    middle = 0.5 * (path.node[1:] + path.node[:-1])
    disc = middle[:, None] + surface.disc[None, :, None] * nose[:, None]
    cell = np.floor((disc - (surface.x_min, surface.y_min)) / surface.cell).astype(int)
    rows, columns = surface.distance.shape
    free = surface.distance[
        np.clip(cell[..., 1], 0, rows - 1), np.clip(cell[..., 0], 0, columns - 1)
    ]
    lack = surface.room - free.min(axis=1)
    lack[path.way[1:] < float(np.ptp(surface.disc)) + surface.room] = 0.0
    return float(lack.max())
