"""The verifier's own account of energy: visits, parts and battery of planned motion.

Everything else in this project states physics once, so that planner, controller and
meters cannot disagree. Here that would be a fault: a verifier that judges a plan by the
code that made it finds no error of that code. So this module integrates the energy of a
trajectory anew, from the scene and the trajectory alone, and takes nothing from
`planning`, `energy` or `world`. Property tests hold both to each other.

Over a step of length h, with means v, psi, omega of its ends (the midpoint rule) and
terrain factors k and k_turn in its middle, the drive works

    rolling   C_rr m g k |v| h
    turning   C_turn m g k_turn |v tan psi| h        (a car)
              C_turn m g k_turn track |omega| h      (a differential drive)
    inertia   (m + n I / r^2) (v_1^2 - v_0^2) / 2
    grade     m g (h_1 - h_0), heights below the centre of mass,

and the battery gives the sum over the drive efficiency, or takes it times that of
regeneration where it is negative, besides what runs at all times. Where the drive
brakes, rolling and turning count as if the battery had fed them; inertia and grade
share the rest in proportion.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise

import numpy as np
import shapely
from scipy.interpolate import RegularGridInterpolator

from mrmg.plans import Trajectory, Visit
from mrmg.scene.types import Goal, Robot, Scene, Station

PARTS = ("rolling", "turning", "inertia", "grade", "idle", "device")
"""What a ledger is split into."""

TIME_ROUNDING_S = 1e-6
"""Rounding of times that is forgiven in how long a robot stays."""

INSTANTS = 8
"""Instants of each step at which robots are looked for in a station: every 25 mm of a
step of 0.1 s at 2 m/s."""

GRAVITY_M_S2 = 9.81

SLOPE_SPAN_S = 0.1
"""Shortest time over which ground with slopes is charged."""

Run = tuple[int, int]
"""First state of a run, and the state after its last one."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MotionAccount:
    """What one planned motion comes to.

    Attributes:
        visits: of its tour's targets, in order, with the battery content on arrival.
        parts_J: drawn from the battery over each step by part, shape (n, len(PARTS)).
        content_J: battery content at each state, after a recharge at once there, shape
            (n + 1,).
    """

    visits: tuple[Visit, ...]
    parts_J: np.ndarray
    content_J: np.ndarray

    def entries(self) -> Iterator[tuple[tuple[int, str, str], float]]:
        """Yield ((leg, target, part), energy [J]); a leg ends as its target is visited.

        The way after the last visit is a leg without target.
        """
        ends = [*((visit.step, visit.target) for visit in self.visits), (None, "")]
        starts = [0, *(visit.step for visit in self.visits)]
        for leg, (start, (end, target)) in enumerate(zip(starts, ends, strict=True)):
            sums_J = self.parts_J[start:end].sum(axis=0)
            for part, energy_J in zip(PARTS, sums_J.tolist(), strict=True):
                yield (leg, target, part), energy_J


def account_of(
    scene: Scene, trajectory: Trajectory, tour: Sequence[str]
) -> MotionAccount:
    """Return the account of one robot's motion.

    Args:
        scene: what it moves in.
        trajectory: its states.
        tour: ids of goals and stations that the scene has, in the order of visits.
    """
    targets = {target.id: target for target in scene.targets()}
    stops = _stops(trajectory, [targets[name] for name in tour])
    parts_J = _parts_J(scene, scene.robot(trajectory.robot), trajectory)
    arrival_J, content_J = _contents_J(scene, trajectory, stops, parts_J.sum(axis=1))
    visits = tuple(
        Visit(
            robot=trajectory.robot,
            target=target.id,
            kind="station" if isinstance(target, Station) else "goal",
            step=step,
            time_s=float(trajectory.time_s[step]),
            energy_J=arrival_J[step],
        )
        for target, step in stops
    )
    return MotionAccount(visits=visits, parts_J=parts_J, content_J=content_J)


def stays_of(target: Goal | Station, trajectory: Trajectory) -> list[Run]:
    """Return the runs of states at which a robot is at a target, as it is wanted."""
    return _runs(_is_at(target, trajectory))


def off_heading_rad(goal: Goal, trajectory: Trajectory) -> np.ndarray:
    """Return how far each yaw is off a goal's heading; 0 where it has none."""
    if goal.heading_rad is None:
        return np.zeros(len(trajectory.state))
    # As the angle between two directions, rather than as the planner reckons it.
    along = np.cos(trajectory.state[:, 2] - goal.heading_rad)
    across = np.sin(trajectory.state[:, 2] - goal.heading_rad)
    return np.abs(np.arctan2(across, along))


