"""Logs of real robots as CSV files: how fast a robot went, and what power it drew."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mrmg.counted import counted
from mrmg.errors import Fault, FileError, UsageError
from mrmg.scene.loading.shape_schema import ID_PATTERN
from mrmg.scene.robot_model import RobotModel
from mrmg.studies.calibration.log_columns import read_columns

STILL = 0.005
"""Speed [m/s] and yaw rate [rad/s] below which a robot stands."""

LEAST_STEP_S = 1e-6
"""Least step of time: powers of accelerations are worked out over steps."""

GAP_PERIODS = 10.0
"""Steps of time this many times a log's own period are gaps of the log ..."""

GAP_S = 2.0
"""... if they are longer than this, too [s]: than what laws are fitted to."""


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
    def period_s(self) -> float:
        """Usual time from row to row."""
        return float(np.median(np.diff(self.time_s)))

    @property
    def gaps(self) -> np.ndarray:
        """Which steps of time are gaps of the log, shape (n - 1,)."""
        longest_s = max(GAP_S, GAP_PERIODS * self.period_s)
        return np.asarray(np.diff(self.time_s) > longest_s)

    @property
    def notes(self) -> tuple[str, ...]:
        """What of the log is left out."""
        if not self.gaps.any():
            return ()
        gap_s = float(np.diff(self.time_s)[self.gaps].sum())
        count = counted(int(self.gaps.sum()), "gap")
        return (
            f"{self.file}: {count} of {gap_s:.0f} s in all left out, as the log has a "
            f"row every {self.period_s:.3g} s otherwise",
        )

    @property
    def weight_s(self) -> np.ndarray:
        """Time that each row stands for (trapezoidal rule), shape (n,).

        What happened in gaps is not known: they count as one period.
        """
        steps_s = np.where(self.gaps, self.period_s, np.diff(self.time_s))
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
        UsageError: if the terrain cannot be an id of a scene.
    """
    if not re.match(ID_PATTERN, terrain):
        raise UsageError(
            f"'{terrain}' cannot name a terrain; use letters, digits, '_', '.' and "
            "'-', as ids in scenes do"
        )
    columns, lines = read_columns(Path(file), file)
    time_s = columns["time"]
    late = np.flatnonzero(np.diff(time_s) < LEAST_STEP_S)
    if len(late):
        line = lines[int(late[0]) + 1]
        message = f"must increase, by {LEAST_STEP_S:g} s at least"
        raise FileError(file, [Fault("time", message, line=line)])
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
