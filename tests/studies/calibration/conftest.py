"""Legs as if driven, whose power follows known parameters."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import pytest

from mrmg.studies.calibration.manoeuvres import Manoeuvre
from mrmg.studies.calibration.measurement import Leg

KINDS = ("straight", "cycle", "circle", "spin")


def legs_of(coefficients: Sequence[float], noise_W: float = 0.0) -> list[Leg]:
    """Forty legs with power by the coefficients, but for noise."""
    rng = np.random.default_rng(0)
    scale = [2e3, 1e3, 1.0, 0.3]
    legs = []
    for index in range(40):
        features = rng.uniform(-1.0, 1.0, 4) * scale
        power = features @ coefficients + noise_W * rng.normal()
        legs.append(
            Leg(
                manoeuvre=Manoeuvre(f"m{index}", KINDS[index // 10], 1.0, ()),
                piece="cruise",
                duration_s=2.0,
                power_W=float(power),
                features=features,
            )
        )
    return legs


@pytest.fixture(scope="session")
def synthetic() -> Callable[..., list[Leg]]:
    """The maker of legs."""
    return legs_of
