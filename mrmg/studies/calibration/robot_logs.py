"""Logs of real robots as CSV files: how fast a robot went, and what power it drew."""

from __future__ import annotations

import csv
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mrmg.errors import Fault, FileError
from mrmg.scene.robot_model import RobotModel

MAX_BYTES = 200_000_000
"""Largest log that is read: a day at 50 rows a second has a tenth of it."""

STILL = 0.005
"""Speed [m/s] and yaw rate [rad/s] below which a robot stands."""

LEAST_ROWS = 10
"""Fewest rows of which a power can be found."""

COLUMNS = {
    "time": ("time", "t", "timestamp"),
    "speed_left": ("vell", "vleft", "velleft", "speedleft", "velocityleft"),
    "speed_right": ("velr", "vright", "velright", "speedright", "velocityright"),
    "speed": ("v", "speed", "vel", "velocity"),
    "yaw_rate": ("yawrate", "omega", "w", "angularvelocity"),
    "power": ("power", "p"),
    "current_left": ("curl", "ileft", "curleft", "currentleft"),
    "current_right": ("curr", "iright", "curright", "currentright"),
    "current": ("current", "i", "cur"),
    "voltage_left": ("voltl", "uleft", "voltleft", "voltageleft"),
    "voltage_right": ("voltr", "uright", "voltright", "voltageright"),
    "voltage": ("voltage", "u", "volt", "volts"),
}
"""Names of columns by what they hold; case, underscores and units do not count."""

_UNITS = ("ms", "rads", "s", "a", "w", "v", "mps", "radps")


@dataclass(frozen=True, slots=True, kw_only=True)
class LoggedRun:
    """One run of a robot on one terrain.

    Attributes:
        file: as it was named.
        terrain: name of the terrain.
        time_s: of each row, shape (n,).
        speed_m_s: forward, shape (n,).
        yaw_rate_rad_s: to the left, shape (n,).
        power_W: drawn from the battery, shape (n,).
        of_motors: whether the power is that of the motors alone, nothing at rest.
    """

    file: str
    terrain: str
    time_s: np.ndarray
    speed_m_s: np.ndarray
    yaw_rate_rad_s: np.ndarray
    power_W: np.ndarray
    of_motors: bool = False

    @property
    def weight_s(self) -> np.ndarray:
        """Time that each row stands for (trapezoidal rule), shape (n,)."""
        steps_s = np.diff(self.time_s)
        halves_s = 0.5 * (np.append(steps_s, 0.0) + np.append(0.0, steps_s))
        return np.asarray(halves_s)

    @property
    def energy_J(self) -> float:
        """What the run took."""
        return float(self.power_W @ self.weight_s)

    @property
    def at_rest(self) -> np.ndarray:
        """Which rows, and those beside them, have the robot standing, shape (n,)."""
        still = (np.abs(self.speed_m_s) < STILL) & (np.abs(self.yaw_rate_rad_s) < STILL)
        around = np.convolve(still, np.ones(5), "same")
        return np.asarray(around >= 5.0)


def read_run(file: str, terrain: str, model: RobotModel) -> LoggedRun:
    """Read the log of a run.

    Args:
        file: path of a CSV file.
        terrain: what the robot drove on.
        model: gives wheel radius, effective track and motor constants.

    Raises:
        FileError: if the file cannot be read, lacks columns, or holds what no run is.
    """
    columns = _columns(Path(file), file)
    time_s = columns["time"]
    late = np.flatnonzero(np.diff(time_s) <= 0.0)
    if len(late):
        line = int(late[0]) + 3
        raise FileError(file, [Fault("time", "must increase", line=line)])
    speed_m_s, yaw_rate_rad_s, sides = _motion(columns, model, file)
    run = LoggedRun(
        file=file,
        terrain=terrain,
        time_s=time_s,
        speed_m_s=speed_m_s,
        yaw_rate_rad_s=yaw_rate_rad_s,
        power_W=_power(columns, sides, model, file),
        of_motors="power" not in columns and _by_side(columns, "voltage") is None,
    )
    if run.energy_J <= 0.0:
        message = f"takes {run.energy_J:.4g} J in all; expected more than none"
        raise FileError(file, [Fault("power", message)])
    return run


