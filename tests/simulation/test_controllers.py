"""The contract of every controller, and the optimality of the predictive one."""

from __future__ import annotations

from types import SimpleNamespace

import casadi as ca
import numpy as np
import pytest

from mrmg.errors import UsageError
from mrmg.motion.dynamics import DERIVATIVES, NU, NX, rk4_step
from mrmg.scene.robot_model import RobotModel
from mrmg.shipped import model_names
from mrmg.simulation.controller import (
    HORIZON,
    HORIZON_STEP_S,
    Controller,
    controller_maker,
    controller_names,
)
from mrmg.simulation.mpc import (
    CONTROL_WEIGHTS,
    STATE_WEIGHTS,
    TERMINAL_FACTOR,
    TrackingMpc,
)
from mrmg.testing import ControllerContract
from mrmg.testing.controller_contract import TICKS_A_STEP, reference_of, straight


@pytest.fixture(scope="module", params=model_names())
def model(request: pytest.FixtureRequest, driving: SimpleNamespace) -> RobotModel:
    scene = driving.open_ground([(0.0, 0.0, 0.4)], models=[request.param])
    return scene.robots[0].model


class OfThisPackage(ControllerContract):
    models = tuple(model_names())
    name = ""

    def controller(self, model: RobotModel) -> Controller:
        return controller_maker(self.name)(model)


class TestMpc(OfThisPackage):
    name = "mpc"


class TestPurePursuit(OfThisPackage):
    name = "pure_pursuit"
    # Not the Husky: turning at 0.36 rad/s at most, it does not get back from an offset.
    models = ("car", "diffdrive", "hauler")


class TestTvlqr(OfThisPackage):
    name = "tvlqr"


def test_names_are_listed_and_unknown_ones_refused() -> None:
    assert controller_names() == ["mpc", "pure_pursuit", "tvlqr"]
    with pytest.raises(UsageError, match="'pid' is not known; allowed: mpc, "):
        controller_maker("pid")


def converged(
    model: RobotModel, state: np.ndarray, reference: np.ndarray
) -> np.ndarray:
    """The first control of the nonlinear problem, by an interior point method."""
    limits = model.limits
    step = rk4_step(DERIVATIVES[model.motion_model](ca.sin, ca.cos, ca.tan))
    problem = ca.Opti()
    x, u = problem.variable(NX, HORIZON + 1), problem.variable(NU, HORIZON)
    planned = np.diff(reference[:, 3:], axis=0) / HORIZON_STEP_S
    cost = 0
    for k in range(HORIZON + 1):
        factor = TERMINAL_FACTOR if k == HORIZON else 1.0
        off = x[:, k] - reference[k]
        cost += factor * ca.dot(ca.DM(STATE_WEIGHTS), off**2)
        problem.set_initial(x[:, k], reference[k])
    for k in range(HORIZON):
        cost += ca.dot(ca.DM(CONTROL_WEIGHTS), (u[:, k] - planned[k]) ** 2)
        reached = step(
            ca.vertsplit(x[:, k]),
            ca.vertsplit(u[:, k]),
            model.wheelbase_m,
            HORIZON_STEP_S,
        )
        problem.subject_to(x[:, k + 1] == ca.vertcat(*reached))
    problem.subject_to(x[:, 0] == state)
    problem.subject_to(problem.bounded(limits.v_min_m_s, x[3, 1:], limits.v_max_m_s))
    problem.subject_to(problem.bounded(-limits.w_max, x[4, 1:], limits.w_max))
    problem.subject_to(
        problem.bounded(-limits.u1_max_m_s2, u[0, :], limits.u1_max_m_s2)
    )
    problem.subject_to(problem.bounded(-limits.u2_max, u[1, :], limits.u2_max))
    problem.minimize(cost)
    problem.solver("ipopt", {"print_time": False}, {"print_level": 0, "sb": "yes"})
    return np.asarray(problem.solve().value(u[:, 0])) - planned[0]


@pytest.mark.parametrize(
    "offset",
    [
        (0.05, 0.02, 0.02, 0.0, 0.0),  # free of all bounds
        (0.3, -0.4, 0.2, -0.2, 0.1),  # bounds of the controls active
        (-1.0, 0.5, -0.3, 0.3, 0.0),  # bound of the speed active
    ],
)
def test_repeated_iterations_solve_the_nonlinear_problem(
    model: RobotModel, offset: tuple[float, ...]
) -> None:
    """Gauss-Newton on a fixed problem converges to what another method finds."""
    _, states = reference_of(model)
    reference = states[300::TICKS_A_STEP][: HORIZON + 1]
    state = reference[0] + offset
    state[3] = np.clip(state[3], model.limits.v_min_m_s, model.limits.v_max_m_s)
    state[4] = np.clip(state[4], -model.limits.w_max, model.limits.w_max)
    controller = TrackingMpc(model)
    for _ in range(30):
        correction = controller.correct(state, reference)
    np.testing.assert_allclose(
        correction, converged(model, state, reference), atol=2e-3
    )


def test_predictive_control_respects_the_limits_of_the_controls(
    model: RobotModel,
) -> None:
    """Far from the way the optimum lies on the bounds, never beyond."""
    rng = np.random.default_rng(3)
    limits = model.limits
    reference = straight(1.0)
    controller = TrackingMpc(model)
    for _ in range(100):
        state = reference[0] + rng.uniform(-1, 1, NX) * [1.0, 1.0, 1.0, 0.9, 0.6]
        u1, u2 = controller.correct(state, reference)
        assert abs(u1) <= limits.u1_max_m_s2 + 1e-4
        assert abs(u2) <= limits.u2_max + 1e-4


def test_after_a_failed_solve_it_works_again(model: RobotModel) -> None:
    """Numbers that overflow leave the plan alone, and no trace for the next call."""
    reference = straight(1.0)
    controller = TrackingMpc(model)
    lost = reference[0] + [1e160, 0.0, 0.0, 0.0, 0.0]
    np.testing.assert_array_equal(controller.correct(lost, reference), 0.0)
    state = reference[0] + [-0.1, 0.0, 0.0, 0.0, 0.0]
    fresh = TrackingMpc(model).correct(state, reference)
    np.testing.assert_array_equal(controller.correct(state, reference), fresh)
