"""The recursion against the same problem as one linear system, and against the QP."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from mrmg import shipped
from mrmg.motion.dynamics import DERIVATIVES, NU, NX, rk4_step
from mrmg.scene.loading.models import load_model
from mrmg.scene.robot_model import RobotModel
from mrmg.simulation.controller import HORIZON, HORIZON_STEP_S
from mrmg.simulation.mpc import WEIGHTS, TrackingMpc
from mrmg.simulation.riccati import unbounded_solver

STAGE = NX + NU
SIZE = HORIZON * STAGE + NX


@pytest.fixture(scope="module", params=shipped.model_names())
def model(request: pytest.FixtureRequest) -> RobotModel:
    return load_model(shipped.models_folder() / request.param)[0]


def question(seed: int, spread: float = 0.1) -> tuple[np.ndarray, np.ndarray]:
    """A guess about a target of driving ahead."""
    rng = np.random.default_rng(seed)
    target = np.zeros(SIZE)
    stages = target[:-NX].reshape(HORIZON, STAGE)
    stages[:, 0], stages[:, 3] = 0.1 * np.arange(HORIZON), 1.0
    target[-NX:] = [2.0, 0.0, 0.0, 1.0, 0.0]
    target += 0.02 * rng.normal(size=SIZE)
    return target + spread * rng.normal(size=SIZE), target


def linear_system_solution(
    model: RobotModel, weight: np.ndarray, guess: np.ndarray, target: np.ndarray
) -> np.ndarray:
    """The optimum by its conditions of first order, all at once."""
    step = rk4_step(DERIVATIVES[model.motion_model](ca.sin, ca.cos, ca.tan))
    z = ca.SX.sym("z", SIZE)
    rows = [z[:NX]]
    for k in range(HORIZON):
        now = ca.vertsplit(z[k * STAGE : (k + 1) * STAGE])
        reached = ca.vertcat(
            *step(now[:NX], now[NX:], model.wheelbase_m, HORIZON_STEP_S)
        )
        rows.append(z[(k + 1) * STAGE : (k + 1) * STAGE + NX] - reached)
    row = ca.vertcat(*rows)
    slope, value = (
        item.full()
        for item in ca.Function("rows", [z], [ca.jacobian(row, z), row])(guess)
    )
    right = slope @ guess - value[:, 0]
    right[:NX] = guess[:NX]
    conditions = np.block(
        [[np.diag(weight), slope.T], [slope, np.zeros((len(right), len(right)))]]
    )
    answer = np.linalg.solve(conditions, np.concatenate([weight * target, right]))
    return answer[:SIZE]


@pytest.mark.parametrize("seed", range(5))
def test_it_is_the_optimum_of_the_linearised_problem(
    model: RobotModel, seed: int
) -> None:
    weight = np.random.default_rng(seed).uniform(0.1, 10.0, SIZE)
    solver = unbounded_solver(model.motion_model, model.wheelbase_m, weight)
    guess, target = question(seed)
    found = solver(guess, target).full()[:, 0]
    expected = linear_system_solution(model, weight, guess, target)
    np.testing.assert_allclose(found, expected, atol=1e-9)
    np.testing.assert_array_equal(found[:NX], guess[:NX])


def test_from_its_target_it_does_not_move(model: RobotModel) -> None:
    """A target that the motion model follows is its own optimum."""
    solver = unbounded_solver(model.motion_model, model.wheelbase_m, np.ones(SIZE))
    target = np.zeros(SIZE)
    stages = target[:-NX].reshape(HORIZON, STAGE)
    stages[:, 0], stages[:, 3] = 0.1 * np.arange(HORIZON), 1.0
    target[-NX:] = [2.0, 0.0, 0.0, 1.0, 0.0]
    np.testing.assert_allclose(solver(target, target).full()[:, 0], target, atol=1e-12)


def straight_reference(speed: float) -> np.ndarray:
    reference = np.zeros((HORIZON + 1, NX))
    reference[:, 0] = HORIZON_STEP_S * speed * np.arange(HORIZON + 1)
    reference[:, 3] = speed
    return reference


@pytest.mark.parametrize(
    ("offset_m", "bounded"), [((-0.05, 0.02), False), ((-1.5, 0.5), True)]
)
def test_the_controller_answers_as_with_bounds_at_once(
    model: RobotModel, offset_m: tuple[float, float], bounded: bool
) -> None:
    """Bit by bit where no limit matters; within the limits where one does."""
    reference = straight_reference(0.5 * model.limits.v_max_m_s)
    state = reference[0].copy()
    state[:2] += offset_m
    limits = model.limits
    free = unbounded_solver(model.motion_model, model.wheelbase_m, WEIGHTS)
    target = np.zeros(SIZE)
    stages = target[:-NX].reshape(HORIZON, STAGE)
    stages[:, :NX], target[-NX:] = reference[:-1], reference[-1]
    guess = target.copy()
    guess[:NX] = state
    answer = free(guess, target).full()[NX:STAGE, 0]
    breaks = abs(answer[0]) > limits.u1_max_m_s2 or abs(answer[1]) > limits.u2_max
    assert breaks == bounded
    given = TrackingMpc(model).correct(state, reference)
    if bounded:
        assert abs(given[0]) <= limits.u1_max_m_s2 + 1e-6
        assert abs(given[1]) <= limits.u2_max + 1e-6
        assert np.abs(given - answer).max() > 1e-3
    else:
        np.testing.assert_array_equal(given, answer)
