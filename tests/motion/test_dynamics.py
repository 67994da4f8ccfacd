"""The equations of motion: closed forms, order of convergence, and one physics for all.

Plain Python, numba and CasADi must run the same equations: a difference between them
would let the planner, the verifier and the controller disagree about the same plan.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import casadi
import numpy as np
import pytest

from mrmg.motion import _kernels
from mrmg.motion.dynamics import DERIVATIVES, NU, NX, TURN_SPEEDS, rk4_step
from mrmg.planning.roadmap._fleet_kernels import FLEET

WHEELBASE_M = 1.2
DT_S = 0.1
MODELS = sorted(DERIVATIVES)


def python_step(model: str) -> Callable[..., tuple[float, ...]]:
    return rk4_step(DERIVATIVES[model](math.sin, math.cos, math.tan))


def record(model: str) -> np.void:
    """One robot of the fleet as the kernels know it."""
    robot = np.zeros(1, FLEET)
    robot["model"], robot["wheelbase"] = _kernels.MODEL_ID[model], WHEELBASE_M
    return robot[0]


def integrate(
    model: str, state: tuple[float, ...], control: tuple[float, float], steps: int
) -> np.ndarray:
    """Return the state after one second in equal steps."""
    step = python_step(model)
    for _ in range(steps):
        state = step(state, control, WHEELBASE_M, 1.0 / steps)
    return np.array(state)


def random_cases(seed: int, n: int) -> list[tuple[np.ndarray, np.ndarray, float]]:
    """Return states, controls and steps far beyond what robots do."""
    rng = np.random.default_rng(seed)
    spread = np.array([200.0, 200.0, 20.0, 5.0, 1.4])
    return [
        (
            rng.uniform(-spread, spread),
            rng.uniform(-4.0, 4.0, NU),
            float(rng.uniform(0.01, 0.3)),
        )
        for _ in range(n)
    ]


@pytest.mark.parametrize("model", MODELS)
def test_numba_and_python_agree_to_the_last_bit(model: str) -> None:
    step = python_step(model)
    out = np.empty(NX)
    for state, control, dt_s in random_cases(1, 5000):
        _kernels.step(record(model), state, *control, dt_s, out)
        plain = step(state.tolist(), control.tolist(), WHEELBASE_M, dt_s)
        assert out.tolist() == list(plain)


@pytest.mark.parametrize("model", MODELS)
def test_casadi_agrees_with_python(model: str) -> None:
    x, u, dt = casadi.SX.sym("x", NX), casadi.SX.sym("u", NU), casadi.SX.sym("dt")
    traced = rk4_step(DERIVATIVES[model](casadi.sin, casadi.cos, casadi.tan))
    expression = traced(casadi.vertsplit(x), casadi.vertsplit(u), WHEELBASE_M, dt)
    function = casadi.Function("step", [x, u, dt], [casadi.vertcat(*expression)])
    step = python_step(model)
    for state, control, dt_s in random_cases(2, 2000):
        plain = step(state.tolist(), control.tolist(), WHEELBASE_M, dt_s)
        symbolic = np.asarray(function(state, control, dt_s)).ravel()
        assert symbolic == pytest.approx(np.array(plain), rel=1e-12, abs=1e-12)


def test_every_model_is_known_to_the_planner() -> None:
    assert sorted(_kernels.MODEL_ID) == MODELS
    assert len(set(_kernels.MODEL_ID.values())) == len(MODELS)


@pytest.mark.parametrize("model", MODELS)
def test_step_may_write_over_its_own_state(model: str) -> None:
    state, control, dt_s = random_cases(3, 1)[0]
    out = np.empty(NX)
    _kernels.step(record(model), state, *control, dt_s, out)
    _kernels.step(record(model), state, *control, dt_s, state)
    assert state.tolist() == out.tolist()


@pytest.mark.parametrize("model", MODELS)
def test_halving_the_step_divides_the_error_by_sixteen(model: str) -> None:
    state, control = (3.0, -2.0, 0.4, 1.5, 0.3), (0.7, -0.5)
    exact = integrate(model, state, control, 4096)
    errors = [
        np.abs(integrate(model, state, control, n) - exact).max() for n in (4, 8, 16)
    ]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders == pytest.approx(4.0, abs=0.35)


@pytest.mark.parametrize("model", MODELS)
def test_straight_on_with_constant_acceleration(model: str) -> None:
    """x = v t + a t^2 / 2 along the heading, exactly."""
    theta, v, a = 0.7, 0.5, 1.2
    end = integrate(model, (1.0, 2.0, theta, v, 0.0), (a, 0.0), 10)
    way = v + 0.5 * a
    expected = (
        1.0 + way * math.cos(theta),
        2.0 + way * math.sin(theta),
        theta,
        v + a,
        0.0,
    )
    assert end == pytest.approx(expected, abs=1e-14)


@pytest.mark.parametrize(
    ("model", "w", "radius_m"),
    [
        ("car", 0.4, WHEELBASE_M / math.tan(0.4)),  # R = L / tan psi
        ("unicycle", 0.5, 1.6 / 0.5),  # R = v / omega
        ("car", -0.4, WHEELBASE_M / math.tan(-0.4)),  # to the right
    ],
)
def test_a_held_turn_is_a_circle(model: str, w: float, radius_m: float) -> None:
    v = 1.6
    x, y, theta, *_ = integrate(model, (0.0, 0.0, 0.0, v, w), (0.0, 0.0), 50)
    turned = v / radius_m
    assert theta == pytest.approx(turned, abs=1e-12)
    assert x == pytest.approx(radius_m * math.sin(turned), abs=1e-9)
    assert y == pytest.approx(radius_m * (1.0 - math.cos(turned)), abs=1e-9)


def test_a_unicycle_turns_in_place_and_a_car_does_not() -> None:
    at_rest = (0.0, 0.0, 0.3, 0.0, 0.5)
    assert integrate("unicycle", at_rest, (0.0, 0.0), 10)[2] == pytest.approx(0.8)
    assert integrate("car", at_rest, (0.0, 0.0), 10)[2] == 0.3


@pytest.mark.parametrize("model", MODELS)
def test_motion_is_the_same_wherever_and_whichever_way_it_starts(model: str) -> None:
    """Moving and turning the start moves and turns the end."""
    for state, control, dt_s in random_cases(4, 200):
        step = python_step(model)
        theta = state[2]
        c, s = math.cos(theta), math.sin(theta)
        at_origin = step((0.0, 0.0, 0.0, *state[3:]), control, WHEELBASE_M, dt_s)
        dx, dy, turned, v, w = at_origin
        expected = (
            state[0] + c * dx - s * dy,
            state[1] + s * dx + c * dy,
            theta + turned,
            v,
            w,
        )
        end = step(state, control, WHEELBASE_M, dt_s)
        assert end == pytest.approx(expected, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("model", MODELS)
def test_driving_back_with_mirrored_time_returns_to_the_start(model: str) -> None:
    for state, control, _ in random_cases(5, 200):
        step = python_step(model)
        there = step(state, control, WHEELBASE_M, 0.01)
        back = step(there, control, WHEELBASE_M, -0.01)
        assert back == pytest.approx(state.tolist(), abs=1e-5)


@pytest.mark.parametrize("model", MODELS)
def test_turn_speed_is_the_yaw_rate_times_a_length(model: str) -> None:
    """Of the wheelbase for a car, of the track for a differential drive."""
    track_m = 0.7
    length_m = WHEELBASE_M if model == "car" else track_m
    plain = TURN_SPEEDS[model](math.tan)
    for (_, _, theta, v, w), control, _ in random_cases(6, 200):
        derivative = DERIVATIVES[model](math.sin, math.cos, math.tan)
        yaw_rate = derivative(theta, v, w, *control, WHEELBASE_M)[2]
        assert plain(v, w, track_m) == pytest.approx(length_m * abs(yaw_rate))
        compiled = _kernels.turn_speed(_kernels.MODEL_ID[model], v, w, track_m)
        assert compiled == plain(v, w, track_m)
