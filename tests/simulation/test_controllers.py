"""The contract of every controller, and the optimality of the predictive one."""

from __future__ import annotations

import math
from types import SimpleNamespace

import casadi as ca
import numpy as np
import pytest

from mrmg import shipped
from mrmg.errors import UsageError
from mrmg.motion.dynamics import DERIVATIVES, NU, NX, rk4_step
from mrmg.plans import Plan
from mrmg.scene.robot_model import RobotModel
from mrmg.scene.types import Scene
from mrmg.simulation.controller import (
    HORIZON,
    HORIZON_STEP_S,
    controller_maker,
    controller_names,
)
from mrmg.simulation.mpc import MpcParams, TrackingMpc
from mrmg.simulation.reference import FleetReference

TICK_S = 0.04


@pytest.fixture(scope="module", params=shipped.model_names())
def scene(request: pytest.FixtureRequest, driving: SimpleNamespace) -> Scene:
    return driving.open_ground([(0.0, 0.0, 0.4)], models=[request.param])


@pytest.fixture(scope="module")
def model(scene: Scene) -> RobotModel:
    return scene.robots[0].model


@pytest.fixture(scope="module")
def plan(driving: SimpleNamespace, scene: Scene) -> Plan:
    """Switching controls, both directions, full range of the planner."""
    return driving.plan_of(scene, [driving.bang_bang(scene, "r1", 40.0, 2)])


def moving_reference(speed: float) -> np.ndarray:
    """A straight way along x."""
    reference = np.zeros((HORIZON + 1, NX))
    reference[:, 0] = speed * HORIZON_STEP_S * np.arange(HORIZON + 1)
    reference[:, 3] = speed
    return reference


def share_of_limit(model: RobotModel, share: float) -> float:
    """A share of the top speed; of the reverse one where it is negative."""
    limits = model.limits
    return share * (limits.v_max_m_s if share > 0.0 else -limits.v_min_m_s)


def drive(
    name: str, scene: Scene, plan: Plan, offset: tuple[float, ...]
) -> tuple[np.ndarray, np.ndarray]:
    """Follow a plan with the motion model alone; return errors and corrections."""
    model = scene.robots[0].model
    step = rk4_step(DERIVATIVES[model.motion_model](math.sin, math.cos, math.tan))
    controller = controller_maker(name)(model)
    reference = FleetReference(scene, plan)
    state = tuple(reference.at(np.zeros(1))[0, 0] + offset)
    errors, corrections = [], []
    for tick in range(int(plan.makespan_s / TICK_S)):
        now = tick * TICK_S
        ahead = reference.paced(now, 1.0, HORIZON_STEP_S, HORIZON + 1)[:, 0]
        correction = controller.correct(np.array(state), ahead)
        following = reference.at(np.array([now, now + TICK_S]))[:, 0, 3:]
        control = np.diff(following, axis=0)[0] / TICK_S + correction
        bound = (model.limits.u1_max_m_s2, model.limits.u2_max)
        control = np.clip(control, np.negative(bound), bound)
        errors.append(math.dist(state[:2], ahead[0, :2]))
        corrections.append(correction)
        state = step(*state, *control, model.wheelbase_m, TICK_S)
    return np.array(errors), np.array(corrections)


def test_names_are_listed_and_unknown_ones_refused() -> None:
    assert controller_names() == ["mpc", "pure_pursuit", "tvlqr"]
    with pytest.raises(UsageError, match="'pid' is not known; allowed: mpc, "):
        controller_maker("pid")


@pytest.mark.parametrize("name", controller_names())
@pytest.mark.parametrize("share", [0.75, 0.0, -0.75])
def test_on_a_straight_reference_nothing_is_corrected(
    name: str, model: RobotModel, share: float
) -> None:
    reference = moving_reference(share_of_limit(model, share))
    correction = controller_maker(name)(model).correct(reference[0], reference)
    np.testing.assert_allclose(correction, 0.0, atol=1e-4)


@pytest.mark.parametrize("name", controller_names())
@pytest.mark.parametrize("share", [0.75, -0.75])
def test_steers_back_to_the_way(name: str, model: RobotModel, share: float) -> None:
    """Left of the way: turn a car's wheels to the right, forwards and backwards.

    A differential drive turns itself to the right, and backwards to the left.
    """
    speed = share_of_limit(model, share)
    reference = moving_reference(speed)
    state = reference[0] + [0.0, 0.2, 0.0, 0.0, 0.0]
    correction = controller_maker(name)(model).correct(state, reference)
    turns = model.motion_model == "unicycle"
    assert correction[1] * (np.sign(speed) if turns else 1.0) < 0.0


