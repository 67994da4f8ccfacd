"""Whether robots took the energy that their models say, in a drive as planned."""

from __future__ import annotations

import shlex
from collections.abc import Sequence

from mrmg import shipped
from mrmg.compared import compared
from mrmg.energy.audit_record import RobotAudit
from mrmg.plans import Plan
from mrmg.ranges import Range, require_range
from mrmg.scene.robot_model import RobotModel
from mrmg.scene.types import Scene
from mrmg.simulation.log import ExecutionLog


def model_mismatches(
    scene: Scene,
    plan: Plan,
    log: ExecutionLog,
    robots: Sequence[RobotAudit],
    tolerance_pct: float,
) -> list[str]:
    """Return one sentence for each robot whose model does not describe its energy.

    Only drives that were meant to go as modelled and did are judged: not those under
    disturbances, with events such as a fault or a new plan, by a plan with a rolling
    resistance found on the way, or that were ended early.

    Args:
        scene: what plan and log are of.
        plan: the plan in force.
        log: what was driven.
        robots: accounts of the robots.
        tolerance_pct: largest deviation of measured from planned energy [%].

    Raises:
        UsageError: if the tolerance is none.
    """
    require_range("energy_tolerance_pct", tolerance_pct, Range())
    changed = log.disturbance is not None or log.events or plan.rolling_factor
    if changed or not log.completed:
        return []
    return [
        _sentence(
            scene.robot(item.robot).model, item, error_pct, tolerance_pct, log.plant
        )
        for item in robots
        for error_pct in [_error_pct(scene.robot(item.robot).model, plan, item)]
        if abs(error_pct) > tolerance_pct
    ]


def _error_pct(model: RobotModel, plan: Plan, item: RobotAudit) -> float:
    """Return the deviation, in percent of the planned parts' sizes together.

    Where no part is negative that is the error in the audit. Downhill the slope pays
    for nearly all, and a percentage of the rest is no evidence about the model.
    """
    ledger = plan.ledger
    parts_J = [ledger.total_J(robot=item.robot, part=name) for name in ledger.parts()]
    base_J = max(sum(map(abs, parts_J)), model.energy_model.plain_ground_J_per_m())
    return 100.0 * (item.measured_J - item.planned_J) / base_J


def _sentence(
    model: RobotModel,
    item: RobotAudit,
    error_pct: float,
    tolerance_pct: float,
    plant: str,
) -> str:
    measured, planned = compared(item.measured_J / 1000, item.planned_J / 1000, 2)
    size, allowed = compared(abs(error_pct), tolerance_pct)
    sign = "+" if error_pct > 0.0 else "-"
    return (
        f"the model '{model.name}' does not describe {item.robot}: it took {measured} "
        f"kJ where {planned} kJ were planned ({sign}{size} %, tolerance {allowed} %); "
        f"measure its energy parameters with '{_calibration(model, plant)}'"
    )


def _calibration(model: RobotModel, plant: str) -> str:
    """Return the command line that calibrates a model on a plant."""
    on = "" if plant == "default" else f" --plant {plant}"
    if model.mjcf is None:
        return f"mrmg calibrate MODEL{on}"
    folder = model.mjcf.parent
    is_shipped = folder.resolve().parent == shipped.models_folder().resolve()
    named = folder.name if is_shipped else shlex.quote(str(folder))
    return f"mrmg calibrate {named}{on}"
