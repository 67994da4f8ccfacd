"""Batteries of the robots: capacities and start energies in joules."""

from __future__ import annotations

import math

from mrmg.compared import compared
from mrmg.errors import Fault
from mrmg.scene.loading.schema import BatteryEntry, RobotEntry, StartEnergyEntry
from mrmg.scene.robot_model import RobotModel
from mrmg.scene.types import Battery

J_PER_WH = 3600.0
_UNITS = ("J", "Wh", "m")


def battery_of(
    robot: RobotEntry, fleet: BatteryEntry, model: RobotModel, path: str
) -> Battery | list[Fault]:
    """Return the battery of a robot, or what is wrong with it.

    Args:
        robot: its entry; what its own battery names comes first.
        fleet: the scene's battery; what it names comes next, then the model's.
        model: its kind.
        path: of the entry in the file.
    """
    own = robot.battery or BatteryEntry()
    for entry, where in ((own, f"{path}.battery"), (fleet, "battery")):
        given = [f"capacity_{unit}" for unit in _UNITS if _capacity(entry, unit)]
        if len(given) > 1:
            message = f"has {' and '.join(given)}; expected at most one capacity"
            return [Fault(where, message)]
    capacity_J = (
        _capacity_J(own, model) or _capacity_J(fleet, model) or model.battery_capacity_J
    )
    reserve = own.reserve if own.reserve is not None else fleet.reserve or 0.0
    start_J = _start_J(robot.start_energy, capacity_J, model, f"{path}.start_energy")
    if isinstance(start_J, Fault):
        return [start_J]
    if start_J < reserve * capacity_J:
        found, least = compared(start_J, reserve * capacity_J)
        message = f"got {found} J; must not be below the reserve, {least} J"
        return [Fault(f"{path}.start_energy", message)]
    power_W = own.charging_power or fleet.charging_power or math.inf
    energy = model.energy_model
    least_W = energy.idle_power_W + energy.device_power_W
    if power_W <= least_W:
        given_W, drawn_W = compared(power_W, least_W)
        message = (
            f"got {given_W} W; {robot.id} itself draws {drawn_W} W at rest, so its "
            "battery would never be full; give more"
        )
        where = f"{path}.battery" if own.charging_power else "battery"
        return [Fault(f"{where}.charging_power", message)]
    return Battery(
        capacity_J=capacity_J,
        start_J=start_J,
        reserve_fraction=reserve,
        charging_power_W=power_W,
    )


def _capacity(entry: BatteryEntry, unit: str) -> float | None:
    value: float | None = getattr(entry, f"capacity_{unit}")
    return value


def _joules(value: float, unit: str, model: RobotModel) -> float:
    per_unit = {
        "J": 1.0,
        "Wh": J_PER_WH,
        "m": model.energy_model.plain_ground_J_per_m(),
    }
    return value * per_unit[unit]


def _capacity_J(entry: BatteryEntry, model: RobotModel) -> float | None:
    for unit in _UNITS:
        value = _capacity(entry, unit)
        if value is not None:
            return _joules(value, unit, model)
    return None


def _start_J(
    entry: StartEnergyEntry, capacity_J: float, model: RobotModel, path: str
) -> float | Fault:
    given = [key for key in ("fraction", *_UNITS) if getattr(entry, key) is not None]
    if len(given) != 1:
        found = " and ".join(given) if given else "no amount"
        return Fault(path, f"has {found}; expected exactly one of fraction, J, Wh, m")
    if given[0] == "fraction":
        assert entry.fraction is not None
        return entry.fraction * capacity_J
    start_J = _joules(getattr(entry, given[0]), given[0], model)
    if start_J > capacity_J * (1.0 + 1e-12):
        found, most = compared(start_J, capacity_J)
        return Fault(path, f"got {found} J; must not exceed the capacity, {most} J")
    return min(start_J, capacity_J)
