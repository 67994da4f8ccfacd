"""Plants: what the ground takes from the tyres of a fleet."""

from __future__ import annotations

import numpy as np

from mrmg.errors import UsageError
from mrmg.mujoco_import import mujoco
from mrmg.simulation.disturbance import Disturbance
from mrmg.simulation.ground import Ground, true_resistance
from mrmg.simulation.scrub import ScrubbingTyres
from mrmg.simulation.world_model import MujocoWorld

DEFAULT_PLANT = "default"
PLANTS = (DEFAULT_PLANT, "scrub")
"""The energy model's own law, and a ground contact that it does not know."""

Resistance = tuple[np.ndarray, np.ndarray]
"""Forces against the way of the axle's middle, and against wheels rolling differently,
each (R,): the first arguments of `Fleet.set_resistance`."""


class ModelledGround:
    """Losses by the energy model's law, with the coefficients of the MJCF."""

    def __init__(self, world: MujocoWorld, disturbance: Disturbance) -> None:
        """Take the coefficients, and what disturbs them."""
        self._true = true_resistance(world, disturbance)

    def resistance(self, ground: Ground, level: np.ndarray) -> Resistance:
        """Return what the driven axles are to lose over the coming tick.

        Args:
            ground: what lies under the robots.
            level: cosine of the slope along each heading, shape (R,): the slope carries
                a part of the weight.
        """
        along_N = level * self._true.force_N(*ground)
        return along_N, ground.turning_multiplier * self._true.swing_N

    def resist(self) -> None:
        """Set all other frictions for the coming tick: the driven axles lose all."""


class ScrubbedGround:
    """Losses by `scrub`, wheel by wheel."""

    def __init__(
        self, world: MujocoWorld, data: mujoco.MjData, disturbance: Disturbance
    ) -> None:
        """Take the coefficients, and what disturbs them."""
        law = true_resistance(world, disturbance)
        self._tyres = ScrubbingTyres(world, data, law.rolling_N)

    def resistance(self, ground: Ground, level: np.ndarray) -> Resistance:
        """Return nothing: every wheel loses for itself."""
        return 0.0 * level, 0.0 * level

    def resist(self) -> None:
        """Set the frictions of all wheels."""
        self._tyres.resist()


Plant = ModelledGround | ScrubbedGround
"""The ground contact of a running simulation."""


def plant_of(
    name: str, world: MujocoWorld, data: mujoco.MjData, disturbance: Disturbance
) -> Plant:
    """Return the plant of that name; `require_plant` has allowed it."""
    if name == DEFAULT_PLANT:
        return ModelledGround(world, disturbance)
    return ScrubbedGround(world, data, disturbance)


def require_plant(name: str) -> None:
    """Refuse a plant that there is none of.

    Raises:
        UsageError: naming those that there are.
    """
    if name not in PLANTS:
        raise UsageError(f"plant '{name}' is not known; allowed: {', '.join(PLANTS)}")
