"""What the batteries of a driving fleet lose, and what that implies for its tyres.

The meter of one robot sums the energy its actuators took, follows its battery over the
recharges of its tour, and estimates by recursive least squares the factor f by which
its rolling resistance differs from its model's: over each second under power,

    measured energy - metered energy of all other parts = f * metered rolling energy.
"""

from __future__ import annotations

import numpy as np

from mrmg.energy.metering import (
    MEASURED_PARTS,
    TimedStates,
    measured_energy_parts,
    step_energy_parts,
)
from mrmg.energy.model import PARTS
from mrmg.scene.types import Robot, Scene
from mrmg.supervision.battery import BatteryTracker

_ROLLING = PARTS.index("rolling")
_CONSUMERS = [PARTS.index("idle"), PARTS.index("device")]
_DRIVE = MEASURED_PARTS.index("drive")
_PRIOR_M = 0.3
_SPAN_S = 1.0


class RollingEstimate:
    """Recursive least squares of y = f x with a prior of f = 1.

    Attributes:
        factor: the estimate of f.
    """

    def __init__(self, prior: float) -> None:
        """Start at 1, as sure of it as one observation of x = `prior` makes."""
        self.factor = 1.0
        self._information = prior**2

    def observe(self, x: float, y: float) -> None:
        """Take in one pair."""
        self._information += x * x
        self.factor += x / self._information * (y - self.factor * x)


class RobotMeter:
    """Everything measured of one robot since the mission began.

    Attributes:
        robot: whose energies are measured.
        used_J: drawn from the battery so far.
        rolling: estimate of the rolling resistance.
        battery: follows its content.
    """

    def __init__(self, scene: Scene, robot: Robot) -> None:
        """Start with the robot's start energy."""
        self.robot = robot
        self.used_J = 0.0
        model = robot.model.energy_model
        self.rolling = RollingEstimate(_PRIOR_M * model.plain_ground_J_per_m())
        self._scene = scene
        self.battery = BatteryTracker(scene, robot)

    def add(self, time_s: np.ndarray, state: np.ndarray, work_J: np.ndarray) -> None:
        """Take in some ticks.

        Args:
            time_s: of the state before the first tick and after each, shape (n + 1,).
            state: at these times, shape (n + 1, 5).
            work_J: of the drives over each tick, driving and braking, shape (n, 2).
        """
        parts_J = measured_energy_parts(self.robot, work_J, time_s)
        draw_J = parts_J.sum(axis=1)
        self.used_J += float(draw_J.sum())
        self.battery.add(time_s, state[:, :3], draw_J)
        self._estimate(time_s, state, parts_J[:, _DRIVE])

    def _estimate(
        self, time_s: np.ndarray, state: np.ndarray, drive_J: np.ndarray
    ) -> None:
        motion = TimedStates(robot=self.robot.id, time_s=time_s, state=state)
        parts_J = step_energy_parts(self._scene, motion)
        driving_J = parts_J.sum(axis=1) - parts_J[:, _CONSUMERS].sum(axis=1)
        others_J = driving_J - parts_J[:, _ROLLING]
        # While a robot coasts or brakes, its battery indicates nothing about its tyres.
        pulls = np.flatnonzero((driving_J > 0.0) & (drive_J > 0.0))
        spans = max(1, round((time_s[-1] - time_s[0]) / _SPAN_S))
        for ticks in np.array_split(pulls, spans):
            self.rolling.observe(
                float(parts_J[ticks, _ROLLING].sum()),
                float(drive_J[ticks].sum() - others_J[ticks].sum()),
            )
