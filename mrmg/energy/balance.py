"""Whether the work of each robot's actuators is accounted for in the simulation."""

from __future__ import annotations

from collections.abc import Iterable

from mrmg.compared import compared
from mrmg.energy.audit_record import EnergyBalance, RobotAudit
from mrmg.scene.types import Robot
from mrmg.simulation.log import ExecutionLog

BALANCE_TOLERANCE_PCT = 2.0
"""Largest residual of an energy balance [% of the drives' work]."""


def balance_of(robot: Robot, log: ExecutionLog) -> EnergyBalance | None:
    """Return the energy balance of one robot; None where the log has none."""
    if log.balance_J is None:
        return None
    index = log.robots.index(robot.id)
    work_J = float(log.work_J[index].sum())
    terms_J = map(float, log.balance_J[index])
    steering_J, kinetic_J, potential_J, joints_J, contacts_J = terms_J
    residual_J = work_J + steering_J - kinetic_J - potential_J - joints_J - contacts_J
    base_J = max(abs(work_J), robot.model.energy_model.rolling_force_N)
    return EnergyBalance(
        work_J=work_J,
        steering_J=steering_J,
        kinetic_J=kinetic_J,
        potential_J=potential_J,
        joints_J=joints_J,
        contacts_J=contacts_J,
        residual_J=residual_J,
        residual_pct=100.0 * residual_J / base_J,
    )


def imbalances(robots: Iterable[RobotAudit]) -> list[str]:
    """Return one sentence for each robot whose energy does not balance."""
    reasons = []
    for item in robots:
        balance = item.balance
        if balance is None or abs(balance.residual_pct) <= BALANCE_TOLERANCE_PCT:
            continue
        size, allowed = compared(abs(balance.residual_pct), BALANCE_TOLERANCE_PCT)
        sign = "+" if balance.residual_pct > 0.0 else "-"
        reasons.append(
            f"the energy of {item.robot} does not balance: motion, friction and "
            f"contacts leave {sign}{size} % of the work of its drives unaccounted for "
            f"(tolerance {allowed} %), so that what was measured is not what it took; "
            "see which actuator or force of its MJCF is no drive, no steering servo "
            "and no friction"
        )
    return reasons
