"""What a motion costs: visits, battery content and ledger of planned or logged motion.

The planner's predicted ledger, the verifier's recomputation and the audit's metered
account all come from here, so that they differ by the motion alone. Each interval
between two states is charged at its midpoint: speed and steering are the means of both
ends, and the multiplier is that of the middle between both positions. Acceleration and
climb are the difference quotients of speed and height, so that inertia adds up to
differences of kinetic energy and grade to those of potential energy.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import accumulate, pairwise
from types import MappingProxyType

import numpy as np

from mrmg.energy.ledger import EnergyLedger, LedgerEntry
from mrmg.energy.model import PARTS
from mrmg.energy.visits import first_stay, visit_of
from mrmg.motion.dynamics import TURN_SPEEDS
from mrmg.plans import Trajectory, Visit
from mrmg.scene.types import Robot, Scene
from mrmg.world.elevation import height_at, load_points
from mrmg.world.terrain import multipliers_at

MEASURED_PARTS = ("drive", "idle", "device")
"""The parts that the work of the drives can be split into."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TimedStates:
    """States of one robot, such as those that were recorded.

    Attributes:
        robot: id of the robot.
        time_s: of each state, increasing, shape (n + 1,).
        state: (x [m], y [m], theta [rad], v [m/s], psi [rad]), shape (n + 1, 5).
    """

    robot: str
    time_s: np.ndarray
    state: np.ndarray


Motion = Trajectory | TimedStates
"""What was planned, or what was recorded."""


FROM_THE_START: Mapping[int, float] = MappingProxyType({})
"""No content but that at the start to reckon a battery from."""

_AS_MODELLED: Mapping[str, np.ndarray] = MappingProxyType({})

SHORTEST_ON_SLOPES_S = 0.1
"""Shortest time charged on its own where there are slopes, a step of the planner.

Simulated ground has edges that shake the speed. On the flat that averages out, as the
drive nearly always pulls; down a slope it idles, and what it lost by pulling for a
moment would count, but not what it gained by the braking after that.
"""


def step_energy_parts(
    scene: Scene, motion: Motion, rolling_factor: np.ndarray | None = None
) -> np.ndarray:
    """Return the battery energy of each interval by part [J], shape (n, len(PARTS)).

    Args:
        scene: gives energy models and terrain.
        motion: planned or logged.
        rolling_factor: by which the rolling resistance differs from the model's over
            each interval, shape (n,); None if it does not.
    """
    time_s, state = motion.time_s, motion.state
    factor = np.ones(len(state) - 1) if rolling_factor is None else rolling_factor
    if scene.elevation is None:
        parts_W = _power_parts(scene, motion, factor)
    else:
        marks_s = np.arange(time_s[0], time_s[-1], SHORTEST_ON_SLOPES_S)
        ends = np.append(np.searchsorted(time_s, marks_s - 1e-6), len(time_s) - 1)
        ends = np.unique(ends)
        coarse = TimedStates(robot=motion.robot, time_s=time_s[ends], state=state[ends])
        spans_W = _power_parts(scene, coarse, factor[ends[:-1]])
        parts_W = np.repeat(spans_W, np.diff(ends), axis=0)
    return np.asarray(parts_W * np.diff(time_s)[:, None])


def _power_parts(
    scene: Scene, motion: Motion, rolling_factor: np.ndarray
) -> np.ndarray:
    robot = scene.robot(motion.robot)
    before, after = motion.state[:-1], motion.state[1:]
    middle = 0.5 * (before + after)
    duration_s = np.diff(motion.time_s)
    acceleration_m_s2 = (after[:, 3] - before[:, 3]) / duration_s
    height_m = height_at(scene, load_points(robot.model, motion.state))
    track_m = robot.model.track_m
    if robot.model.motion_model in TURN_SPEEDS:
        turn_speed = TURN_SPEEDS[robot.model.motion_model](np.tan)
        turn_speed_m_s = turn_speed(middle[:, 3], middle[:, 4], track_m)
    else:
        turn_rad = after[:, 2] - before[:, 2]
        turn_speed_m_s = track_m * np.abs(turn_rad) / duration_s
    rolling, turning = multipliers_at(scene, middle[:, :2])
    return robot.model.energy_model.power_parts(
        speed_m_s=middle[:, 3],
        acceleration_m_s2=acceleration_m_s2,
        turn_speed_m_s=turn_speed_m_s * turning,
        multiplier=rolling_factor * rolling,
        climb_m_s=np.diff(height_m) / duration_s,
    )


