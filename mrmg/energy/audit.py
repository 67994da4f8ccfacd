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

Where a robot was driven as planned, and yet measured differs from planned by more than
a tolerance, its model does not describe it, and the mission has failed, too
(`model_mismatch`). Where the work of its drives, motion, friction and contacts do not
balance, what was measured is worth nothing, and that has failed, too
(`energy_balance`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mrmg.energy.audit_record import (
    ENERGY_IMBALANCE,
    MODEL_MISMATCH,
    EnergyAudit,
    RobotAudit,
    SimulatedVisit,
)
from mrmg.energy.balance import balance_of, imbalances
from mrmg.energy.ledger import EnergyLedger, LedgerEntry
from mrmg.energy.metering import (
    MEASURED_PARTS,
    LoggedMotion,
    battery_content,
    find_visits,
    leg_entries,
    measured_energy_parts,
    plan_ledger,
)
from mrmg.energy.mission_failures import mission_failures
from mrmg.energy.model_mismatch import model_mismatches
from mrmg.energy.visits import first_stay
from mrmg.plans import Plan, Visit
from mrmg.scene.types import Robot, Scene
from mrmg.simulation.log import ExecutionLog, require_same_mission


@dataclass(frozen=True, slots=True, kw_only=True)
class _Measured:
    """What the simulation yields of one robot.

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


ENERGY_TOLERANCE_PCT = 5.0
"""Largest deviation of measured from planned energy of a robot as modelled [%]."""


def audit(
    scene: Scene,
    plan: Plan,
    log: ExecutionLog,
    *,
    energy_tolerance_pct: float = ENERGY_TOLERANCE_PCT,
) -> EnergyAudit:
    """Return the account of a mission that was planned and then simulated.

    Args:
        scene: what both were made for.
        plan: what was to be driven.
        log: what was driven.
        energy_tolerance_pct: by which measured may differ from planned energy of a
            robot, in percent, where nothing was meant to go otherwise than modelled.

    Raises:
        RunFolderError: if the log is of another scene, plan or fleet.
    """
    require_same_mission(scene, plan, log)
    if log.disturbance is not None:
        scene = log.disturbance.actual_scene(scene)
    measured = [_measure(scene, plan, log, index) for index in range(len(log.robots))]
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
    robots = tuple(
        _robot_audit(
            scene,
            log,
            item,
            planned_J=plan.ledger.total_J(robot=item.motion.robot),
            metered_J=metered_ledger.total_J(robot=item.motion.robot),
        )
        for item in measured
    )
    least_J = {item.motion.robot: item.least_J for item in measured}
    failures = {
        **mission_failures(scene, log, goals_visited, least_J, plan.skipped),
        **_energy_failures(scene, plan, log, robots, energy_tolerance_pct),
    }
    reasons = tuple(reason for found in failures.values() for reason in found)
    return EnergyAudit(
        mission_ok=not reasons,
        causes=tuple(cause for cause, found in failures.items() if found),
        reasons=reasons,
        robots=robots,
        visits=_simulated_visits(measured),
        goals_visited=goals_visited,
        planned=plan.ledger,
        metered=metered_ledger,
        measured=measured_ledger,
    )


def _energy_failures(
    scene: Scene,
    plan: Plan,
    log: ExecutionLog,
    robots: tuple[RobotAudit, ...],
    tolerance_pct: float,
) -> dict[str, list[str]]:
    """Return what speaks against the energies themselves, by its cause."""
    mismatches = model_mismatches(scene, plan, log, robots, tolerance_pct)
    # What was measured is no evidence about a model where it cannot be trusted.
    return {ENERGY_IMBALANCE: imbalances(robots), MODEL_MISMATCH: mismatches}


def _measure(scene: Scene, plan: Plan, log: ExecutionLog, index: int) -> _Measured:
    robot = scene.robots[index]
    motion = log.driven_motions()[index]
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
        balance=balance_of(robot, log),
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
            first_stay(goal, log.time_s, state, 0) is not None for state in log.state
        )
    )