def longest_stay_s(target: Goal | Station, trajectory: Trajectory) -> float:
    """Return how long the longest stay at a target lasts; -inf without any."""
    lengths = [last - 1 - first for first, last in stays_of(target, trajectory)]
    return max(lengths, default=-np.inf) * trajectory.dt_s


def shared_stays(
    station: Station, trajectories: Sequence[Trajectory]
) -> Iterator[tuple[Trajectory, Trajectory, Run]]:
    """Yield pairs of robots, and when they are at a station at the same time.

    Instants within a step count for the state it begins with: two robots may cross a
    narrow region between two states. The chord stands for the way.
    """
    there = {item.robot: _is_inside(station, item) for item in trajectories}
    for one, other in combinations(trajectories, 2):
        for run in _runs((there[one.robot] & there[other.robot]).any(axis=1)):
            yield one, other, run


def _is_inside(station: Station, trajectory: Trajectory) -> np.ndarray:
    """Return whether a robot is in a station from each state on, shape (n + 1, k)."""
    way = trajectory.state[:, :2]
    chord = np.diff(way, axis=0, append=way[-1:])
    share = np.arange(INSTANTS)[:, None] / INSTANTS
    points = way[:, None] + share * chord[:, None]
    depth_m = station.region.depth(points.reshape(-1, 2))
    return np.asarray(depth_m.reshape(-1, INSTANTS) >= 0.0)


def _is_at(target: Goal | Station, trajectory: Trajectory) -> np.ndarray:
    at = np.asarray(target.region.depth(trajectory.state[:, :2]) >= 0.0)
    if isinstance(target, Goal):
        at &= off_heading_rad(target, trajectory) <= target.heading_tolerance_rad
    return at


def _runs(flags: np.ndarray) -> list[Run]:
    changes = np.flatnonzero(flags[1:] != flags[:-1]) + 1
    ends = [0, *changes.tolist(), len(flags)]
    return [(first, last) for first, last in pairwise(ends) if flags[first]]


def _stops(
    trajectory: Trajectory, tour: Sequence[Goal | Station]
) -> list[tuple[Goal | Station, int]]:
    """Return targets and the states at which their visits begin.

    A visit is the first stay, after the visit before it is over, that lasts the dwell
    time; a stay that began before counts from then on.
    """
    stops: list[tuple[Goal | Station, int]] = []
    free = 0
    for target in tour:
        for begun, last in stays_of(target, trajectory):
            first = max(begun, free)
            steps = (target.dwell_s - TIME_ROUNDING_S) / trajectory.dt_s
            over = first + max(0, int(np.ceil(steps)))
            if over < last:
                stops.append((target, first))
                free = over
                break
    return stops


def _parts_J(scene: Scene, robot: Robot, trajectory: Trajectory) -> np.ndarray:
    """Return what every step draws from the battery, shape (n, len(PARTS))."""
    if scene.elevation is None:
        return _span_parts_J(scene, robot, trajectory.state, trajectory.dt_s)
    span = np.floor((trajectory.time_s + TIME_ROUNDING_S) / SLOPE_SPAN_S)
    ends = np.flatnonzero(np.append(True, span[1:] > span[:-1]))
    ends = np.unique(np.append(ends, len(span) - 1))
    steps = np.diff(ends)
    spans_J = _span_parts_J(
        scene, robot, trajectory.state[ends], trajectory.dt_s * steps
    )
    return np.repeat(spans_J / steps[:, None], steps, axis=0)


