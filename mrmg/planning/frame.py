"""The map's own frame, in which missions are planned wherever the map lies.

Sums of coordinates are rounded differently at different places, and samples are drawn
over the map from west to east; a search that draws by chance would go another way in
the same mission elsewhere. So planning moves the map's corner to the origin and turns
the map by quarters until the fleet starts in its lower left, and replays the controls
it found where the mission really is.

Lengths that planning is made for, such as a grid's cells, are those of robots about a
metre long. For a fleet of much smaller or larger ones all lengths are stated in another
unit, and masses so that energies stay what they are.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import compress
from math import log2, pi, remainder, sqrt, tau
from typing import TypeVar

import numpy as np
import shapely
from shapely.geometry import Polygon

from mrmg.planning.assembly import make_plan
from mrmg.planning.attempt import Attempt
from mrmg.planning.parameters import PlannerParams
from mrmg.planning.problem.problem import Problem
from mrmg.planning.roadmap.fleet import margins_of
from mrmg.plans import Plan
from mrmg.scene.elevation import Elevation
from mrmg.scene.margins import STATES_NONE, Margins, TrackingError
from mrmg.scene.region import Region
from mrmg.scene.robot_model import Limits, RobotModel
from mrmg.scene.types import Finish, Goal, Robot, Scene
from mrmg.world.world import MARGIN_M

_Target = TypeVar("_Target", Goal, Finish)
_Values = TypeVar("_Values", RobotModel, Limits, TrackingError)

DECIMALS = 9
"""Of coordinates in the frame: fewer than what rounding takes away from them."""

CENTRED_M = 1e-6
"""Distance from the map's middle below which a place is in it."""


SEAM_RAD = 0.01
"""Headings lie within a half turn of this, so that 3.1416 stays what it is."""


ORDINARY_M = (0.25, 2.0)
"""Radii of circles about robots for which a metre is the unit: of the fleet's the
geometric mean counts."""

USUAL_M = 0.8
"""Radius that the others have in theirs, but for a power of two: so nothing is rounded
differently."""

MOST_AREA = 1e5
"""Area of the map in squares of a unit smaller than a metre, at most: it bounds the
cells of grids."""


@dataclass(frozen=True, slots=True)
class Frame:
    """Where a map is moved to be planned on.

    Attributes:
        bounds: of the map as it lies [m].
        quarters: quarter turns to the left, 0-3.
        margins: stated for all robots; the robots' own count where they state none.
        unit_m: unit of all lengths in the frame [m].
    """

    bounds: tuple[float, float, float, float]
    quarters: int
    margins: Margins = STATES_NONE
    unit_m: float = 1.0

    @staticmethod
    def of(scene: Scene, margins: Margins = STATES_NONE) -> Frame:
        """Return a scene's frame.

        Maps are not turned if the fleet starts all around the middle, and stay as they
        are if a robot has a user's motion, which may depend on the place.
        """
        if scene.has_custom_motion:
            return Frame((0.0, 0.0, *scene.bounds[2:]), 0, margins, 1.0)
        unit_m = _unit_m(scene, margins)
        x_min, y_min, x_max, y_max = scene.bounds
        start = np.array([robot.pose[:2] for robot in scene.robots])
        offset = start - (0.5 * (x_min + x_max), 0.5 * (y_min + y_max))
        for x, y in (offset.mean(axis=0), offset[0]):
            for quarters in range(4):
                if x < CENTRED_M and y <= -CENTRED_M:
                    return Frame(scene.bounds, quarters, margins, unit_m)
                x, y = -y, x
        return Frame(scene.bounds, 0, margins, unit_m)

    @property
    def is_the_maps(self) -> bool:
        """Whether the map lies in this frame already."""
        moved = self.quarters != 0 or self.bounds[:2] != (0.0, 0.0)
        return not moved and self.unit_m == 1.0

    def params(self, params: PlannerParams) -> PlannerParams:
        """Return parameters for the mission in the frame."""
        if self.unit_m == 1.0:
            return params
        return replace(params, obstacle_margin_m=None, robot_margin_m=None)

    @property
    def _corner(self) -> complex:
        """The corner of the map that lies at the frame's origin, x + iy [m]."""
        x_min, y_min, x_max, y_max = self.bounds
        x = (x_min, x_min, x_max, x_max)[self.quarters]
        return complex(x, (y_min, y_max, y_max, y_min)[self.quarters])

    def points(self, xy: np.ndarray) -> np.ndarray:
        """Return where points of the map are in the frame, shape (n, 2)."""
        place = np.asarray(xy, float).reshape(-1, 2) @ (1.0, 1.0j)
        moved = (place - self._corner) * 1.0j**self.quarters / self.unit_m
        # -0.0 and 0.0 would be different bits.
        return np.round(np.stack([moved.real, moved.imag], axis=1), DECIMALS) + 0.0

    def on_the_map(self, point: tuple[float, float]) -> tuple[float, float]:
        """Return where a point of the frame is on the map [m]."""
        turned = complex(*point) * (-1.0j) ** self.quarters
        place = turned * self.unit_m + self._corner
        return place.real, place.imag

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
        return replace(
            region,
            center=self.points(region.center)[0],
            radius_m=region.radius_m / self.unit_m,
            corners=corners,
        )

    def _robot(self, robot: Robot) -> Robot:
        (x, y), yaw = self.points(np.array(robot.pose[:2]))[0], robot.pose[2]
        finish = robot.finish and self._target(robot.finish)
        pose = (float(x), float(y), self.heading(yaw))
        placed = replace(robot, pose=pose, finish=finish)
        if self.unit_m == 1.0:
            return placed
        obstacle_m, robot_m = margins_of(robot, self.margins)
        margins = Margins(
            obstacle_m=obstacle_m / self.unit_m, robot_m=robot_m / self.unit_m
        )
        model = in_unit(robot.model, self.unit_m)
        return replace(placed, model=model, margins=margins)

    def _target(self, target: _Target) -> _Target:
        yaw = target.heading_rad
        return replace(
            target,
            region=self._region(target.region),
            heading_rad=None if yaw is None else self.heading(yaw),
        )

    def _heights(self, height_m: np.ndarray) -> np.ndarray:
        # Rows go from south to north, so that a turn to the left is one to the right.
        turned = np.rot90(height_m, -self.quarters) / self.unit_m
        turned = np.ascontiguousarray(turned)
        turned.setflags(write=False)
        return turned


