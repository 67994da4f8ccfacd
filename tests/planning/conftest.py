"""Random missions for the router with independent answers; small planning problems."""

from __future__ import annotations

import heapq
import itertools
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
import pytest
from bench_routing import uneven_mission

from mrmg import seeding
from mrmg.planning.parameters import PlannerParams
from mrmg.planning.problem.problem import Problem, state_problem
from mrmg.planning.roadmap.roadmap import build_roadmap
from mrmg.planning.routing._nrpa_kernels import RoutingArrays
from mrmg.planning.routing.instance import RoutingInstance
from mrmg.scene.loading import scene_from_document
from mrmg.scene.types import Scene
from mrmg.world.world import World


def random_mission(
    seed: int,
    *,
    goals: int,
    stations: int,
    robots: int = 1,
    range_m: tuple[float, float] = (60.0, 160.0),
    open_goal: Sequence[bool] | None = None,
) -> RoutingArrays:
    """Return a mission of the routers' bench, drawn by a seed."""
    return uneven_mission(
        np.random.default_rng(seed),
        goals=goals,
        stations=stations,
        robots=robots,
        range_m=range_m,
        open_goal=open_goal,
    )


def drive(
    problem: RoutingArrays, robot: int, tour: Sequence[int]
) -> tuple[float, float]:
    """Return (cost, least energy above the reserve) of driving a tour [J]."""
    place = problem.cost.shape[2]
    energy = problem.energy[robot]
    total, least = 0.0, energy - problem.reserve[robot]
    for target in tour:
        leg = problem.cost[robot, place, target]
        total += leg
        energy -= leg
        least = min(least, energy - problem.reserve[robot])
        if target >= problem.goals:
            energy = problem.capacity[robot]
        place = target
    return total, least


def with_stations(
    route: tuple[int, ...], stations: range, most: int
) -> Iterator[tuple[int, ...]]:
    """Yield a route with every choice of up to `most` stations before each goal."""
    pauses = [
        pause for n in range(most + 1) for pause in itertools.permutations(stations, n)
    ]
    for choice in itertools.product(pauses, repeat=len(route)):
        yield tuple(
            itertools.chain.from_iterable(
                (*pause, goal) for pause, goal in zip(choice, route, strict=True)
            )
        )


def cheapest_of_subsets(problem: RoutingArrays, robot: int) -> dict[int, float]:
    """Return the exact least cost of every set of goals one robot can visit.

    Label setting over (set visited, place): a label is (cost, energy), and one that
    costs more and has less energy than another is dropped. Recharges are not limited.
    """
    targets, goals = problem.cost.shape[2], problem.goals
    labels: dict[tuple[int, int], list[tuple[float, float]]] = defaultdict(list)
    best: dict[int, float] = {}
    heap = [(0.0, -float(problem.energy[robot]), 0, targets)]
    while heap:
        cost, minus_energy, mask, place = heapq.heappop(heap)
        energy = -minus_energy
        known = labels[mask, place]
        if any(c <= cost and e >= energy for c, e in known):
            continue
        known.append((cost, energy))
        best[mask] = min(cost, best.get(mask, np.inf))
        for target in range(targets):
            leg = problem.cost[robot, place, target]
            after = energy - leg
            if after < problem.reserve[robot] or target == place:
                continue
            if target >= goals:
                full = -float(problem.capacity[robot])
                heapq.heappush(heap, (cost + leg, full, mask, target))
            elif problem.open_goal[target] and not mask >> target & 1:
                visited = mask | 1 << target
                heapq.heappush(heap, (cost + leg, -after, visited, target))
    return best


def cheapest_fleet(problem: RoutingArrays) -> float:
    """Return the exact least cost of visiting all open goals; inf if impossible."""
    per_robot = [
        cheapest_of_subsets(problem, robot) for robot in range(len(problem.energy))
    ]
    fleet = {0: 0.0}
    for best in per_robot:
        joined: dict[int, float] = {}
        for (done, before), (more, cost) in itertools.product(
            fleet.items(), best.items()
        ):
            if done & more == 0:
                total = before + cost
                joined[done | more] = min(total, joined.get(done | more, np.inf))
        fleet = joined
    everything = sum(1 << g for g in range(problem.goals) if problem.open_goal[g])
    return fleet.get(everything, np.inf)


@pytest.fixture
def mission() -> Callable[..., RoutingArrays]:
    """Return the maker of random missions."""
    return random_mission


@pytest.fixture
def replay() -> Callable[..., tuple[float, float]]:
    """Return the function that drives a tour leg by leg."""
    return drive


@pytest.fixture
def oracle() -> Callable[[RoutingArrays], float]:
    """Return the exact solver of small missions."""
    return cheapest_fleet


@pytest.fixture
def insertions() -> Callable[..., Iterator[tuple[int, ...]]]:
    """Return the enumeration of all ways to put stations into a route."""
    return with_stations


def yard_scene(**changes: Any) -> Scene:
    """Return 30 x 20 m of plain ground with a goal in the east and a car in the west.

    Args:
        changes: entries of the scene file to replace.
    """
    document = {
        "format": 1,
        "name": "yard",
        "bounds": [0, 0, 30, 20],
        "goals": [{"id": "g", "circle": {"center": [26, 10], "radius": 1.5}}],
        "battery": {"capacity_m": 200},
        "robots": [{"id": "r1", "model": "car", "pose": [4, 10, 0]}],
    }
    return scene_from_document({**document, **changes}, source="yard")


def state_scene(scene: Scene, seed: int = 0, **changes: Any) -> Problem:
    """Return the planning problem of a scene, over a small roadmap.

    Args:
        scene: the scene.
        seed: of the roadmap.
        changes: parameters that differ from the default profile's.
    """
    params = PlannerParams(**{"samples": 400, **changes})
    world = World.from_scene(scene)
    roadmap = build_roadmap(
        scene,
        world,
        samples=params.samples,
        neighbours=params.neighbours,
        margins=params.margins,
        rng=seeding.stream(seed, "roadmap"),
    )
    return state_problem(scene, world, roadmap, params)


@pytest.fixture
def yard() -> Callable[..., Scene]:
    """Return the maker of small scenes."""
    return yard_scene


@pytest.fixture
def crossing(yard: Callable[..., Scene]) -> Scene:
    """Return a yard that four cars cross, two and two from opposite sides."""
    robots = [
        {
            "id": name,
            "model": "car",
            "pose": pose,
            "finish": {"circle": {"center": goal, "radius": 0.5}},
        }
        for name, pose, goal in (
            ("r1", [4, 10, 0], [26, 10]),
            ("r2", [26, 10, 3.14], [4, 10]),
            ("r3", [15, 3, 1.57], [15, 17]),
            ("r4", [15, 17, -1.57], [15, 3]),
        )
    ]
    return yard(robots=robots, goals=[], objective="makespan")


@pytest.fixture
def state() -> Callable[..., Problem]:
    """Return the maker of planning problems."""
    return state_scene


@pytest.fixture
def chain() -> RoutingArrays:
    """Five stations on a line, 10 m apart, with a battery for 11 m."""
    x = np.array([60.0, 10.0, 20.0, 30.0, 40.0, 50.0])
    return RoutingInstance(
        goals=1,
        distance=np.abs(x[:, None] - x)[None],
        start_distance=x[None],
        plain=np.ones(1),
        energy=np.array([11.0]),
        capacity=np.array([11.0]),
        reserve=np.zeros(1),
    ).arrays