@pytest.mark.parametrize("name", controller_names())
@pytest.mark.parametrize("share", [0.75, -0.75])
def test_speeds_up_when_behind(name: str, model: RobotModel, share: float) -> None:
    speed = share_of_limit(model, share)
    reference = moving_reference(speed)
    state = reference[0] - [0.2 * np.sign(speed), 0.0, 0.0, 0.0, 0.0]
    correction = controller_maker(name)(model).correct(state, reference)
    assert correction[0] * speed > 0.0


@pytest.mark.parametrize("name", controller_names())
def test_stays_on_a_switching_plan(name: str, scene: Scene, plan: Plan) -> None:
    errors, _ = drive(name, scene, plan, (0.0,) * NX)
    assert errors.max() < 0.05


@pytest.mark.parametrize("name", controller_names())
def test_recovers_from_an_offset(name: str, scene: Scene, plan: Plan) -> None:
    errors, _ = drive(name, scene, plan, (0.1, -0.2, 0.1, 0.0, 0.0))
    assert errors[0] > 0.2
    assert errors[-100:].max() < 0.05


@pytest.mark.parametrize("name", controller_names())
def test_equal_inputs_give_equal_corrections(
    name: str, scene: Scene, plan: Plan
) -> None:
    _, first = drive(name, scene, plan, (0.1, 0.1, 0.0, 0.0, 0.0))
    _, second = drive(name, scene, plan, (0.1, 0.1, 0.0, 0.0, 0.0))
    np.testing.assert_array_equal(first, second)


def converged(
    model: RobotModel, state: np.ndarray, reference: np.ndarray
) -> np.ndarray:
    """The first control of the nonlinear problem, by an interior point method."""
    params, limits = MpcParams(), model.limits
    step = rk4_step(DERIVATIVES[model.motion_model](ca.sin, ca.cos, ca.tan))
    problem = ca.Opti()
    x, u = problem.variable(NX, HORIZON + 1), problem.variable(NU, HORIZON)
    planned = np.diff(reference[:, 3:], axis=0) / HORIZON_STEP_S
    cost = 0
    for k in range(HORIZON + 1):
        factor = params.terminal_factor if k == HORIZON else 1.0
        off = x[:, k] - reference[k]
        cost += factor * ca.dot(ca.DM(params.state), off**2)
        problem.set_initial(x[:, k], reference[k])
    for k in range(HORIZON):
        cost += ca.dot(ca.DM(params.control), (u[:, k] - planned[k]) ** 2)
        reached = step(
            *ca.vertsplit(x[:, k]),
            *ca.vertsplit(u[:, k]),
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
    model: RobotModel, scene: Scene, plan: Plan, offset: tuple[float, ...]
) -> None:
    """Gauss-Newton on a fixed problem converges to what another method finds."""
    reference = FleetReference(scene, plan).paced(6.0, 1.0, HORIZON_STEP_S, 21)[:, 0]
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
    reference = moving_reference(1.0)
    controller = TrackingMpc(model)
    for _ in range(100):
        state = reference[0] + rng.uniform(-1, 1, NX) * [1.0, 1.0, 1.0, 0.9, 0.6]
        u1, u2 = controller.correct(state, reference)
        assert abs(u1) <= limits.u1_max_m_s2 + 1e-4
        assert abs(u2) <= limits.u2_max + 1e-4


def test_after_a_failed_solve_it_works_again(model: RobotModel) -> None:
    """Numbers that overflow leave the plan alone, and no trace for the next call."""
    reference = moving_reference(1.0)
    controller = TrackingMpc(model)
    lost = reference[0] + [1e160, 0.0, 0.0, 0.0, 0.0]
    np.testing.assert_array_equal(controller.correct(lost, reference), 0.0)
    state = reference[0] + [-0.1, 0.0, 0.0, 0.0, 0.0]
    fresh = TrackingMpc(model).correct(state, reference)
    np.testing.assert_array_equal(controller.correct(state, reference), fresh)
