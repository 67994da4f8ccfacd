"""Runs of broken steps, and the replay against the kernels' motion models."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from mrmg.verification.motion_rules import replay, worst_of_runs


@given(st.lists(st.tuples(st.booleans(), st.integers(0, 9))))
def test_worst_of_runs_takes_one_of_each_run(steps: list[tuple[bool, int]]) -> None:
    broken = np.array([item[0] for item in steps], dtype=bool)
    amount = np.array([item[1] for item in steps], dtype=float)
    worst = worst_of_runs(amount, broken)
    padded = np.concatenate([[False], broken])
    assert len(worst) == int((padded[1:] & ~padded[:-1]).sum())
    assert all(broken[worst])
    if broken.any():
        assert max(amount[worst]) == amount[broken].max()


def test_replay_follows_the_differential_equation(make_scene: Any, drive: Any) -> None:
    robot = make_scene().robots[0]
    rng = np.random.default_rng(2)
    trajectory = drive(robot, rng.uniform(-1, 1, (30, 2)).tolist())
    after = replay(robot.model, trajectory)
    for step in range(30):
        u1, u2 = trajectory.control[step]

        def rate(
            _: float, s: np.ndarray, u1: float = u1, u2: float = u2
        ) -> list[float]:
            yaw_rate = s[3] * np.tan(s[4]) / robot.model.wheelbase_m
            return [s[3] * np.cos(s[2]), s[3] * np.sin(s[2]), yaw_rate, u1, u2]

        exact = solve_ivp(rate, (0.0, 0.1), trajectory.state[step], rtol=1e-11)
        assert after[step] == pytest.approx(exact.y[:, -1], abs=1e-7)
