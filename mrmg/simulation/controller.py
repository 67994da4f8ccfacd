"""What a tracking controller is, and which ones there are."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Protocol

import numpy as np

from mrmg.errors import require_known
from mrmg.scene.robot_model import RobotModel

HORIZON = 20
"""Number of steps a controller sees ahead."""

HORIZON_STEP_S = 0.1
"""Length of such a step."""


class Controller(Protocol):
    """Keeps one robot on its reference; one object per robot and run."""

    def correct(self, state: np.ndarray, reference: np.ndarray) -> np.ndarray:
        """Return what to add to the plan's (u1 [m/s^2], u2 [rad/s]), shape (2,).

        Args:
            state: measured x, y, theta and *commanded* v, psi, shape (5,). Measured
                ones would make the loop fight the lag of the drives below it.
            reference: where to be now and at each horizon step, shape (HORIZON + 1, 5).
        """


_MAKERS = {
    "mpc": ("mrmg.simulation.mpc", "TrackingMpc"),
    "pure_pursuit": ("mrmg.simulation.pure_pursuit", "PurePursuit"),
    "tvlqr": ("mrmg.simulation.tvlqr", "Tvlqr"),
}


def controller_names() -> list[str]:
    """Return the names of all controllers."""
    return sorted(_MAKERS)


def controller_maker(name: str) -> Callable[[RobotModel], Controller]:
    """Return the constructor of the controller called `name`.

    Raises:
        UsageError: if there is none of that name.
    """
    require_known("controller", name, controller_names())
    module, attribute = _MAKERS[name]
    maker: Callable[[RobotModel], Controller] = getattr(
        import_module(module), attribute
    )
    return maker
