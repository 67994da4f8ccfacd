"""Compare what a mission was planned to cost with what its simulation cost.

Three meters: *planned* is the energy model over the plan, *metered* the same model over
the simulated motion, both with the parameters believed at the time, *measured* the work
of the simulated drives,

    E = W_driving / eta + regeneration * W_braking + (P_idle + P_device) t.

Planned to metered shows what tracking changed, metered to measured what the energy
model misses of the physics.

No battery may fall below its reserve, by what was measured: the rule the verifier holds
plans to, whether or not the robots are as modelled. Under disturbances a battery is as
the disturbance has it. Where there is a time limit, all robots must be at rest by then,
and every visit over.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mrmg.accounting import (
    MEASURED_PARTS,
    LoggedMotion,
    battery_content,
    find_visits,
    leg_entries,
    measured_energy_parts,
    plan_ledger,
)
from mrmg.execution.log import ExecutionLog, require_same_mission
from mrmg.ledger import EnergyLedger, LedgerEntry
from mrmg.mission import Plan, Visit
from mrmg.results.energy_audit import EnergyAudit, RobotAudit, SimulatedVisit
from mrmg.scene.objective import overtime_s
from mrmg.scene.types import Robot, Scene
from mrmg.visiting import crowded_stations, first_stay

AT_REST = 0.02
"""Speed below which a simulated robot is at rest [m/s], and rate of turning [rad/s]."""

_TROUBLE = {
    "lost": "a robot was too far from its plan",
    "diverged": "the physics got out of hand",
    "stalled": "the fleet did not get on",
    "restless": "the fleet did not come to rest",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class _Measured:
    """What the simulation says of one robot.

    Attributes:
        motion: its logged states.
        visits: of its tour's targets, in order; steps are control ticks.
        energy_J: measured over each tick by part, shape (n - 1, 3).
        content_J: measured battery content at each tick, shape (n,).
        arrival_J: content on arrival at each visit.
    """

    motion: LoggedMotion
    visits: tuple[Visit, ...]
    energy_J: np.ndarray
    content_J: np.ndarray
    arrival_J: list[float]

    @property
    def least_J(self) -> float:
        """Least battery content, arrivals included."""
        return min([float(self.content_J.min()), *self.arrival_J])


def audit(scene: Scene, plan: Plan, log: ExecutionLog) -> EnergyAudit:
    """Return the account of a mission that was planned and then simulated.

    Args:
        scene: what both were made for.
        plan: what was to be driven.
        log: what was driven.

    Raises:
        RunFolderError: if the log is of another scene, plan or fleet.
    """
    require_same_mission(scene, plan, log)
    if log.disturbance is not None:
        scene = log.disturbance.actual_scene(scene)
    measured = [_measure(scene, plan, log, index) for index in range(len(log.robots))]
    planned_ledger = plan.ledger
    metered_ledger = plan_ledger(
        scene,
        [item.motion for item in measured],
        [visit for item in measured for visit in item.visits],
        believed_rolling(plan, log),
    )
    measured_ledger = EnergyLedger(
        tuple(entry for item in measured for entry in _measured_entries(item))
    )
    goals_visited = _goals_visited(scene, log)
    failures = {
        log.gave_up or "unfinished": _unfinished(log),
        "ended": _given_up(log, missed=len(goals_visited) < len(scene.goals)),
        "goal missed": _goals_missed(scene, goals_visited),
        "contact": _contacts(log),
        "station shared": _crowded(scene, log),
        "late": _late(scene, log),
        "below reserve": _below_reserve(scene, measured),
        "battery empty": _ran_empty(measured),
    }
    reasons = tuple(reason for found in failures.values() for reason in found)
    return EnergyAudit(
        mission_ok=not reasons,
        causes=tuple(cause for cause, found in failures.items() if found),
        reasons=reasons,
        robots=tuple(
            _robot_audit(
                scene,
                log,
                item,
                planned_J=planned_ledger.total_J(robot=item.motion.robot),
                metered_J=metered_ledger.total_J(robot=item.motion.robot),
            )
            for item in measured
        ),
        visits=_simulated_visits(measured),
        goals_visited=goals_visited,
        planned=planned_ledger,
        metered=metered_ledger,
        measured=measured_ledger,
    )


def _measure(scene: Scene, plan: Plan, log: ExecutionLog, index: int) -> _Measured:
    robot = scene.robots[index]
    motion = LoggedMotion(robot=robot.id, time_s=log.time_s, state=log.state[index])
    visits = find_visits(scene, motion, plan.tours[robot.id])
    energy_J = measured_step_energy(robot, log, index)
    content_J, arrival_J = battery_content(scene, motion, energy_J.sum(axis=1), visits)
    return _Measured(
        motion=motion,
        visits=visits,
        energy_J=energy_J,
        content_J=content_J,
        arrival_J=arrival_J,
    )


def measured_step_energy(robot: Robot, log: ExecutionLog, index: int) -> np.ndarray:
    """Return the measured energy of each tick by part [J].

    Args:
        robot: whose battery is drawn from.
        log: what was driven.
        index: of the robot in the log.

    Returns:
        By tick and part of `MEASURED_PARTS`, shape (n - 1, 3).
    """
    return measured_energy_parts(robot, log.work_J[index], log.time_s)


def believed_rolling(plan: Plan, log: ExecutionLog) -> dict[str, np.ndarray]:
    """Return by what rolling resistance differed from its model's, as was believed.

    Returns:
        Factors of each tick by robot, shape (n - 1,) each; without any where the models
        were believed throughout.
    """
    middle_s = 0.5 * (log.clock_s[1:] + log.clock_s[:-1])
    step = (middle_s / plan.dt_s).astype(int)
    return {
        robot: factor[np.minimum(step, len(factor) - 1)]
        for robot, factor in plan.rolling_factor.items()
    }


def _measured_entries(item: _Measured) -> list[LedgerEntry]:
    return leg_entries(item.motion.robot, item.energy_J, MEASURED_PARTS, item.visits)


def _robot_audit(
    scene: Scene,
    log: ExecutionLog,
    item: _Measured,
    *,
    planned_J: float,
    metered_J: float,
) -> RobotAudit:
    robot = scene.robot(item.motion.robot)
    measured_J = float(item.energy_J.sum())
    base_J = max(planned_J, robot.model.energy_model.plain_ground_J_per_m())
    offset_m = (
        item.motion.state[:, :2] - log.reference[log.robots.index(robot.id), :, :2]
    )
    error_m = np.hypot(offset_m[:, 0], offset_m[:, 1])
    return RobotAudit(
        robot=robot.id,
        planned_J=planned_J,
        metered_J=metered_J,
        measured_J=measured_J,
        metered_error_pct=100.0 * (metered_J - planned_J) / base_J,
        measured_error_pct=100.0 * (measured_J - planned_J) / base_J,
        min_charge_fraction=item.least_J / robot.battery.capacity_J,
        tracking_rms_m=float(np.sqrt(np.mean(error_m**2))),
        tracking_max_m=float(error_m.max()),
    )


def _simulated_visits(measured: list[_Measured]) -> tuple[SimulatedVisit, ...]:
    visits = [
        SimulatedVisit(
            robot=visit.robot,
            target=visit.target,
            kind=visit.kind,
            time_s=visit.time_s,
            energy_J=energy_J,
        )
        for item in measured
        for visit, energy_J in zip(item.visits, item.arrival_J, strict=True)
    ]
    return tuple(sorted(visits, key=lambda visit: visit.time_s))


def _goals_visited(scene: Scene, log: ExecutionLog) -> tuple[str, ...]:
    return tuple(
        goal.id
        for goal in scene.goals
        if any(
            first_stay(goal, log.time_s, state[:, :2], 0) is not None
            for state in log.state
        )
    )


def _unfinished(log: ExecutionLog) -> list[str]:
    if log.completed:
        return []
    why = f" ({_TROUBLE[log.gave_up]})" if log.gave_up in _TROUBLE else ""
    return [f"the simulation was ended early, at {log.time_s[-1]:.1f} s{why}"]


def _given_up(log: ExecutionLog, *, missed: bool) -> list[str]:
    said = {"end": "the mission was ended", "give_up": "goals were given up"}
    return [
        f"{said[event.action]} at {event.time_s:.1f} s: {event.message}"
        for event in log.events
        if event.action in said and missed
    ]


def _goals_missed(scene: Scene, visited: tuple[str, ...]) -> list[str]:
    return [
        f"goal {goal.id} was visited by no robot"
        for goal in scene.goals
        if goal.id not in visited
    ]


def _crowded(scene: Scene, log: ExecutionLog) -> list[str]:
    ways = dict(zip(log.robots, log.state[:, :, :2], strict=True))
    return [
        f"{' and '.join(found.robots)} were both at {found.station} at "
        f"{log.time_s[found.first]:.1f} s, which is for one robot at a time"
        for found in crowded_stations(scene, ways)
    ]


def over_s(scene: Scene, log: ExecutionLog) -> float:
    """Return when a simulated mission was over: all at rest, no stay too short [s].

    Goals that were not visited do not count.
    """
    turning = [robot.model.motion_model != "car" for robot in scene.robots]
    rates = np.concatenate([log.state[:, :, 3], log.state[turning, :, 4]])
    moving = np.flatnonzero((np.abs(rates) > AT_REST).any(axis=0))
    last = min(int(moving.max(initial=-1)) + 1, len(log.time_s) - 1)
    stays = [
        [first_stay(goal, log.time_s, state[:, :2], 0) for state in log.state]
        for goal in scene.goals
    ]
    ends = [[stay.over for stay in found if stay] for found in stays]
    return float(log.time_s[max([last, *(min(found) for found in ends if found)])])


def _late(scene: Scene, log: ExecutionLog) -> list[str]:
    done_s = over_s(scene, log)
    late_s = overtime_s(scene.time_limit_s, done_s)
    if not late_s:
        return []
    return [
        f"the mission was over at {done_s:.2f} s, {late_s:.2f} s after its time limit "
        f"of {scene.time_limit_s:g} s"
    ]


def _contacts(log: ExecutionLog) -> list[str]:
    return [
        f"{contact.robot} touched {contact.other} at {contact.time_s:.2f} s "
        f"near ({contact.x_m:.2f}, {contact.y_m:.2f})"
        for contact in log.contacts
    ]


def _below_reserve(scene: Scene, measured: list[_Measured]) -> list[str]:
    reasons = []
    for item in measured:
        reserve_J = scene.robot(item.motion.robot).battery.reserve_J
        if 0.0 <= item.least_J < reserve_J:
            reasons.append(
                f"{item.motion.robot}'s battery fell to {item.least_J:.0f} J, "
                f"below its reserve of {reserve_J:.0f} J"
            )
    return reasons


def _ran_empty(measured: list[_Measured]) -> list[str]:
    return [
        f"{item.motion.robot}'s battery ran empty, {-item.least_J:.0f} J short"
        for item in measured
        if item.least_J < 0.0
    ]
