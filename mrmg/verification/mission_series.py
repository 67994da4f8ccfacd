"""What a mission looks like over time: activities, distances, tracking, terrain.

Everything is computed from the plan and the log alone, for charts and figures.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from mrmg.energy.audit import believed_rolling, measured_step_energy
from mrmg.energy.metering import LoggedMotion, Motion, find_visits, step_energy_parts
from mrmg.energy.visits import runs
from mrmg.plans import Plan, Visit
from mrmg.scene.robot_model import RobotModel
from mrmg.scene.types import Robot, Scene
from mrmg.simulation.log import ExecutionLog
from mrmg.world.terrain import multiplier_at

DRIVING, WAITING, CHARGING, FINISHED = "driving", "waiting", "charging", "finished"
BROKEN = "broken"
"""What a robot can be doing."""

_STANDING_M_S = 0.02
_SHORTEST_WAIT_S = 0.5


@dataclass(frozen=True, slots=True, kw_only=True)
class Activity:
    """A span of time in which a robot does one thing.

    Attributes:
        kind: `DRIVING`; `WAITING`, standing for half a second or more; `CHARGING`, from
            entering a station of its tour to leaving the region; `FINISHED`, standing
            to the end; or `BROKEN`, from when it broke down.
        start_s, end_s: when.
        target: id of the station where charging, else "".
    """

    kind: str
    start_s: float
    end_s: float
    target: str = ""


def logged_motions(log: ExecutionLog) -> tuple[LoggedMotion, ...]:
    """Return the motion of each robot in the simulation."""
    return tuple(
        LoggedMotion(robot=robot, time_s=log.time_s, state=state)
        for robot, state in zip(log.robots, log.state, strict=True)
    )


def shown_motions(plan: Plan, log: ExecutionLog | None) -> tuple[Motion, ...]:
    """Return what was driven, or what was planned where nothing was driven yet."""
    return plan.trajectories if log is None else logged_motions(log)


def shown_visits(scene: Scene, plan: Plan, motion: Motion) -> tuple[Visit, ...]:
    """Return the visits of a planned or driven motion."""
    return find_visits(scene, motion, plan.tours.get(motion.robot, ()))


def activities(
    scene: Scene,
    motion: Motion,
    visits: Iterable[Visit],
    broken_s: float | None = None,
) -> tuple[Activity, ...]:
    """Return what a robot does, span by span, without gaps.

    Args:
        scene: gives the stations' regions.
        motion: planned or driven.
        visits: of this robot; those of stations begin spans of charging.
        broken_s: when it broke down; None if it did not.
    """
    kinds = np.full(len(motion.time_s), DRIVING, dtype=object)
    standing = np.abs(motion.state[:, 3]) < _STANDING_M_S
    for start, end in runs(standing):
        if end == len(standing):
            kinds[start:] = FINISHED
        elif motion.time_s[end] - motion.time_s[start] >= _SHORTEST_WAIT_S:
            kinds[start:end] = WAITING
    names = np.full(len(kinds), "", dtype=object)
    regions = {station.id: station.region for station in scene.stations}
    for visit in visits:
        if visit.kind == "station":
            inside = regions[visit.target].depth(motion.state[visit.step :, :2]) >= 0.0
            left = visit.step + (len(inside) if inside.all() else int(inside.argmin()))
            kinds[visit.step : left] = CHARGING
            names[visit.step : left] = visit.target
    if broken_s is not None:
        kinds[motion.time_s >= broken_s] = BROKEN
        names[motion.time_s >= broken_s] = ""
    changes = (kinds[1:] != kinds[:-1]) | (names[1:] != names[:-1])
    edges = [0, *(np.flatnonzero(changes) + 1).tolist(), len(kinds) - 1]
    return tuple(
        Activity(
            kind=kinds[start],
            start_s=float(motion.time_s[start]),
            end_s=float(motion.time_s[end]),
            target=names[start],
        )
        for start, end in zip(edges, edges[1:], strict=False)
        if end > start
    )


def visit_ranks(plan: Plan) -> dict[str, list[tuple[str, int]]]:
    """Return the visits of each target as (robot, rank in its tour from 1)."""
    ranks: dict[str, list[tuple[str, int]]] = {}
    for robot, tour in plan.tours.items():
        for rank, target in enumerate(tour, start=1):
            ranks.setdefault(target, []).append((robot, rank))
    return ranks


def way_to(states: np.ndarray) -> np.ndarray:
    """Return the way driven up to each state [m], shape (n,)."""
    steps_m = np.hypot(*np.diff(states[:, :2], axis=0).T)
    return np.concatenate([[0.0], np.cumsum(steps_m)])


def breakdowns(log: ExecutionLog | None) -> dict[str, float]:
    """Return when each robot that broke down did so [s], by robot."""
    events = log.events if log is not None else ()
    return {event.robot: event.time_s for event in events if event.cause == "fault"}


def standing_of(robot: str, plan: Plan, log: ExecutionLog | None) -> str:
    """Return "broken down", "not used" of a robot without a tour, or ""."""
    if robot in breakdowns(log):
        return "broken down"
    return "" if plan.tours.get(robot) else "not used"


def tracking_error(log: ExecutionLog) -> np.ndarray:
    """Return each robot's distance from the plan at each tick [m], shape (R, n)."""
    offset_m = log.state[:, :, :2] - log.reference[:, :, :2]
    return np.asarray(np.hypot(offset_m[..., 0], offset_m[..., 1]))


