"""The rest of a mission as a scene of its own, so that it can be planned anew."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mrmg.energy.visits import is_at
from mrmg.scene.loading import scene_from_document
from mrmg.scene.types import Battery, Robot, Scene
from mrmg.supervision.stays import OngoingStay

_LEAST_J = 1e-9
"""A start energy in a scene must be positive."""

_ROOM_SHARE = 0.02
"""Share of the capacity above the reserve with which a robot can still do something."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FleetCondition:
    """Where a fleet at rest has got to.

    Attributes:
        pose: (x [m], y [m], yaw [rad]) of every robot.
        energy_J: battery content of every robot.
        rolling_factor: rolling resistance of every robot as measured, relative to its
            model's.
        out_of_service: ids of robots that will not move any more.
        visited: ids of goals that need no more visit.
        stays: stays under way at goals without one, by their ids.
        time_s: how much of the mission's time is over.
    """

    pose: Mapping[str, tuple[float, float, float]]
    energy_J: Mapping[str, float]
    rolling_factor: Mapping[str, float]
    out_of_service: frozenset[str] = frozenset()
    visited: frozenset[str] = frozenset()
    stays: Mapping[str, OngoingStay] = field(default_factory=dict)
    time_s: float = 0.0


def remaining_scene(
    scene: Scene,
    condition: FleetCondition,
    *,
    reserve_share: float = 1.0,
    timely: bool = True,
) -> Scene:
    """Return what is left of a mission: same ids, same map, from where the fleet is.

    Robots out of service are obstacles of their footprints' shape for the others, under
    their own ids. A scene may be left without goals or without robots.

    Args:
        scene: the mission as it began.
        condition: of the fleet, at rest.
        reserve_share: share of the batteries' reserves that is still kept, or more of
            them; a battery that is down to its reserve has none left to keep.
        timely: whether what is left of a time limit is still kept; it is not where
            nothing is left.

    Raises:
        SceneError: if robots touch each other or an obstacle.
    """
    document = scene.document
    gone = condition.out_of_service
    document["goals"] = [
        _still_to_stay(goal, condition.stays.get(goal["id"]))
        for goal in document["goals"]
        if goal["id"] not in condition.visited
    ]
    document["obstacles"] = [
        *_obstacles_for_others(document["obstacles"], gone),
        *(
            _wreck(robot, condition.pose[robot.id])
            for robot in scene.robots
            if robot.id in gone
        ),
    ]
    document["robots"] = [
        _continued(entry, scene.robot(entry["id"]), condition, reserve_share)
        for entry in document["robots"]
        if entry["id"] not in gone
    ]
    left_s = document.pop("time_limit", 0.0) - condition.time_s
    if timely and left_s > 0.0:
        document["time_limit"] = left_s
    return scene_from_document(document, source=f"rest of {scene.name}")


def _still_to_stay(goal: dict[str, Any], stay: OngoingStay | None) -> dict[str, Any]:
    """Return a goal's entry with what is left of its dwell time."""
    if stay is None or not goal.get("dwell"):
        return goal
    return {**goal, "dwell": max(goal["dwell"] - stay.stayed_s, 0.0)}


def _obstacles_for_others(
    obstacles: list[dict[str, Any]], gone: frozenset[str]
) -> list[dict[str, Any]]:
    """Return the obstacles that stop a robot in service."""
    kept = []
    for number, obstacle in enumerate(obstacles):
        # Named by place in the list as long as that is the scene's.
        entry = {"id": f"obstacle_{number}", **obstacle}
        if "blocks" in entry:
            entry["blocks"] = [name for name in entry["blocks"] if name not in gone]
        if entry.get("blocks", True):
            kept.append(entry)
    return kept


def _wreck(robot: Robot, pose: tuple[float, float, float]) -> dict[str, Any]:
    """Return the obstacle that a standing robot is."""
    return {
        "id": robot.id,
        "polygon": robot.model.footprint_at(pose).tolist(),
        "height": float(robot.model.height_m),
    }


def _continued(
    entry: dict[str, Any],
    robot: Robot,
    condition: FleetCondition,
    reserve_share: float,
) -> dict[str, Any]:
    battery = robot.battery
    energy_J = min(max(condition.energy_J[robot.id], _LEAST_J), battery.capacity_J)
    # A scene's own factor is in the robot's model already.
    factor = entry.get("rolling_factor", 1.0) * condition.rolling_factor[robot.id]
    reserve = _reserve_left(battery, energy_J / battery.capacity_J, reserve_share)
    own: dict[str, Any] = {"capacity_J": battery.capacity_J, "reserve": reserve}
    if battery.takes_time_to_fill:
        own["charging_power"] = battery.charging_power_W
    return {
        **entry,
        "pose": [float(value) for value in condition.pose[robot.id]],
        "start_energy": {"J": float(energy_J)},
        "battery": own,
        "rolling_factor": float(factor),
        **_home(entry, robot),
    }


def _reserve_left(battery: Battery, charge: float, share: float) -> float:
    """Return the reserve that a battery charged to a share of its capacity can keep."""
    spare = charge - _ROOM_SHARE
    if spare < min(share, 1.0) * battery.reserve_fraction:
        return 0.0
    return min(share * battery.reserve_fraction, spare)


def _home(entry: dict[str, Any], robot: Robot) -> dict[str, Any]:
    """Return where a robot must end that is to end where it once started."""
    if entry.get("finish") != "start" or robot.finish is None:
        return {}
    region = robot.finish.region
    circle = {"center": region.center.tolist(), "radius": region.radius_m}
    return {"finish": {"circle": circle}}


def is_over(scene: Scene, condition: FleetCondition) -> bool:
    """Return whether nothing is left to do: no goal, and all robots where they end.

    Args:
        scene: the mission as it began.
        condition: of the fleet, at rest.
    """
    return condition.visited >= {goal.id for goal in scene.goals} and all(
        is_at(robot.finish, np.array([condition.pose[robot.id]]))[0]
        for robot in scene.robots
        if robot.finish is not None and robot.id not in condition.out_of_service
    )
