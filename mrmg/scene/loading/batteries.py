"""Batteries of the robots: capacities and start energies in joules."""

from __future__ import annotations

import math

from mrmg.compared import compared
from mrmg.errors import Fault
from mrmg.scene.loading.faults import EntryError
from mrmg.scene.loading.schema import (
    LONGEST_STAY_S,
    BatteryEntry,
    RobotEntry,
    StartEnergyEntry,
)
from mrmg.scene.robot_model import RobotModel
from mrmg.scene.types import Battery

J_PER_WH = 3600.0
CAPACITIES = ("capacity_J", "capacity_Wh", "capacity_m")


def battery_of(
    robot: RobotEntry, fleet: BatteryEntry, model: RobotModel, path: str
) -> Battery:
    """Return the battery of a robot.

    Args:
        robot: its entry; what its own battery names comes first.
        fleet: the scene's battery, with at most one capacity; what it names comes
            next, then the model's.
        model: its kind.
        path: of the entry in the file.

    Raises:
        EntryError: if there is no such battery.
    """
    own = robot.battery or BatteryEntry()
    require_one_capacity(own, f"{path}.battery")
    own_J, fleet_J = _capacity_J(own, model), _capacity_J(fleet, model)
    capacity_J = own_J or fleet_J or model.battery_capacity_J
    reserve = own.reserve if own.reserve is not None else fleet.reserve or 0.0
    start_J = _start_J(robot.start_energy, capacity_J, model, f"{path}.start_energy")
    if start_J < reserve * capacity_J:
        found, least = compared(start_J, reserve * capacity_J)
        message = f"got {found} J; must not be below the reserve, {least} J"
        raise EntryError(Fault(f"{path}.start_energy", message))
    power_W = own.charging_power or fleet.charging_power or math.inf
    least_W = model.consumers_W + capacity_J / LONGEST_STAY_S
    if power_W < least_W:
        message = (
            f"got {power_W:g} W; {robot.id} itself draws {model.consumers_W:g} W at "
            f"rest, and its battery of {capacity_J:.0f} J must be full within a day; "
            f"give at least {math.ceil(100.0 * least_W) / 100.0:g} W"
        )
        where = f"{path}.battery" if own.charging_power else "battery"
        raise EntryError(Fault(f"{where}.charging_power", message))
    return Battery(
        capacity_J=capacity_J,
        start_J=start_J,
        reserve_fraction=reserve,
        charging_power_W=power_W,
    )


def _joules_of_units(model: RobotModel) -> dict[str, float]:
    plain_J_per_m = model.energy_model.plain_ground_J_per_m()
    return {"J": 1.0, "Wh": J_PER_WH, "m": plain_J_per_m}


def require_one_capacity(entry: BatteryEntry, path: str) -> None:
    """Refuse an entry that states several capacities.

    Raises:
        EntryError: naming them.
    """
    stated = [key for key in CAPACITIES if getattr(entry, key) is not None]
    if len(stated) > 1:
        message = f"has {' and '.join(stated)}; expected at most one capacity"
        raise EntryError(Fault(path, message))


def _capacity_J(entry: BatteryEntry, model: RobotModel) -> float | None:
    """Return the capacity that an entry states; None if it states none."""
    for unit, joules in _joules_of_units(model).items():
        stated: float | None = getattr(entry, f"capacity_{unit}")
        if stated is not None:
            return stated * joules
    return None


def _start_J(
    entry: StartEnergyEntry, capacity_J: float, model: RobotModel, path: str
) -> float:
    unit = entry.given(path)
    joules = {"fraction": capacity_J, **_joules_of_units(model)}
    start_J: float = getattr(entry, unit) * joules[unit]
    if start_J > capacity_J * (1.0 + 1e-12):
        found, most = compared(start_J, capacity_J)
        message = f"got {found} J; must not exceed the capacity, {most} J"
        raise EntryError(Fault(path, message))
    return min(start_J, capacity_J)
