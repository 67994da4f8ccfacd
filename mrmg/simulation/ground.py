"""What the ground takes from the robots: as it is, and as their models think it is.

The MJCF of a robot states what its tyres lose, as the numerics `rolling_coefficient`
and `turning_coefficient`: that is the truth of the simulation. The coefficients of the
same names in `robot.yaml` are what planner and drive control believe; calibration makes
both meet.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import shapely

from mrmg.energy.model import GRAVITY_M_S2
from mrmg.scene.driven_parts import NUMERICS
from mrmg.scene.types import Robot, Scene
from mrmg.simulation.world_model import MujocoWorld


class GroundResistance:
    """The force the ground takes from each robot of a fleet.

    Attributes:
        rolling_N: on plain ground, straight on, shape (R,).
        turning_N: more of it per |tan psi| of a car, shape (R,); 0 for other robots.
        swing_N: against the way that a differential drive's wheels roll differently,
            shape (R,); 0 for other robots.
    """

    def __init__(
        self, robots: Sequence[Robot], rolling_N: np.ndarray, turning_N: np.ndarray
    ) -> None:
        """Have what robots lose by turning lost as their kind does."""
        steers = np.array([robot.model.motion_model == "car" for robot in robots])
        self.rolling_N = rolling_N
        self.turning_N = np.where(steers, turning_N, 0.0)
        self.swing_N = np.where(steers, 0.0, turning_N)

    def force_N(self, ground: Ground) -> np.ndarray:
        """Return the force along the way by the energy model's law, shape (R,)."""
        steer = np.abs(np.tan(ground.steer))
        turning = ground.turning_multiplier * self.turning_N * steer
        return np.asarray(self.rolling_N * ground.multiplier + turning)


class Ground(NamedTuple):
    """What resists the robots of a fleet, each of shape (R,).

    Attributes:
        multiplier: of rolling on the terrain under each robot.
        steer: psi [rad] of the cars.
        turning_multiplier: of turning on that terrain.
    """

    multiplier: np.ndarray
    steer: np.ndarray
    turning_multiplier: np.ndarray


class TerrainUnderfoot:
    """The terrain under a few robots, asked for at every tick."""

    def __init__(self, scene: Scene) -> None:
        """Prepare the terrain of `scene`."""
        self._areas = [
            (area.shape, area.shape.bounds, (area.multiplier, area.turning_multiplier))
            for area in reversed(scene.terrain)
        ]
        for shape, _, _ in self._areas:
            shapely.prepare(shape)

    def under(self, x_m: np.ndarray, y_m: np.ndarray) -> np.ndarray:
        """Return the multipliers of rolling and turning at some places, shape (2, n).

        They are equal to those of `multipliers_at`.
        """
        places = zip(x_m.tolist(), y_m.tolist(), strict=True)
        return np.array([self._at(x, y) for x, y in places]).reshape(-1, 2).T

    def _at(self, x: float, y: float) -> tuple[float, float]:
        for shape, (x_min, y_min, x_max, y_max), multipliers in self._areas:
            near = x_min <= x <= x_max and y_min <= y <= y_max
            if near and shapely.contains_xy(shape, x, y):
                return multipliers
        return 1.0, 1.0


def believed_resistance(scene: Scene) -> GroundResistance:
    """Return the resistance by the energy models of the robots."""
    energy = [robot.model.energy_model for robot in scene.robots]
    rolling_N = np.array([model.rolling_force_N for model in energy])
    turning_N = np.array([model.turning_force_N for model in energy])
    return GroundResistance(scene.robots, rolling_N, turning_N)


def true_resistance(
    world: MujocoWorld, change: np.ndarray | float = 0.0
) -> GroundResistance:
    """Return the resistance by the MJCF of the robots.

    Args:
        world: the robots in it.
        change: share by which rolling resistance differs from that, shape (R,).
    """
    robots, numeric = world.scene.robots, world.model.numeric
    weight_N = world.model.body_subtreemass[world.chassis] * GRAVITY_M_S2
    coefficients = np.array(
        [
            [numeric(f"{robot.id}/{name}").data[0] for name in NUMERICS]
            for robot in robots
        ]
    )
    rolling_N, turning_N = coefficients.T * weight_N
    return GroundResistance(robots, rolling_N * (1.0 + change), turning_N)