def _columns(path: Path, source: str) -> dict[str, np.ndarray]:
    """Return the known columns of a file by what they hold."""
    try:
        if path.stat().st_size > MAX_BYTES:
            raise FileError(source, [Fault("", f"larger than {MAX_BYTES} bytes")])
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "is no text in UTF-8"
        raise FileError(source, [Fault("", f"cannot be read: {reason}")]) from error
    try:
        rows = [row for row in csv.reader(text.splitlines()) if any(row)]
    except csv.Error as error:
        raise FileError(source, [Fault("", f"is no CSV: {error}")]) from error
    names = [_kind(name) for name in rows[0]] if rows else []
    twice = {kind for kind in names if kind and names.count(kind) > 1}
    if twice:
        message = f"{' and '.join(sorted(twice))} named by more than one column"
        raise FileError(source, [Fault("columns", message)])
    if len(rows) <= LEAST_ROWS:
        message = f"has {max(len(rows) - 1, 0)} rows; at least {LEAST_ROWS} are needed"
        raise FileError(source, [Fault("", message)])
    known = {kind: at for at, kind in enumerate(names) if kind}
    if "time" not in known:
        message = f"has no column 'time'; it has {', '.join(rows[0])}"
        raise FileError(source, [Fault("columns", message)])
    return {
        kind: np.array(
            [
                _number(row, at, line, source)
                for line, row in enumerate(rows[1:], start=2)
            ]
        )
        for kind, at in known.items()
    }


def _number(row: list[str], column: int, line: int, source: str) -> float:
    text = row[column] if column < len(row) else ""
    try:
        value = float(text)
    except ValueError:
        value = np.nan
    if not np.isfinite(value):
        message = f"got '{text[:40]}'; expected a finite number"
        raise FileError(source, [Fault(f"column {column + 1}", message, line=line)])
    return value


def _kind(name: str) -> str:
    """Return what a column of that name holds; "" for nothing that is known."""
    plain = re.sub(r"[^a-z]", "", re.sub(r"[\[(].*", "", name.lower()))
    for kind, names in COLUMNS.items():
        if plain in names or any(plain == known + u for known in names for u in _UNITS):
            return kind
    return ""


def _motion(
    columns: Mapping[str, np.ndarray], model: RobotModel, source: str
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return speed, yaw rate, and the speeds of both sides, shape (2, n)."""
    track_m = model.skid_track_m or model.track_m
    if {"speed_left", "speed_right"} <= set(columns):
        left, right = columns["speed_left"], columns["speed_right"]
        return 0.5 * (left + right), (right - left) / track_m, np.stack([left, right])
    if {"speed", "yaw_rate"} <= set(columns):
        speed, yaw_rate = columns["speed"], columns["yaw_rate"]
        half = 0.5 * track_m * yaw_rate
        return speed, yaw_rate, np.stack([speed - half, speed + half])
    message = "lack the motion: expected velL and velR, or v and yaw_rate"
    raise FileError(source, [Fault("columns", message)])


def _power(
    columns: Mapping[str, np.ndarray],
    sides_m_s: np.ndarray,
    model: RobotModel,
    source: str,
) -> np.ndarray:
    """Return the electric power [W] by the best of the columns there are."""
    if "power" in columns:
        return columns["power"]
    current = _by_side(columns, "current", whole_share=0.5)
    volts = _by_side(columns, "voltage")
    if current is not None and volts is not None:
        return np.asarray((current * volts).sum(axis=0))
    if current is not None and model.motor is not None:
        radius_m = model.wheel_radius_m
        power_W = [
            model.motor.power_W(amperes, speed, radius_m)
            for amperes, speed in zip(current, sides_m_s, strict=True)
        ]
        return np.asarray(power_W[0] + power_W[1])
    message = "lack the power: expected power, or current and voltage"
    if current is not None:
        message += (
            f", or a block 'motor' in the robot.yaml of '{model.name}' with "
            "torque_constant, back_emf_constant, resistance, gear_ratio and "
            "gear_efficiency"
        )
    else:
        message += ", or current with the motor constants of robot.yaml"
    raise FileError(source, [Fault("columns", message)])


def _by_side(
    columns: Mapping[str, np.ndarray], name: str, *, whole_share: float = 1.0
) -> np.ndarray | None:
    """Return a quantity of both sides, shape (2, n); None if it was not logged."""
    left, right = f"{name}_left", f"{name}_right"
    if left in columns and right in columns:
        return np.stack([columns[left], columns[right]])
    if name in columns:
        return np.stack([whole_share * columns[name]] * 2)
    return None