def measured_energy_parts(
    robot: Robot, work_J: np.ndarray, time_s: np.ndarray
) -> np.ndarray:
    """Return what a battery lost over each tick by part [J].

    Args:
        robot: whose battery is drawn from.
        work_J: work of the drives, driving (>= 0) and braking (<= 0), shape (n, 2).
        time_s: of the ticks' ends, shape (n + 1,).

    Returns:
        By tick and part of `MEASURED_PARTS`, shape (n, 3).
    """
    model = robot.model.energy_model
    driving_J, braking_J = work_J.T
    drive_J = (
        driving_J / model.drive_efficiency + braking_J * model.regeneration_efficiency
    )
    duration_s = np.diff(time_s)
    idle_J = model.idle_power_W * duration_s
    device_J = model.device_power_W * duration_s
    return np.stack([drive_J, idle_J, device_J], axis=-1)


def find_visits(scene: Scene, motion: Motion, tour: Sequence[str]) -> tuple[Visit, ...]:
    """Return when `motion` visits the targets of `tour`, in the tour's order.

    A visit is the first stay at the target that is long enough and does not begin
    before the previous visit is over (`visiting`); one state may serve several targets
    without dwell time in turn. A target that is not visited any more is left out.

    Args:
        scene: names the targets.
        motion: planned or logged states of one robot.
        tour: ids of goals and stations.

    Raises:
        KeyError: if the tour names a target that the scene does not have.
    """
    return visits_and_energy(scene, motion, tour)[0]


def visits_and_energy(
    scene: Scene,
    motion: Motion,
    tour: Sequence[str],
    energy_J: np.ndarray | None = None,
    reckoned_J: Mapping[int, float] = FROM_THE_START,
    parts: Sequence[str] = PARTS,
) -> tuple[tuple[Visit, ...], np.ndarray, list[LedgerEntry]]:
    """Return visits as `find_visits`, and what `battery_profile` and the ledger say.

    Args:
        scene: names the targets.
        motion: planned or logged states of one robot.
        tour: ids of goals and stations.
        energy_J: of each interval by part, shape (n, len(parts)); None for that of the
            scene's energy model.
        reckoned_J: contents from which the battery is reckoned on, by state.
        parts: names of the columns of `energy_J`.
    """
    visits: list[Visit] = []
    targets = {target.id: target for target in scene.targets()}
    step = 0
    for name in tour:
        target = targets[name]
        stay = first_stay(target, motion.time_s, motion.state, step)
        if stay is None:
            continue
        step = stay.over
        visits.append(visit_of(motion.robot, target, motion.time_s, stay.first))
    if energy_J is None:
        energy_J = step_energy_parts(scene, motion)
    draw_J = energy_J.sum(axis=1)
    content_J, arrival_J = battery_content(scene, motion, draw_J, visits, reckoned_J)
    found = tuple(
        replace(visit, energy_J=arrived_J)
        for visit, arrived_J in zip(visits, arrival_J, strict=True)
    )
    return found, content_J, leg_entries(motion.robot, energy_J, parts, visits)


def battery_profile(
    scene: Scene, motion: Motion, visits: Iterable[Visit]
) -> np.ndarray:
    """Return the battery content at each state [J], shape (n + 1,).

    Where a station fills the battery at once it is the content after that;
    `Visit.energy_J` keeps that on arrival. Energy fed back beyond a full battery is
    lost.

    Args:
        scene: gives the battery and the terrain.
        motion: planned or logged states of one robot.
        visits: those of this robot count, others are passed over.
    """
    draw_J = step_energy_parts(scene, motion).sum(axis=1)
    return battery_content(scene, motion, draw_J, own_visits(motion, visits))[0]


