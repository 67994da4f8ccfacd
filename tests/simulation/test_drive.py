"""The speed loop: feed-forward, feedback, and the limit of the tyres."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from mrmg.scene.robot_model import GRIP_SHARE
from mrmg.scene.types import Scene
from mrmg.simulation.drive import (
    INTEGRAL_LIMIT_M_S2,
    PROPORTIONAL_PER_S,
    drive_control,
)

TICK_S = 0.02


@pytest.fixture(scope="module")
def scene(driving: SimpleNamespace) -> Scene:
    return driving.open_ground([(0.0, 0.0, 0.0)])


def force(scene: Scene, speed: float, now: float, following: float, ground: float = 0):
    control = drive_control(scene)
    values = (np.array([value]) for value in (speed, now, following, ground))
    return control.force(*values, np.zeros(1), TICK_S)[0]


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_on_its_ramp_only_the_physics_is_fed_forward(
    scene: Scene, direction: float
) -> None:
    mass = scene.robots[0].model.effective_mass_kg
    held = force(scene, direction, direction, direction * 1.02, ground=90.0)
    assert held == pytest.approx(direction * (90.0 + mass * 1.0))


def test_a_resting_robot_is_not_pushed(scene: Scene) -> None:
    assert force(scene, 0.0, 0.0, 0.0, ground=400.0) == 0.0


def test_acceleration_is_limited_to_the_grip_resistance_is_not(scene: Scene) -> None:
    model = scene.robots[0].model
    grip = 0.5 * model.friction_coefficient * model.mass_kg * 9.81
    hardest = force(scene, 0.0, 1.0, 2.0, ground=500.0)
    assert hardest == pytest.approx(500.0 + GRIP_SHARE * grip)
    assert force(scene, 2.0, 1.0, 0.0) == pytest.approx(-GRIP_SHARE * grip)


def test_integral_removes_a_steady_error_and_is_bounded(scene: Scene) -> None:
    """Against a force unknown to the model the loop settles on the asked speed."""
    mass, unknown = scene.robots[0].model.effective_mass_kg, 60.0
    control = drive_control(scene)
    asked, speed, still = np.ones(1), np.ones(1), np.zeros(1)
    for _ in range(400):
        held = control.force(speed, asked, asked, still, still, TICK_S)
        speed = speed + TICK_S * (held - unknown) / mass
    assert speed[0] == pytest.approx(1.0, abs=1e-3)
    for _ in range(2000):
        held = control.force(
            np.zeros(1), asked, asked, np.zeros(1), np.zeros(1), TICK_S
        )
    bound = PROPORTIONAL_PER_S + INTEGRAL_LIMIT_M_S2
    assert held[0] == pytest.approx(min(mass * bound, GRIP_SHARE * 0.5 * 180 * 9.81))
