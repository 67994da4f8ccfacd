"""What one robot is to drive, and what was learnt about it so far."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from mrmg.planning.path_following._band_kernels import CostMap
from mrmg.planning.path_following.band import SPACINGS_M, Path, smooth_path
from mrmg.planning.path_following.tracking import Drive
from mrmg.planning.problem.problem import Problem

WALL_SHARE = 0.5
"""Share of the room it needs that a path lacks only where it leads through a wall."""


@dataclass
class RobotTask:
    """One robot's way, and what was learnt about it.

    Attributes:
        tour: numbers of its targets.
        path: its way.
        cost_map: what the way is priced on.
        before: how the robot drove before; None if it did not.
        inflations: places that it was led round.
        cost_m: what the way takes, in metres of plain ground.
    """

    tour: list[int]
    path: Path
    cost_map: CostMap
    before: Drive | None = None
    inflations: list[np.ndarray] = field(default_factory=list)
    cost_m: float = 0.0

    def smooth(self, problem: Problem, spacings_m: Sequence[float]) -> None:
        """Smooth the path; one without targets only leads out of the way."""
        if not self.tour:
            return
        targets = problem.mission.targets
        path, self.cost_m = smooth_path(targets, self.cost_map, self.path, spacings_m)
        if (
            len(spacings_m) > 1
            and clearance_deficit_m(self.cost_map, path)
            > WALL_SHARE * self.cost_map.room
        ):
            self.smooth(problem, SPACINGS_M[-1:])  # few nodes slip through thin walls
        else:
            self.path = path


def clearance_deficit_m(cost_map: CostMap, path: Path) -> float:
    """Return the most clearance that a path lacks, but for where it begins [m]."""
    if len(path.node) < 2:
        return 0.0
    chord = np.diff(path.node, axis=0)
    nose = chord / np.maximum(np.hypot(*chord.T), 1e-9)[:, None]
    nose = nose * path.gear[:, None]
    middle = 0.5 * (path.node[1:] + path.node[:-1])
    disc = middle[:, None] + cost_map.disc[None, :, None] * nose[:, None]
    cell = np.floor((disc - (cost_map.x_min, cost_map.y_min)) / cost_map.cell).astype(
        int
    )
    rows, columns = cost_map.distance.shape
    free = cost_map.distance[
        np.clip(cell[..., 1], 0, rows - 1), np.clip(cell[..., 0], 0, columns - 1)
    ]
    lack = cost_map.room - free.min(axis=1)
    lack[path.way[1:] < float(np.ptp(cost_map.disc)) + cost_map.room] = 0.0
    return float(lack.max())
