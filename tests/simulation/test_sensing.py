"""What the control sees: noise is filtered, delays are bridged, turns are unbroken."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from mrmg.scene.types import Scene
from mrmg.simulation.disturbance import Disturbance, RobotDisturbance
from mrmg.simulation.sensing import FilteredSensing, Sensing, sensing_of

PERIOD_S = 0.02
WHEELBASE_M = 1.2


def disturbed(seed: int = 0, **changes: float) -> Disturbance:
    return Disturbance(seed=seed, robots=(RobotDisturbance(robot="r1", **changes),))


def circle(seconds: float, psi: float = 0.3, v: float = 1.5) -> np.ndarray:
    """True states of a car that starts at once on a circle, shape (n, 1, 5)."""
    time_s = np.arange(round(seconds / PERIOD_S)) * PERIOD_S
    rate = v * np.tan(psi) / WHEELBASE_M
    radius = v / rate
    theta = rate * time_s
    state = np.stack(
        [
            radius * np.sin(theta),
            radius * (1.0 - np.cos(theta)),
            theta,
            np.full_like(theta, v),
            np.full_like(theta, psi),
        ],
        axis=1,
    )
    return state[:, None, :]


def seen(sensing: Sensing, truth: np.ndarray) -> np.ndarray:
    """What is seen of true states, shape (n, 1, 5)."""
    states = []
    for state in truth:
        sensing.look(state, state[:, 3], state[:, 3])
        states.append(sensing.state.copy())
    return np.array(states)


@pytest.fixture(scope="module")
def scene(driving: SimpleNamespace) -> Scene:
    scene: Scene = driving.open_ground([(0.0, 0.0, 0.0)])
    return scene


def filtered(scene: Scene, disturbance: Disturbance) -> FilteredSensing:
    return FilteredSensing(scene, disturbance, PERIOD_S)


def test_without_noise_and_delay_the_truth_is_seen(scene: Scene) -> None:
    sensing = sensing_of(scene, disturbed(mass=0.1, lag_s=0.05), PERIOD_S)
    assert isinstance(sensing, Sensing)
    truth = circle(1.0)
    assert seen(sensing, truth).tobytes() == truth.tobytes()


@pytest.mark.parametrize("name", ["position_noise_m", "speed_noise_m_s", "delay_s"])
def test_anything_less_is_filtered(scene: Scene, name: str) -> None:
    sensing = sensing_of(scene, disturbed(**{name: 0.02}), PERIOD_S)
    assert isinstance(sensing, FilteredSensing)


def test_position_noise_is_cut_to_a_fifth(scene: Scene) -> None:
    truth = circle(60.0)
    found = seen(filtered(scene, disturbed(position_noise_m=0.02)), truth)
    error = (found - truth)[50:, 0, :2]
    assert error.std() < 0.02 / 5.0
    assert np.abs(error.mean(axis=0)).max() < 0.001


def test_heading_noise_is_cut_to_a_fifth(scene: Scene) -> None:
    truth = circle(60.0)
    found = seen(filtered(scene, disturbed(heading_noise_rad=0.02)), truth)
    assert (found - truth)[50:, 0, 2].std() < 0.02 / 5.0


def test_speed_noise_is_halved_at_least(scene: Scene) -> None:
    truth = circle(30.0)
    found = seen(filtered(scene, disturbed(speed_noise_m_s=0.1)), truth)
    assert (found - truth)[50:, 0, 3].std() < 0.05


@pytest.mark.parametrize("delay_s", [0.02, 0.1, 0.5])
def test_odometry_bridges_the_delay(scene: Scene, delay_s: float) -> None:
    """Late measurements of an exact odometry leave no error behind."""
    truth = circle(20.0)
    found = seen(filtered(scene, disturbed(delay_s=delay_s)), truth)
    assert np.abs(found - truth)[..., :3].max() < 1e-4


def test_a_wrong_start_is_found_in_spite_of_the_delay(scene: Scene) -> None:
    """The estimate starts where the scene says; the robot stands elsewhere."""
    truth = circle(20.0)
    truth[..., 0] += 0.3
    sensing = filtered(scene, disturbed(position_noise_m=0.01, delay_s=0.2))
    error = np.abs(seen(sensing, truth) - truth)[:, 0, 0]
    assert error[0] == pytest.approx(0.3, abs=0.03)
    assert error[-100:].max() < 0.02
    # Corrections that were made while a measurement was on its way count once.
    assert error.max() < 0.33


def test_turning_round_and_round_leaves_the_heading_unbroken(scene: Scene) -> None:
    truth = circle(40.0)
    assert truth[-1, 0, 2] > 4.0 * np.pi
    found = seen(filtered(scene, disturbed(heading_noise_rad=0.01)), truth)
    assert np.abs(found - truth)[:, 0, 2].max() < 0.02


def test_a_measurement_of_an_equal_heading_changes_nothing(scene: Scene) -> None:
    """A compass that is a full turn off the odometry says the same."""
    truth = circle(5.0)
    turned = truth.copy()
    turned[..., 2] += 2.0 * np.pi
    alike = [
        seen(filtered(scene, disturbed(heading_noise_rad=0.01)), states)
        for states in (truth, turned)
    ]
    np.testing.assert_allclose(alike[0], alike[1], atol=1e-9)


def test_noise_is_that_of_the_seed(scene: Scene) -> None:
    truth = circle(2.0)
    one, same, other = (
        seen(filtered(scene, disturbed(seed, position_noise_m=0.02)), truth)
        for seed in (1, 1, 2)
    )
    assert one.tobytes() == same.tobytes()
    assert not np.array_equal(one, other)


def test_noise_is_white_before_the_filter(
    scene: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With a filter that trusts measurements alone, the noise comes through as is."""
    monkeypatch.setattr("mrmg.simulation.sensing.POSITION_DRIFT_M", 1e3)
    sensing = filtered(scene, disturbed(position_noise_m=0.05))
    truth = circle(60.0)
    noise = (seen(sensing, truth) - truth)[:, 0, 0]
    assert noise.std() == pytest.approx(0.05, rel=0.05)
    assert abs(np.corrcoef(noise[:-1], noise[1:])[0, 1]) < 0.06