def _unit_m(scene: Scene, margins: Margins) -> float:
    """Return the unit of lengths for a scene's robots [m]."""
    radii_m = [robot.model.radius_m for robot in scene.robots]
    radius_m = float(np.exp(np.mean(np.log(radii_m))))
    if ORDINARY_M[0] <= radius_m <= ORDINARY_M[1]:
        return 1.0
    unit_m = float(2.0 ** round(log2(radius_m / USUAL_M)))
    x_min, y_min, x_max, y_max = scene.bounds
    widest_m = max(margins_of(robot, margins)[0] for robot in scene.robots)
    least_m = max(
        sqrt((x_max - x_min) * (y_max - y_min) / MOST_AREA), widest_m / MARGIN_M
    )
    while unit_m < min(least_m, 1.0):
        unit_m *= 2.0
    return unit_m


def in_unit(model: RobotModel, unit_m: float) -> RobotModel:
    """Return a robot model with lengths in another unit, and energies as they are."""
    error = model.tracking_error
    lengths = "footprint_m", "height_m", "wheelbase_m", "track_m", "wheel_radius_m"
    return replace(
        _divided(model, unit_m, *lengths, "center_of_mass_m"),
        unit_m=unit_m,
        limits=_divided(model.limits, unit_m, "v_min_m_s", "v_max_m_s", "u1_max_m_s2"),
        mass_kg=model.mass_kg * unit_m**2,
        tracking_error=error and _divided(error, unit_m, "nominal_m", "disturbed_m"),
    )


def _divided(values: _Values, unit_m: float, *names: str) -> _Values:
    """Return values with some of them in another unit."""
    return replace(values, **{name: getattr(values, name) / unit_m for name in names})


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
    start, fleet = np.zeros_like(problem.start), problem.mission.fleet.copy()
    start[:, :3] = [robot.pose for robot in scene.robots]
    units_m = [robot.model.unit_m for robot in problem.scene.robots]
    fleet["wheelbase"] *= units_m
    mission = problem.mission._replace(fleet=fleet)
    problem = replace(problem, scene=scene, start=start, mission=mission)
    trajectories = [
        problem.trajectory(r, one.control * (unit_m, 1.0))
        for r, (one, unit_m) in enumerate(zip(plan.trajectories, units_m, strict=True))
    ]
    return make_plan(problem, plan.seed, params, trajectories, plan.tours)[0]