def battery_content(
    scene: Scene,
    motion: Motion,
    draw_J: np.ndarray,
    visits: Sequence[Visit],
    reckoned_J: Mapping[int, float] = FROM_THE_START,
) -> tuple[np.ndarray, list[float]]:
    """Return the battery content under any meter's draws, and that on each arrival.

    Energy fed back or offered beyond a full battery is lost.

    Args:
        scene: gives the battery and the stations.
        motion: planned or logged states of one robot, shape (n + 1, 5).
        draw_J: energy drawn over each interval, shape (n,).
        visits: of this robot, in order of steps.
        reckoned_J: contents from which the battery is reckoned on, by state.

    Returns:
        Content at each state [J], shape (n + 1,), and content on arrival at each of the
        visits [J].
    """
    battery = scene.robot(motion.robot).battery
    regions = {station.id: station.region for station in scene.stations}
    gains_J, full_at = -draw_J, set()
    ends = [visit.step for visit in visits[1:]] + [len(draw_J)]
    for visit, end in zip(visits, ends, strict=False):
        if visit.kind == "station" and not battery.takes_time_to_fill:
            full_at.add(visit.step)
        elif visit.kind == "station":
            span = slice(visit.step, end + 1)
            inside = regions[visit.target].depth(motion.state[span, :2]) >= 0.0
            there_s = np.diff(motion.time_s[span]) * (inside[:-1] & inside[1:])
            gains_J[visit.step : end] += battery.charging_power_W * there_s
    content_J = np.empty(len(draw_J) + 1)
    arrival_J: dict[int, float] = {}
    begun_J = battery.start_J
    starts = sorted({0, *full_at, *reckoned_J})
    for start, end in pairwise([*starts, len(draw_J)]):
        arrival_J[start] = reckoned_J.get(start, begun_J)
        begun_J = battery.capacity_J if start in full_at else arrival_J[start]
        held_J = _held(begun_J, gains_J[start:end], battery.capacity_J)
        content_J[start : end + 1] = held_J
        begun_J = float(held_J[-1])
    arrivals_J = [
        arrival_J.get(visit.step, float(content_J[visit.step])) for visit in visits
    ]
    return content_J, arrivals_J


def _held(begun_J: float, gain_J: np.ndarray, capacity_J: float) -> np.ndarray:
    """Return what a battery holds at first and after each gain; no more goes in."""
    held_J = np.cumsum(np.append(begun_J, gain_J))
    if held_J.max() <= capacity_J:  # mostly, and much sooner than state by state
        return held_J
    gains_J, limit = gain_J.tolist(), capacity_J
    limited = accumulate(gains_J, lambda a, b: min(a + b, limit), initial=begun_J)
    return np.array(list(limited))


def own_visits(motion: Motion, visits: Iterable[Visit]) -> list[Visit]:
    """Return the visits of the motion's robot, in order of steps."""
    own = [visit for visit in visits if visit.robot == motion.robot]
    return sorted(own, key=lambda visit: visit.step)


def plan_ledger(
    scene: Scene,
    motions: Iterable[Motion],
    visits: Iterable[Visit],
    rolling_factor: Mapping[str, np.ndarray] = _AS_MODELLED,
) -> EnergyLedger:
    """Return the account of motions under the energy model, by robot, leg and part.

    Args:
        scene: gives energy models and terrain.
        motions: one per robot, planned or logged.
        visits: of all robots; each ends a leg of its robot.
        rolling_factor: by which the rolling resistance of robots differs from their
            models' over each interval, shape (n,) each.
    """
    visits = tuple(visits)
    entries: list[LedgerEntry] = []
    for motion in motions:
        factor = rolling_factor.get(motion.robot)
        energy_J = step_energy_parts(scene, motion, factor)
        entries += leg_entries(
            motion.robot, energy_J, PARTS, own_visits(motion, visits)
        )
    return EnergyLedger(tuple(entries))


def leg_entries(
    robot: str, energy_J: np.ndarray, parts: Sequence[str], visits: Sequence[Visit]
) -> list[LedgerEntry]:
    """Return the ledger entries of one robot: each interval belongs to one leg.

    Args:
        robot: id of the robot.
        energy_J: by interval and part, shape (n, len(parts)).
        parts: names of the columns.
        visits: of this robot, in order of steps; the way after the last one is a leg
            without target.
    """
    ends = [(visit.step, visit.target) for visit in visits] + [(len(energy_J), "")]
    entries = []
    start = 0
    for leg, (end, target) in enumerate(ends):
        sums_J = energy_J[start:end].sum(axis=0)
        entries += [
            LedgerEntry(robot, leg, target, part, float(part_J))
            for part, part_J in zip(parts, sums_J, strict=True)
        ]
        start = end
    return entries