def footprints(model: RobotModel, poses: np.ndarray) -> np.ndarray:
    """Return a robot's outline at poses (x, y, theta, ...), as n polygons [m]."""
    cos, sin = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    turn = np.stack([cos, -sin, sin, cos], axis=1).reshape(-1, 1, 2, 2)
    corners = (turn @ model.footprint_m[None, :, :, None])[..., 0]
    return np.asarray(shapely.polygons(corners + poses[:, None, :2]))


def obstacle_distance(scene: Scene, robot: Robot, poses: np.ndarray) -> np.ndarray:
    """Return the distance to the nearest obstacle that stops a robot, or to the bounds.

    Args:
        scene: gives obstacles and bounds.
        robot: whose footprint it is.
        poses: (x, y, theta, ...), shape (n, k).

    Returns:
        Distance [m], 0 on contact, shape (n,).
    """
    shapes = footprints(robot.model, poses)
    blocking = [item.shape for item in scene.barriers if item.stops(robot.id)]
    distance = np.asarray(
        shapely.distance(shapes, shapely.boundary(shapely.box(*scene.bounds)))
    )
    if not blocking:
        return distance
    tree = shapely.STRtree(blocking)
    found, nearest = tree.query_nearest(shapes, return_distance=True, all_matches=False)
    distance[found[0]] = np.minimum(distance[found[0]], nearest)
    return distance


def robot_distance(robots: Sequence[Robot], poses: Sequence[np.ndarray]) -> np.ndarray:
    """Return each robot's distance to the nearest other one.

    Args:
        robots: at least two.
        poses: of each robot (x, y, theta, ...), shape (n, k) each.

    Returns:
        Distance [m], shape (R, n).
    """
    shapes = [
        footprints(robot.model, at) for robot, at in zip(robots, poses, strict=True)
    ]
    nearest = np.full((len(shapes), len(shapes[0])), np.inf)
    for one in range(len(shapes)):
        for other in range(one):
            apart = shapely.distance(shapes[one], shapes[other])
            nearest[one] = np.minimum(nearest[one], apart)
            nearest[other] = np.minimum(nearest[other], apart)
    return nearest


@dataclass(frozen=True, slots=True, kw_only=True)
class TerrainEnergy:
    """What the fleet spent on ground of one multiplier.

    Attributes:
        multiplier: of the ground.
        planned_m, driven_m: way.
        planned_J, metered_J, measured_J: energy by the three meters of the audit; None,
            like `driven_m`, where nothing was driven.
    """

    multiplier: float
    planned_m: float
    planned_J: float
    driven_m: float | None = None
    metered_J: float | None = None
    measured_J: float | None = None


def energy_by_terrain(
    scene: Scene, plan: Plan, log: ExecutionLog | None
) -> tuple[TerrainEnergy, ...]:
    """Return the energy of the whole fleet by terrain class, from easy to hard.

    Each interval belongs to the ground under its middle, as in the energy model.
    """
    planned = _by_class(
        scene,
        plan.trajectories,
        _model_energy(scene, plan.trajectories, plan.rolling_factor),
    )
    if log is None:
        return tuple(
            TerrainEnergy(multiplier=key, planned_m=way_m, planned_J=energy_J)
            for key, (way_m, energy_J) in sorted(planned.items())
        )
    driven, rolling = logged_motions(log), believed_rolling(plan, log)
    metered = _by_class(scene, driven, _model_energy(scene, driven, rolling))
    work_J = [
        measured_step_energy(scene.robot(robot), log, index).sum(axis=1)
        for index, robot in enumerate(log.robots)
    ]
    measured = _by_class(scene, driven, work_J)
    nothing = (0.0, 0.0)
    return tuple(
        TerrainEnergy(
            multiplier=key,
            planned_m=planned.get(key, nothing)[0],
            planned_J=planned.get(key, nothing)[1],
            driven_m=metered.get(key, nothing)[0],
            metered_J=metered.get(key, nothing)[1],
            measured_J=measured.get(key, nothing)[1],
        )
        for key in sorted({*planned, *metered})
    )


def _model_energy(
    scene: Scene, motions: Iterable[Motion], rolling: Mapping[str, np.ndarray]
) -> list[np.ndarray]:
    return [
        step_energy_parts(scene, motion, rolling.get(motion.robot)).sum(axis=1)
        for motion in motions
    ]


def _by_class(
    scene: Scene, motions: Iterable[Motion], energies_J: Sequence[np.ndarray]
) -> dict[float, tuple[float, float]]:
    """Return (way [m], energy [J]) of all motions by multiplier."""
    sums: dict[float, tuple[float, float]] = {}
    for motion, energy_J in zip(motions, energies_J, strict=True):
        points = motion.state[:, :2]
        ground = multiplier_at(scene, 0.5 * (points[:-1] + points[1:]))
        way_m = np.hypot(*np.diff(points, axis=0).T)
        for key in np.unique(ground):
            on = ground == key
            before = sums.get(float(key), (0.0, 0.0))
            sums[float(key)] = (
                before[0] + float(way_m[on].sum()),
                before[1] + float(energy_J[on].sum()),
            )
    return sums