def _span_parts_J(
    scene: Scene, robot: Robot, state: np.ndarray, duration_s: float | np.ndarray
) -> np.ndarray:
    """Return what the battery gives between states, shape (n + 1, 5) -> (n, parts)."""
    model = robot.model
    middle = 0.5 * (state[1:] + state[:-1])
    weight_N = model.mass_kg * GRAVITY_M_S2
    rolling_factor, turning_factor = _terrain(scene, middle[:, :2])
    way_m = np.abs(middle[:, 3]) * duration_s
    scrubbed_m = _scrubbed_m(robot, state, middle, duration_s)
    rolling = model.rolling_coefficient * weight_N * rolling_factor * way_m
    turning = model.turning_coefficient * weight_N * turning_factor * scrubbed_m
    is_full = model.energy_preset == "full"
    spin_kg = model.wheel_count * model.wheel_inertia_kg_m2 / model.wheel_radius_m**2
    inertia = is_full * (model.mass_kg + spin_kg) * np.diff(state[:, 3] ** 2) / 2.0
    grade = is_full * weight_N * np.diff(_heights_m(scene, robot, state))
    work = rolling + turning + inertia + grade
    brakes = work < 0.0
    resistance = (rolling + turning) / model.drive_efficiency
    stored = inertia + grade
    # What the battery takes back is inertia's and grade's alone.
    taken = model.regeneration_efficiency * work - resistance
    share = np.full(len(work), 1.0 / model.drive_efficiency)
    share[brakes] = taken[brakes] / stored[brakes]
    consumed = is_full * np.broadcast_to(duration_s, way_m.shape)
    return np.stack(
        [
            rolling / model.drive_efficiency,
            turning / model.drive_efficiency,
            inertia * share,
            grade * share,
            model.idle_power_W * consumed,
            model.device_power_W * consumed,
        ],
        axis=-1,
    )


def _scrubbed_m(
    robot: Robot, state: np.ndarray, middle: np.ndarray, duration_s: float | np.ndarray
) -> np.ndarray:
    """Return the way by which tyres scrub between states [m], shape (n,)."""
    model = robot.model
    if model.motion_model == "car":
        slip = np.abs(middle[:, 3] * np.tan(middle[:, 4]))
        return np.asarray(slip * duration_s)
    if model.motion_model == "unicycle":
        return np.asarray(model.track_m * np.abs(middle[:, 4]) * duration_s)
    return np.asarray(model.track_m * np.abs(np.diff(state[:, 2])))


def _terrain(scene: Scene, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return factors of rolling and turning at points, shape (n, 2) -> (n,) each."""
    rolling, turning = np.ones(len(points)), np.ones(len(points))
    for area in scene.terrain:  # the later one counts
        inside = shapely.contains_xy(area.shape, points)
        rolling[inside], turning[inside] = area.multiplier, area.turning_multiplier
    return rolling, turning


def _heights_m(scene: Scene, robot: Robot, state: np.ndarray) -> np.ndarray:
    """Return the height of the ground below the mass, shape (n, 5) -> (n,)."""
    elevation = scene.elevation
    if elevation is None:
        return np.zeros(len(state))
    heading = np.stack([np.cos(state[:, 2]), np.sin(state[:, 2])], axis=1)
    points = state[:, :2] + robot.model.center_of_mass_m * heading
    west, south, east, north = elevation.bounds
    rows, columns = elevation.height_m.shape
    axes = (np.linspace(south, north, rows), np.linspace(west, east, columns))
    inside = np.clip(points, (west, south), (east, north))
    return np.asarray(
        RegularGridInterpolator(axes, elevation.height_m)(inside[:, ::-1])
    )


def _contents_J(
    scene: Scene,
    trajectory: Trajectory,
    stops: Sequence[tuple[Goal | Station, int]],
    draw_J: np.ndarray,
) -> tuple[list[float], np.ndarray]:
    """Return battery contents on arrival at each state, and after a recharge there.

    A battery never holds more than its capacity. It is filled at once as the visit of
    a station begins, or by its charging power from then on for as long as the robot is
    there, up to its next visit.
    """
    battery = scene.robot(trajectory.robot).battery
    full_at: set[int] = set()
    gain_J = -draw_J
    ends = [*(step for _, step in stops[1:]), len(draw_J)]
    for (target, step), end in zip(stops, ends, strict=False):
        if not isinstance(target, Station):
            continue
        if np.isinf(battery.charging_power_W):
            full_at.add(step)
            continue
        there = _is_at(target, trajectory)
        charged = (there[1:] & there[:-1])[step:end]
        gain_J[step:end] += battery.charging_power_W * trajectory.dt_s * charged
    arrival_J, content_J = [battery.start_J], []
    for step, gained_J in enumerate([*gain_J.tolist(), 0.0]):
        now_J = battery.capacity_J if step in full_at else arrival_J[-1]
        content_J.append(now_J)
        arrival_J.append(min(now_J + gained_J, battery.capacity_J))
    return arrival_J[:-1], np.array(content_J)
