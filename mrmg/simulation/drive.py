"""The drive control below the tracking controller: a speed loop along the way.

The resistance that is fed forward is the energy model's; what is left for acceleration
is limited to what the tyres of the driven axle can transmit.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from mrmg.energy.model import GRAVITY_M_S2
from mrmg.scene.robot_model import DRIVEN_LOAD_SHARE, GRIP_SHARE, RobotModel
from mrmg.scene.types import Scene
from mrmg.simulation.speed_loop import SpeedLoop, SpeedLoopParams


@dataclass(frozen=True, slots=True)
class DriveParams:
    """Parameters of the drive control.

    Attributes:
        loop: gains of the speed loop.
        grip_share: share of the driven axle's static grip that is used.
    """

    loop: SpeedLoopParams = field(default_factory=SpeedLoopParams)
    grip_share: float = GRIP_SHARE


class DriveControl:
    """Speed control of all robots."""

    def __init__(self, scene: Scene, params: DriveParams | None = None) -> None:
        """Control the robots of `scene`, all at rest."""
        params = params or DriveParams()
        models = [robot.model for robot in scene.robots]
        self._weight_N = np.array([item.mass_kg for item in models]) * GRAVITY_M_S2
        self._loop = SpeedLoop(
            inertia=np.array([item.effective_mass_kg for item in models]),
            limit=params.grip_share * np.array([axle_grip_N(item) for item in models]),
            params=params.loop,
        )

    def force_N(
        self,
        speed_m_s: np.ndarray,
        wanted_m_s: np.ndarray,
        next_m_s: np.ndarray,
        resistance_N: np.ndarray,
        period_s: float,
        slope: np.ndarray | None = None,
    ) -> np.ndarray:
        """Return the force to hold for `period_s`, shape (R,).

        On a slope the weight is carried at all times, also by a robot that stands.

        Args:
            speed_m_s: speed of the axle now.
            wanted_m_s: speed asked for now.
            next_m_s: speed asked for at the end of the period.
            resistance_N: force the ground is believed to take.
            period_s: how long the force will be held.
            slope: sine of the slope along each heading; None on level ground.
        """
        asked = (speed_m_s, wanted_m_s, next_m_s, resistance_N)
        if slope is None:
            return self._loop.force(*asked, period_s)
        force_N = self._loop.force(*asked, period_s, brakes=slope != 0.0)
        return np.asarray(force_N + self._weight_N * slope)


def axle_grip_N(model: RobotModel) -> float:
    """Return the static grip of the driven axle under its least load."""
    share = DRIVEN_LOAD_SHARE * model.friction_coefficient
    return share * model.mass_kg * GRAVITY_M_S2
