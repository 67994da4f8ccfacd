"""What every router must keep."""

from __future__ import annotations

import copy
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, replace
from typing import Any

import numpy as np

from mrmg.planning.routers import Router
from mrmg.planning.routing.instance import RoutingInstance
from mrmg.planning.routing.routing import Routing
from mrmg.planning.routing.routing_problem import RoutingProblem, faults_of_tours

SPEED_M_S = 2.0
"""Speed of the robots of sample problems."""

SIDE_M = 100.0
"""Side of the square in which their targets lie."""

CLIMB_J = 20.0
"""Most that a leg uphill takes more than the leg back."""


def sample_routing_problem(
    seed: int,
    *,
    goals: int = 3,
    stations: int = 1,
    robots: int = 2,
    range_m: tuple[float, float] = (150.0, 250.0),
    closed: bool = False,
    **options: Any,
) -> RoutingProblem:
    """Return a routing problem on a square with slopes: legs back cost something else.

    Args:
        seed: of positions, heights, dwell times and batteries.
        goals: how many.
        stations: how many.
        robots: how many.
        range_m: between these lies the length of path that a full battery lasts for.
        closed: whether robots return to where they start.
        options: further arguments of `RoutingInstance`, such as `limit`.
    """
    rng = np.random.default_rng(seed)
    targets = goals + stations
    point = rng.uniform(0.0, SIDE_M, (targets + robots, 2))
    length = np.hypot(*(point[:, None] - point[None]).transpose(2, 0, 1))
    height = rng.uniform(0.0, CLIMB_J, len(point))
    cost = length + np.maximum(height[None] - height[:, None], 0.0)
    time = length / SPEED_M_S
    dwell = rng.uniform(0.0, 20.0, targets)
    capacity = rng.uniform(*range_m, robots)
    nodes = [np.r_[np.arange(targets), targets + r] for r in range(robots)]
    if closed:
        options["finish_distance"] = np.stack(
            [cost[node, targets + r] for r, node in enumerate(nodes)]
        )
        options["finish_time"] = np.stack(
            [time[node, targets + r] for r, node in enumerate(nodes)]
        )
    arrays = RoutingInstance(
        goals=goals,
        distance=np.repeat(cost[None, :targets, :targets], robots, axis=0),
        start_distance=cost[targets:, :targets],
        plain=np.ones(robots),
        energy=capacity * rng.uniform(0.5, 1.0, robots),
        capacity=capacity,
        reserve=0.05 * capacity,
        time=np.stack([time[node, :targets] + dwell for node in nodes]),
        **options,
    ).arrays
    return RoutingProblem.of(arrays)


class RouterContract:
    """Tests of a router; subclasses return it from `router`.

    Attributes:
        solved_at_least: share of the sample problems, nearly all of which have tours,
            for which the router must find some.
    """

    solved_at_least = 0.5

    def router(self) -> Router:
        """Return the router to be tested."""
        raise NotImplementedError("return your router here")

    def problems(self) -> dict[str, list[RoutingProblem]]:
        """Return problems by the option that they have."""
        options: dict[str, dict[str, Any]] = {
            "recharging": {},
            "finishes": {"closed": True},
            "time limits": {"closed": True, "limit": np.full(2, 240.0)},
            "charging that takes time": {
                "limit": np.full(2, 200.0),
                "charge_power": np.full(2, 4.0),
            },
            "makespan": {"makespan_weight": 1.0, "charge_power": np.full(2, 4.0)},
            "consumers": {
                "makespan_weight": 3.0,
                "consumers": np.full(2, 1.5),
                "range_m": (240.0, 360.0),
            },
        }
        return {
            name: [
                sample_routing_problem(seed, goals=6, stations=2, **option)
                for seed in range(12)
            ]
            for name, option in options.items()
        }

    def test_tours_keep_every_rule(self) -> None:
        """All goals once, batteries above reserves, times within limits, true costs."""
        router = self.router()
        for name, problems in self.problems().items():
            for seed, problem in enumerate(problems):
                routing = router(problem, seed)
                faults = list(faults_of_tours(problem, routing))
                assert not faults, f"{name}, problem {seed}: {faults}"

    def test_tours_are_found(self) -> None:
        """Of most sample problems."""
        router = self.router()
        for name, problems in self.problems().items():
            found = [router(problem, 0).feasible for problem in problems]
            share = float(np.mean(found))
            assert share >= self.solved_at_least, f"{name}: only {share:.0%} solved"

    def test_the_same_seed_gives_the_same_tours(self) -> None:
        """Whatever was solved in between, and on any thread."""
        router = self.router()
        problem = sample_routing_problem(1, goals=9, stations=2)
        first = router(problem, 3)
        router(sample_routing_problem(2, goals=5), 4)
        with ThreadPoolExecutor(4) as threads:
            others = list(threads.map(lambda _: router(problem, 3), range(4)))
        assert all(other == first for other in others), "tours differ for equal seeds"

    def test_the_problem_is_not_changed(self) -> None:
        """Problems are shared by all attempts."""
        before = sample_routing_problem(1, goals=5)
        problem = copy.deepcopy(before)  # can be written to: a change is to be found
        self.router()(problem, 0)
        changed = "the problem was changed"
        np.testing.assert_equal(asdict(problem), asdict(before), changed)

    def test_no_goals_cost_nothing(self) -> None:
        """Robots that have nothing to do and nowhere to end stay where they are."""
        problem = sample_routing_problem(0, closed=True)
        idle = replace(problem, open_goals=np.zeros(problem.goals, bool))
        assert self.router()(idle, 0) == Routing(((), ()), 0.0)

    def test_goals_that_are_done_are_left_out(self) -> None:
        """Only open goals are to be visited."""
        for seed in range(4):
            problem = sample_routing_problem(seed, goals=5)
            rest = replace(problem, open_goals=np.array([True, False] * 2 + [True]))
            routing = self.router()(rest, 0)
            assert not list(faults_of_tours(rest, routing))

    def test_what_is_impossible_has_infinite_cost(self) -> None:
        """A goal, or a finish, to which there is no path."""
        problem = sample_routing_problem(0, closed=True)
        leg_J = problem.leg_energy_J.copy()
        leg_J[:, :, 1] = np.inf
        no_goal = replace(problem, leg_energy_J=leg_J)
        no_finish = replace(
            problem, finish_energy_J=np.full_like(problem.finish_energy_J, np.inf)
        )
        for name, each in {"goal": no_goal, "finish": no_finish}.items():
            routing = self.router()(each, 0)
            assert not routing.feasible, f"tours to a {name} without a path"
