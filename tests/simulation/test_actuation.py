"""Lag and gain of actuators against their differential equation."""

from __future__ import annotations

import numpy as np
import pytest

from mrmg.simulation.actuation import Actuation
from mrmg.simulation.disturbance import Disturbance, RobotDisturbance

T_S = 0.02


def actuation(steer: float = 0.0, **changes: float) -> Actuation:
    robot = RobotDisturbance(robot="r1", **changes)
    return Actuation(Disturbance(seed=0, robots=(robot,)), np.array([steer]), T_S)


def integrated(
    command: np.ndarray, lag_s: float, start: float, fine: int
) -> np.ndarray:
    """tau y' = u - y by small steps; `command` has one value a small step."""
    y = [start]
    step_s = T_S / fine
    for u in command:
        y.append(y[-1] + step_s / lag_s * (u - y[-1]))
    return np.array(y)


def test_without_disturbance_commands_arrive_exactly() -> None:
    through = actuation(steer=0.3)
    rng = np.random.default_rng(1)
    force, angle = rng.normal(size=50), np.append(0.3, rng.normal(size=50))
    for wanted, start, end in zip(force, angle, angle[1:], strict=False):
        assert through.force_N(np.array([wanted])) == wanted
        before, after = through.steer(np.array([start]), np.array([end]))
        assert (before, after) == (start, end)


@pytest.mark.parametrize("lag_s", [0.005, 0.05, 0.4])
def test_the_force_is_the_mean_of_the_lagging_one(lag_s: float) -> None:
    fine = 4000
    commands = np.array([100.0, 100.0, -40.0, 0.0, 60.0])
    exact = integrated(np.repeat(commands, fine), lag_s, 0.0, fine)
    mean = exact[:-1].reshape(len(commands), fine).mean(axis=1)
    lagging = actuation(lag_s=lag_s)
    got = [lagging.force_N(np.array([wanted]))[0] for wanted in commands]
    np.testing.assert_allclose(got, mean, atol=0.2)


@pytest.mark.parametrize("lag_s", [0.005, 0.05, 0.4])
def test_the_steering_lags_behind_ramps(lag_s: float) -> None:
    fine = 4000
    ends = np.array([0.1, 0.12, 0.14, 0.2, 0.2, 0.2, -0.1])
    share = np.arange(fine) / fine
    ramps = [a + share * (b - a) for a, b in zip(ends, ends[1:], strict=False)]
    exact = integrated(np.concatenate(ramps), lag_s, 0.1, fine)[::fine]
    lagging = actuation(steer=0.1, lag_s=lag_s)
    for start, end, before, after in zip(
        ends, ends[1:], exact, exact[1:], strict=False
    ):
        got = lagging.steer(np.array([start]), np.array([end]))
        np.testing.assert_allclose(np.array(got)[:, 0], (before, after), atol=1e-4)


def test_gains_scale_what_arrives() -> None:
    weak = actuation(steer=0.2, drive_gain=-0.1, steering_gain=0.05)
    assert weak.force_N(np.array([200.0])) == pytest.approx(180.0)
    before, after = weak.steer(np.array([0.2]), np.array([0.4]))
    assert (before, after) == (pytest.approx(0.21), pytest.approx(0.42))


def test_robots_have_their_own_lags() -> None:
    robots = (RobotDisturbance(robot="r1", lag_s=0.1), RobotDisturbance(robot="r2"))
    both = Actuation(Disturbance(seed=0, robots=robots), np.zeros(2), T_S)
    late, prompt = both.force_N(np.array([50.0, 50.0]))
    assert 0.0 < late < 6.0
    assert prompt == 50.0
