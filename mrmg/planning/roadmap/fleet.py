"""From a scene's robots to the arrays the kernels work on."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mrmg.errors import Fault, SceneError
from mrmg.motion._kernels import MODEL_ID, USER
from mrmg.motion.user_motion import motion_of
from mrmg.planning.roadmap._fleet_kernels import FLEET, MOST_CORNERS, Spaces
from mrmg.planning.roadmap.slopes import SlopeCost
from mrmg.scene.margins import Margins, kept_margins
from mrmg.scene.robot_model import RobotModel
from mrmg.scene.types import Robot, Scene
from mrmg.world.world import World

RESERVE_MARGIN = 0.01
"""Share of the capacity the planner keeps above the reserve, for execution to use."""

LEAST_MARGIN_M = 1e-6
"""Margin that tells a touch from an overlap [m]."""

PASSAGE_SLACK_M = 0.05
"""Clearance of roadmap edges beyond half the robot's width and its margin."""


def stack_spaces(world: World) -> Spaces:
    """Stack the world's free spaces; bucket starts and edges are counted through."""
    spaces = world.spaces
    start, listed = [], []
    edges = entries = 0
    for space in spaces:
        start.append(space.bucket_start + entries)
        listed.append(space.bucket_edge + edges)
        entries += len(space.bucket_edge)
        edges += len(space.edge)
    return spaces[0]._replace(
        distance=np.stack([space.distance for space in spaces]),
        bucket_start=np.stack(start),
        bucket_edge=np.concatenate(listed),
        edge=np.concatenate([space.edge for space in spaces]),
        allowance=np.stack([space.allowance for space in spaces]),
    )


def passage_m(robot: Robot, margins: Margins) -> float:
    """Return the clearance the line of a robot's reference point needs [m].

    Args:
        robot: the robot.
        margins: stated for all robots; the robot's own count where they state none.
    """
    kept_m = margins_of(robot, margins)[0]
    return round(robot.model.half_width_m + kept_m + PASSAGE_SLACK_M, 6)


def margins_of(robot: Robot, margins: Margins) -> tuple[float, float]:
    """Return the distances that a robot keeps from obstacles and from others [m]."""
    kept = margins.over(kept_margins(robot))
    assert kept.obstacle_m is not None and kept.robot_m is not None
    return kept.obstacle_m, kept.robot_m


class TravelClass(NamedTuple):
    """Robots that share a roadmap and its cost-to-go fields.

    Attributes:
        space: index of their free space.
        passage: clearance of their line of travel [m].
        slope: what slopes cost them.
    """

    space: int
    passage: float
    slope: SlopeCost

    @property
    def leaving(self) -> TravelClass:
        """The class on edges by which robots leave walls.

        They are known to be free (`departure`), though a disc has no room there.
        """
        return self._replace(passage=0.0)


def travel_classes(
    scene: Scene, world: World, margins: Margins
) -> tuple[list[TravelClass], list[int]]:
    """Return the distinct travel classes and each robot's index among them.

    Args:
        scene: the scene.
        world: its geometry.
        margins: stated for all robots.
    """
    keys = [
        TravelClass(
            space=int(world.space_of_robot[i]),
            passage=passage_m(robot, margins),
            slope=SlopeCost.of(scene, robot.model),
        )
        for i, robot in enumerate(scene.robots)
    ]
    distinct = list(dict.fromkeys(keys))
    return distinct, [distinct.index(key) for key in keys]


def motion_addresses(model: RobotModel) -> tuple[int, int]:
    """Return the addresses of a user's compiled step and steer, zeros if it has none.

    They are compiled at the first call.

    Raises:
        SceneError: if that motion model cannot be used.
    """
    if model.motion_model in MODEL_ID:
        return 0, 0
    limits = model.planned_limits
    return motion_of(model).compiled(limits.as_tuple())


def fleet_array(scene: Scene, world: World, margins: Margins) -> np.ndarray:
    """Return the scene's robots as records of FLEET, shape (R,).

    Args:
        scene: the scene.
        world: its geometry.
        margins: stated for all robots.

    Raises:
        SceneError: if a footprint has more corners than the kernels hold, or a user's
            motion model cannot be used.
    """
    fleet = np.zeros(len(scene.robots), FLEET)
    _, fields = travel_classes(scene, world, margins)
    for r, robot in enumerate(scene.robots):
        model, battery = robot.model, robot.battery
        limits = model.planned_limits
        outline = model.footprint_m
        if len(outline) > MOST_CORNERS:
            message = f"has {len(outline)} corners, at most {MOST_CORNERS} are allowed"
            raise SceneError(model.name, [Fault("footprint", message)])
        one = fleet[r]
        one["model"] = MODEL_ID.get(model.motion_model, USER)
        one["step_at"], one["steer_at"] = motion_addresses(model)
        one["wheelbase"] = model.wheelbase_m
        one["track"] = model.track_m
        one["limit"] = limits.as_tuple()
        one["corner"][: len(outline)] = outline
        one["corners"] = len(outline)
        one["middle"] = model.middle_m
        one["radius"] = model.radius_m
        one["turning_radius"] = model.turning_radius_m
        one["passage"] = passage_m(robot, margins)
        one["margin"], one["spacing"] = np.maximum(
            margins_of(robot, margins), LEAST_MARGIN_M
        )
        one["space"] = world.space_of_robot[r]
        one["field"] = fields[r]
        one["energy"] = model.energy_model.coefficients()
        one["plain"] = model.energy_model.plain_ground_J_per_m()
        one["capacity"] = battery.capacity_J
        one["charge"] = battery.charging_power_W
        one["reserve"] = battery.reserve_J + RESERVE_MARGIN * battery.capacity_J
    return fleet
