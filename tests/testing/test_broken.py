"""The contract suites find broken planners, routers, controllers and motion models."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mrmg.planning import (
    Attempt,
    Planner,
    Problem,
    Request,
    Router,
    Routing,
    RoutingProblem,
)
from mrmg.planning.path_following.strategy import path_following
from mrmg.planning.problem.problem import state_mission
from mrmg.planning.routers import find_router
from mrmg.planning.routing.routing import RouterParams
from mrmg.scene.robot_model import RobotModel
from mrmg.simulation.controller import Controller, controller_maker
from mrmg.testing import (
    ControllerContract,
    MotionContract,
    PlannerContract,
    RouterContract,
)

SEARCH = find_router(RouterParams(rounds=20))
HASTY = find_router(RouterParams(method="nrpa", iterations=2))

# --- routers -------------------------------------------------------------------------


def forgetful(problem: RoutingProblem, seed: int) -> Routing:
    """Leave out the last target of the longest tour."""
    routing = SEARCH(problem, seed)
    last = max(range(problem.robots), key=lambda r: len(routing.tours[r]))
    tours = [tour[:-1] if r == last else tour for r, tour in enumerate(routing.tours)]
    return Routing(tuple(tours), routing.cost_J)


def overspending(problem: RoutingProblem, seed: int) -> Routing:
    """Believe that batteries hold ten times as much as they do."""
    more = {n: 10.0 * getattr(problem, n) for n in ("start_energy_J", "capacity_J")}
    return SEARCH(replace(problem, **more), seed)


def late(problem: RoutingProblem, seed: int) -> Routing:
    """Know nothing of time limits."""
    endless = np.full(problem.robots, np.inf)
    return SEARCH(replace(problem, time_limit_s=endless), seed)


def understating(problem: RoutingProblem, seed: int) -> Routing:
    """Return half the cost of its tours."""
    routing = SEARCH(problem, seed)
    return Routing(routing.tours, 0.5 * routing.cost_J)


def unrepeatable(problem: RoutingProblem, seed: int) -> Routing:
    """Draw the seed anew."""
    return HASTY(problem, int(np.random.default_rng().integers(1 << 30)))


def marking(problem: RoutingProblem, seed: int) -> Routing:
    """Mark goals as done in the problem that it was given."""
    routing = SEARCH(problem, seed)
    problem.open_goals[0] = False
    return routing


def lazy(problem: RoutingProblem, seed: int) -> Routing:
    """Find nothing."""
    return Routing(tuple(() for _ in range(problem.robots)), np.inf)


def greedy(problem: RoutingProblem, seed: int) -> Routing:
    """Visit goals again that are done."""
    return SEARCH(replace(problem, open_goals=np.ones(problem.goals, bool)), seed)


@pytest.mark.parametrize(
    ("router", "test"),
    [
        (forgetful, "tours_keep_every_rule"),
        (overspending, "tours_keep_every_rule"),
        (late, "tours_keep_every_rule"),
        (understating, "tours_keep_every_rule"),
        (unrepeatable, "the_same_seed_gives_the_same_tours"),
        (marking, "the_problem_is_not_changed"),
        (lazy, "tours_are_found"),
        (greedy, "goals_that_are_done_are_left_out"),
        (greedy, "no_goals_cost_nothing"),
    ],
)
def test_broken_routers_are_found(router: Router, test: str) -> None:
    class Suite(RouterContract):
        def router(self) -> Router:
            return router

    fails(Suite(), test)


# --- planners ------------------------------------------------------------------------


def blind(problem: Problem, request: Request) -> Attempt:
    """Drive as if there were no obstacles."""
    bare = replace(problem.scene, obstacles=())
    open_ground = state_mission(bare, request.seed, request.params)
    found = path_following(open_ground, request)
    plans = [
        request.plan(problem, plan.trajectories, plan.tours) for plan in found.plans
    ]
    return Attempt([plan for plan in plans if plan])


def jumping(problem: Problem, request: Request) -> Attempt:
    """Begin half a metre from where the robots are."""
    moved = replace(problem, start=problem.start + [0.5, 0.0, 0.0, 0.0, 0.0])
    return path_following(moved, request)


def unseeded(problem: Problem, request: Request) -> Attempt:
    """Draw the seed anew."""
    seed = int(np.random.default_rng().integers(1 << 30))
    return path_following(problem, replace(request, seed=seed))


def writing(problem: Problem, request: Request) -> Attempt:
    """Empty the batteries in the problem that it was given."""
    found = path_following(problem, request)
    problem.start_energy[:] = 0.0
    return found


def raising(problem: Problem, request: Request) -> Attempt:
    """Take tours for granted."""
    if not request.tours(problem).feasible:
        raise ValueError("no tours")
    return path_following(problem, request)


def worsening(problem: Problem, request: Request) -> Attempt:
    """Hand in the same plan twice."""
    found = path_following(problem, request)
    return replace(found, plans=[*found.plans, *found.plans], found_at=())


@pytest.mark.parametrize(
    ("planner", "test"),
    [
        (blind, "plans_pass_the_verifier"),
        (jumping, "plans_pass_the_verifier"),
        (unseeded, "the_same_seed_gives_the_same_plan"),
        (writing, "the_problem_is_not_changed"),
        (raising, "a_mission_without_a_solution_has_no_plan"),
        (worsening, "plans_of_an_attempt_get_better"),
    ],
)
def test_broken_planners_are_found(planner: Planner, test: str) -> None:
    class Suite(PlannerContract):
        def planner(self) -> Planner:
            return planner

    fails(Suite(), test)


def test_a_planner_that_does_not_halt_is_found() -> None:
    ended = threading.Event()

    def stubborn(problem: Problem, request: Request) -> Attempt:
        never = replace(request, halt=np.zeros(1, np.bool_))
        while True:
            found = path_following(problem, never)
            if found.plans or ended.is_set():
                return found

    class Suite(PlannerContract):
        patience_s = 0.3

        def planner(self) -> Planner:
            return stubborn

    try:
        fails(Suite(), "a_halted_attempt_ends")
    finally:
        ended.set()


# --- controllers ---------------------------------------------------------------------

Correct = Callable[[Controller, np.ndarray, np.ndarray], np.ndarray]


class Wrapped:
    """A controller that changes what another one gives."""

    def __init__(self, controller: Controller, correct: Correct) -> None:
        self.controller = controller
        self.changed = correct

    def correct(self, state: np.ndarray, reference: np.ndarray) -> np.ndarray:
        return self.changed(self.controller, state, reference)


def undefined(own: Controller, state: np.ndarray, ahead: np.ndarray) -> np.ndarray:
    """Return NaN far from the reference."""
    far = float(np.hypot(*(state[:2] - ahead[0, :2]))) > 1.0
    return np.full(2, np.nan) if far else own.correct(state, ahead)


def idle(own: Controller, state: np.ndarray, ahead: np.ndarray) -> np.ndarray:
    """Correct nothing."""
    return np.zeros(2)


def noisy(own: Controller, state: np.ndarray, ahead: np.ndarray) -> np.ndarray:
    """Add what chance gives."""
    return own.correct(state, ahead) + 1e-3 * np.random.default_rng().normal(size=2)


def overwriting(own: Controller, state: np.ndarray, ahead: np.ndarray) -> np.ndarray:
    """Change the reference."""
    correction = own.correct(state, ahead)
    ahead[1:] = ahead[0]
    return correction


def mirrored(own: Controller, state: np.ndarray, ahead: np.ndarray) -> np.ndarray:
    """Steer the other way."""
    return own.correct(state, ahead) * [1.0, -1.0]


@pytest.mark.parametrize(
    ("correct", "test"),
    [
        (undefined, "a_correction_is_two_finite_numbers"),
        (idle, "it_recovers_from_an_offset"),
        (idle, "it_speeds_up_when_behind"),
        (noisy, "on_a_straight_reference_nothing_is_corrected"),
        (noisy, "equal_inputs_give_equal_corrections"),
        (overwriting, "equal_inputs_give_equal_corrections"),
        (mirrored, "it_steers_back"),
    ],
)
def test_broken_controllers_are_found(correct: Correct, test: str) -> None:
    class Suite(ControllerContract):
        models = ("car",)

        def controller(self, model: RobotModel) -> Controller:
            return Wrapped(controller_maker("tvlqr")(model), correct)

    fails(Suite(), test)


# --- motion models -------------------------------------------------------------------

FIRST_ORDER = (Path(__file__).parents[2] / "tools" / "first_order.py").read_text()
MOVES = "return x + v * dt * cos(middle)"


@pytest.mark.parametrize(
    ("change", "test"),
    [
        (
            (MOVES, "return x + random() * v * dt * cos(middle)"),
            "a_step_is_a_function_of_its_arguments",
        ),
        (
            (MOVES, "return x + 2.0 * v * dt * cos(middle)"),
            "it_moves_as_fast_as_its_state_says",
        ),
        (
            (MOVES, "dt = 0.1\n    return x + v * dt * cos(middle)"),
            "no_time_leads_nowhere",
        ),
        (
            (MOVES, "return x + 0.02 * copysign(1.0, v) + v * dt * cos(middle)"),
            "half_a_step_twice_is_a_step",
        ),
        (("return 0.0, 0.0", "return 0.01, 0.0"), "it_brakes_to_rest"),
        (
            ("dx, dy = waypoint[0] - x", "dx, dy = x - waypoint[0]"),
            "it_gets_to_a_waypoint_ahead",
        ),
        (("share * limits[1]", "2.0 * limits[1]"), "it_gets_to_a_waypoint_ahead"),
        (("share * limits[1]", "0.5 * limits[1]"), "it_gets_to_a_waypoint_ahead"),
        (("from math import", "import math\n\nCALLS = []\nfrom math import"), ""),
    ],
)
def test_broken_motion_models_are_found(
    change: tuple[str, str], test: str, tmp_path: Path
) -> None:
    assert change[0] in FIRST_ORDER
    imports = "from random import random\nfrom math import copysign\n"
    path = tmp_path / "motion.py"
    path.write_text(imports + FIRST_ORDER.replace(*change))

    class Suite(MotionContract):
        limits = (-1.0, 1.0, 0.5, 1.0, 0.5)

        def motion_file(self) -> Path:
            return path

    if test:
        fails(Suite(), test)
    else:  # a change that breaks nothing
        for each in every_test(Suite()):
            each()


def fails(suite: object, test: str) -> None:
    """One test of a suite fails; it is there under that name."""
    with pytest.raises((AssertionError, ValueError)):
        getattr(suite, f"test_{test}")()


def every_test(suite: Any) -> Iterator[Callable[[], None]]:
    for name in dir(suite):
        if name.startswith("test_"):
            yield getattr(suite, name)
