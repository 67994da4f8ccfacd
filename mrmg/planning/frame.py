"""The map's own frame, in which missions are planned wherever the map lies.

Sums of coordinates are rounded differently at different places, and samples are drawn
over the map from west to east; a search that draws by chance would go another way in
the same mission elsewhere. So planning moves the map's corner to the origin and turns
the map by quarters until the fleet starts in its lower left, and replays the controls
it found where the mission really is.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import compress
from math import pi, remainder, tau
from typing import TypeVar

import numpy as np
import shapely
from shapely.geometry import Polygon

from mrmg.motion._kernels import MODEL_ID
from mrmg.planning.assembly import make_plan
from mrmg.planning.attempt import Attempt
from mrmg.planning.parameters import PlannerParams
from mrmg.planning.problem.problem import Problem
from mrmg.plans import Plan
from mrmg.scene.elevation import Elevation
from mrmg.scene.region import Region
from mrmg.scene.types import Finish, Goal, Robot, Scene

_Target = TypeVar("_Target", Goal, Finish)

DECIMALS = 9
"""Of coordinates in the frame: fewer than what rounding takes away from them."""

CENTRED_M = 1e-6
"""Distance from the map's middle below which a place is in it."""


SEAM_RAD = 0.01
"""Headings lie within a half turn of this, so that 3.1416 stays what it is."""


@dataclass(frozen=True, slots=True)
class Frame:
    """Where a map is moved to be planned on.

    Attributes:
        bounds: of the map as it lies [m].
        quarters: quarter turns to the left, 0-3.
    """

    bounds: tuple[float, float, float, float]
    quarters: int

    @staticmethod
    def of(scene: Scene) -> Frame:
        """Return a scene's frame.

        Maps are not turned if the fleet starts all around the middle, nor moved or
        turned if a robot has a user's motion, which may depend on the place.
        """
        if any(robot.model.motion_model not in MODEL_ID for robot in scene.robots):
            return Frame((0.0, 0.0, *scene.bounds[2:]), 0)
        x_min, y_min, x_max, y_max = scene.bounds
        start = np.array([robot.pose[:2] for robot in scene.robots])
        offset = start - (0.5 * (x_min + x_max), 0.5 * (y_min + y_max))
        for x, y in (offset.mean(axis=0), offset[0]):
            for quarters in range(4):
                if x < CENTRED_M and y <= -CENTRED_M:
                    return Frame(scene.bounds, quarters)
                x, y = -y, x
        return Frame(scene.bounds, 0)

    @property
    def is_the_maps(self) -> bool:
        """Whether the map lies in this frame already."""
        return self.quarters == 0 and self.bounds[:2] == (0.0, 0.0)

    def points(self, xy: np.ndarray) -> np.ndarray:
        """Return where points of the map are in the frame [m], shape (n, 2)."""
        x_min, y_min, x_max, y_max = self.bounds
        x, y = np.asarray(xy, float).reshape(-1, 2).T
        moved = (
            (x - x_min, y - y_min),
            (y_max - y, x - x_min),
            (x_max - x, y_max - y),
            (y - y_min, x_max - x),
        )[self.quarters]
        # -0.0 and 0.0 would be different bits.
        return np.round(np.stack(moved, axis=1), DECIMALS) + 0.0

    def on_the_map(self, point: tuple[float, float]) -> tuple[float, float]:
        """Return where a point of the frame is on the map [m]."""
        x_min, y_min, x_max, y_max = self.bounds
        across, up = point
        return (
            (across + x_min, up + y_min),
            (up + x_min, y_max - across),
            (x_max - across, y_max - up),
            (x_max - up, across + y_min),
        )[self.quarters]

    def heading(self, yaw: float) -> float:
        """Return the heading in the frame that is `yaw` on the map [rad]."""
        turned = yaw + 0.5 * pi * self.quarters
        return round(remainder(turned - SEAM_RAD, tau) + SEAM_RAD, DECIMALS)

    def scene(self, scene: Scene) -> Scene:
        """Return the mission in the frame."""
        if self.is_the_maps:
            return scene
        corners = self.points(np.array(self.bounds).reshape(2, 2))
        bounds = (0.0, 0.0, *corners.max(axis=0).tolist())
        elevation = scene.elevation and Elevation(
            bounds=bounds, height_m=self._heights(scene.elevation.height_m)
        )
        return replace(
            scene,
            bounds=bounds,
            obstacles=tuple(
                replace(item, shape=self._shape(item.shape)) for item in scene.barriers
            ),
            terrain=tuple(
                replace(item, shape=self._shape(item.shape)) for item in scene.terrain
            ),
            goals=tuple(self._target(item) for item in scene.goals),
            stations=tuple(
                replace(item, region=self._region(item.region))
                for item in scene.stations
            ),
            robots=tuple(self._robot(robot) for robot in scene.robots),
            elevation=elevation,
        )

    def _shape(self, shape: Polygon) -> Polygon:
        return shapely.transform(shape, self.points)

    def _region(self, region: Region) -> Region:
        corners = self.points(region.corners)
        if len(corners):
            # Scene files leave the lowest, or of two the left one, for the last.
            lowest = np.lexsort(corners.T)[0]
            corners = np.roll(corners, -1 - lowest, axis=0)
        return replace(region, center=self.points(region.center)[0], corners=corners)

    def _robot(self, robot: Robot) -> Robot:
        (x, y), yaw = self.points(np.array(robot.pose[:2]))[0], robot.pose[2]
        finish = robot.finish and self._target(robot.finish)
        pose = (float(x), float(y), self.heading(yaw))
        return replace(robot, pose=pose, finish=finish)

    def _target(self, target: _Target) -> _Target:
        yaw = target.heading_rad
        return replace(
            target,
            region=self._region(target.region),
            heading_rad=None if yaw is None else self.heading(yaw),
        )

    def _heights(self, height_m: np.ndarray) -> np.ndarray:
        # Rows go from south to north, so that a turn to the left is one to the right.
        turned = np.ascontiguousarray(np.rot90(height_m, -self.quarters))
        turned.setflags(write=False)
        return turned


def on_the_map(
    attempt: Attempt, problem: Problem, scene: Scene, params: PlannerParams
) -> Attempt:
    """Return an attempt's plans where the mission really is.

    Args:
        attempt: at the mission in its frame.
        problem: that mission.
        scene: the mission as it lies.
        params: the attempt's parameters.
    """
    if problem.scene is scene:
        return attempt
    moved = [_moved(plan, problem, scene, params) for plan in attempt.plans]
    return replace(
        attempt,
        plans=[plan for plan in moved if plan],
        found_at=list(compress(attempt.found_at, moved)),
    )


def _moved(
    plan: Plan, problem: Problem, scene: Scene, params: PlannerParams
) -> Plan | None:
    """Return the plan whose controls are those of a plan in the frame.

    None if accounting refuses what it accepted a nanometre away.
    """
    start = np.zeros_like(problem.start)
    start[:, :3] = [robot.pose for robot in scene.robots]
    problem = replace(problem, scene=scene, start=start)
    trajectories = [
        problem.trajectory(r, one.control) for r, one in enumerate(plan.trajectories)
    ]
    return make_plan(problem, plan.seed, params, trajectories, plan.tours)
