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

import numpy as np

from mrmg.energy.audit_record import (
    ENERGY_IMBALANCE,
    MODEL_MISMATCH,
    EnergyAudit,
    RobotAudit,
)
from mrmg.energy.balance import balance_of, imbalances
from mrmg.energy.battery_curves import MeasuredCurve, measured_curves
from mrmg.energy.ledger import EnergyLedger
from mrmg.energy.metering import plan_ledger
from mrmg.energy.mission_failures import mission_failures
from mrmg.energy.model_mismatch import model_mismatches
from mrmg.energy.visits import first_stay
from mrmg.errors import require_types
from mrmg.plans import Plan
from mrmg.scene.types import Scene
from mrmg.simulation.log import ExecutionLog, require_same_mission

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
        UsageError: if the tolerance is none.
        RunFolderError: if the log is of another scene, plan or fleet.
    """
    require_types((scene, Scene), (plan, Plan), (log, ExecutionLog))
    require_same_mission(scene, plan, log)
    measured = measured_curves(scene, plan, log)
    if log.disturbance is not None:
        scene = log.disturbance.actual_scene(scene)
    visits = [visit for curve in measured for visit in curve.visits]
    entries = [entry for curve in measured for entry in curve.entries]
    metered_ledger = plan_ledger(scene, measured, visits, believed_rolling(plan, log))
    goals_visited = _goals_visited(scene, log)
    robots = tuple(
        _robot_audit(
            scene,
            log,
            curve,
            error_m=error_m,
            planned_J=plan.ledger.total_J(robot=curve.robot),
            metered_J=metered_ledger.total_J(robot=curve.robot),
        )
        for curve, error_m in zip(measured, log.tracking_error_m(), strict=True)
    )
    least_J = {curve.robot: curve.least_J for curve in measured}
    mismatches = model_mismatches(scene, plan, log, robots, energy_tolerance_pct)
    failures = {
        **mission_failures(scene, log, goals_visited, least_J, plan.skipped),
        # What was measured is no evidence about a model where it cannot be trusted.
        ENERGY_IMBALANCE: imbalances(robots),
        MODEL_MISMATCH: mismatches,
    }
    reasons = tuple(reason for found in failures.values() for reason in found)
    return EnergyAudit(
        mission_ok=not reasons,
        causes=tuple(cause for cause, found in failures.items() if found),
        reasons=reasons,
        robots=robots,
        visits=tuple(sorted(visits, key=lambda visit: visit.time_s)),
        goals_visited=goals_visited,
        planned=plan.ledger,
        metered=metered_ledger,
        measured=EnergyLedger(tuple(entries)),
    )


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


def _robot_audit(
    scene: Scene,
    log: ExecutionLog,
    curve: MeasuredCurve,
    *,
    error_m: np.ndarray,
    planned_J: float,
    metered_J: float,
) -> RobotAudit:
    robot = scene.robot(curve.robot)
    measured_J = float(curve.drawn_J.sum())
    base_J = max(planned_J, robot.model.energy_model.plain_ground_J_per_m())
    return RobotAudit(
        robot=robot.id,
        planned_J=planned_J,
        metered_J=metered_J,
        measured_J=measured_J,
        metered_error_pct=100.0 * (metered_J - planned_J) / base_J,
        measured_error_pct=100.0 * (measured_J - planned_J) / base_J,
        min_charge_fraction=curve.least_J / robot.battery.capacity_J,
        tracking_rms_m=float(np.sqrt(np.mean(error_m**2))),
        tracking_max_m=float(error_m.max()),
        balance=balance_of(robot, log),
    )


def _goals_visited(scene: Scene, log: ExecutionLog) -> tuple[str, ...]:
    return tuple(
        goal.id
        for goal in scene.goals
        if any(
            first_stay(goal, log.time_s, state, 0) is not None for state in log.state
        )
    )
