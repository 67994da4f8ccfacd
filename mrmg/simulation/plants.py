"""Plants: what the ground takes from the tyres of a fleet."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mrmg.mujoco_import import mujoco
from mrmg.simulation.disturbance import Disturbance
from mrmg.simulation.fleet import Fleet
from mrmg.simulation.ground import Ground, GroundResistance, true_resistance
from mrmg.simulation.scrub import ScrubbingTyres
from mrmg.simulation.world_model import MujocoWorld

DEFAULT_PLANT = "default"
PLANTS = (DEFAULT_PLANT, "scrub")
"""The energy model's own law, and a ground contact that it does not know."""


@dataclass(frozen=True, slots=True)
class ModelledGround:
    """Losses by the energy model's law: the driven axles lose all."""

    law: GroundResistance
    fleet: Fleet

    def resist(self, ground: Ground, level: np.ndarray) -> None:
        """Set the frictions of the driven axles for the coming tick.

        Args:
            ground: what lies under the robots.
            level: cosine of the slope along each heading, shape (R,): the slope carries
                a part of the weight.
        """
        along_N = level * self.law.force_N(ground)
        swing_N = ground.turning_multiplier * self.law.swing_N
        self.fleet.set_resistance(along_N, swing_N)


Plant = ModelledGround | ScrubbingTyres
"""The ground contact of a running simulation."""


def plant_of(
    name: str,
    world: MujocoWorld,
    data: mujoco.MjData,
    fleet: Fleet,
    disturbance: Disturbance,
) -> Plant:
    """Return the plant of that name, its robots on plain ground before the first tick.

    The coefficients are those of the MJCF, and what disturbs them. `simulate` has
    allowed the name.
    """
    change = np.array([item.rolling for item in disturbance.robots])
    law = true_resistance(world, change)
    if name == DEFAULT_PLANT:
        fleet.set_resistance(law.rolling_N, law.swing_N)
        return ModelledGround(law, fleet)
    # Every wheel loses for itself, from the first tick on.
    fleet.set_resistance(0.0 * law.rolling_N, 0.0 * law.swing_N)
    return ScrubbingTyres(world, data, law.rolling_N)
