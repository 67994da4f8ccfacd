"""What one robot is to drive, and what was learnt about it so far."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from mrmg.planning.path_following._band_kernels import CostMap
from mrmg.planning.path_following.band import Path, smooth_path
from mrmg.planning.path_following.tracking import Drive
from mrmg.planning.problem.problem import Problem


@dataclass
class RobotTask:
    """One robot's way, and what was learnt about it.

    Attributes:
        tour: numbers of its targets.
        path: its way.
        cost_map: what the way is priced on.
        before: how the robot drove before; None if it did not.
    """

    tour: list[int]
    path: Path
    cost_map: CostMap
    before: Drive | None = None

    def smooth(self, problem: Problem, spacings_m: Sequence[float]) -> None:
        """Smooth the path; one without targets only leads out of the way."""
        if not self.tour:
            return
        targets = problem.mission.targets
        self.path, _ = smooth_path(targets, self.cost_map, self.path, spacings_m)
