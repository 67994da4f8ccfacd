"""Gears of paths: the cheaper way round at every turn that leaves it open.

Those of robots that turn on the spot are compared with all that there are.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise, product
from math import atan2, cos, pi, radians, remainder, sin, tau

import numpy as np
import pytest

from mrmg.planning import PlannerParams
from mrmg.planning.path_following.band import SPACINGS_M, Path, smooth_path
from mrmg.planning.path_following.cost_map import cost_maps_of
from mrmg.planning.path_following.following import tour_path
from mrmg.planning.path_following.gears import WORTH_M_S, with_best_gears
from mrmg.planning.problem.problem import Problem, state_mission
from mrmg.planning.problem.time_weighting import energy_share
from mrmg.scene.types import Scene

PARAMS = PlannerParams(samples=300)
CORNER = np.array([18.0, 10.0])


def mission(yard: Callable[..., Scene], degrees: float) -> tuple[Problem, Path]:
    """A robot drives east to a goal; the next one is that many degrees to its left."""
    turn = radians(degrees)
    ahead = CORNER + 9.0 * np.array([cos(turn), sin(turn)])
    goals = [
        {"id": "g1", "circle": {"center": CORNER.tolist(), "radius": 1.0}},
        {"id": "g2", "circle": {"center": ahead.round(3).tolist(), "radius": 1.0}},
    ]
    problem = state_mission(yard(goals=goals), 0, PARAMS)
    return problem, tour_path(problem, 0, [0, 1])


def geared(problem: Problem, path: Path, turns: Sequence[tuple[int, float]]) -> Path:
    return with_best_gears(problem, 0, cost_maps_of(problem)[0], path, turns)


def cost_m(problem: Problem, path: Path) -> float:
    cost_map = cost_maps_of(problem)[0]
    path, cost = smooth_path(problem.mission.targets, cost_map, path, SPACINGS_M[:1])
    limit = problem.scene.robots[0].model.limits
    size = np.hypot(*np.diff(path.node, axis=0).T)
    speed = np.where(path.gear > 0, limit.v_max_m_s, -limit.v_min_m_s)
    return cost + WORTH_M_S * float((size / speed).sum())


@pytest.mark.parametrize("degrees", [70.0, 90.0, 110.0, 135.0])
def test_no_other_gears_at_the_turn_are_cheaper(
    yard: Callable[..., Scene], degrees: float
) -> None:
    problem, path = mission(yard, degrees)
    at = int(path.stop[0])
    found = geared(problem, path, [(at, radians(degrees))])
    gears = set()
    for first, second in product((1, -1), repeat=2):
        gear = np.where(np.arange(len(path.gear)) < at, first, second)
        other = replace(path, gear=gear)
        gears.add(tuple(gear))
        if first == 1:
            assert cost_m(problem, found) <= cost_m(problem, other) + 1e-9
    assert tuple(found.gear) in gears


def test_gentle_turns_are_left_alone(yard: Callable[..., Scene]) -> None:
    problem, path = mission(yard, 40.0)
    back = replace(path, gear=-path.gear)
    assert geared(problem, back, [(int(path.stop[0]), radians(40.0))]) is back


def test_of_gears_that_cost_the_same_the_faster_ones_count(
    yard: Callable[..., Scene],
) -> None:
    """To drive straight on is as cheap forwards as after a change of gear and back."""
    problem, path = mission(yard, 0.0)
    doubtful = radians(90.0)
    halves = np.where(np.arange(len(path.gear)) < path.stop[0], 1, -1)
    found = geared(problem, replace(path, gear=halves), [(int(path.stop[0]), doubtful)])
    assert set(found.gear) == {1}


PLACES = np.array([[6.0, 4.0], [24.0, 5.0], [23.0, 16.0], [7.0, 15.0], [15.0, 10.0]])
"""Corners of the yard and its middle: ways between them are straight, and longer than
what directions are read over."""


def turner_mission(
    yard: Callable[..., Scene], seed: int, objective: str
) -> tuple[Scene, list[int]]:
    """Return a yard with a robot that turns on the spot, and a tour, both drawn.

    Every second place wants a heading, the robot's finish one of them.
    """
    rng = np.random.default_rng(seed)
    places = rng.permutation(PLACES)
    wanted = rng.uniform(-pi, pi, len(places)).round(3).tolist()
    goals = [
        {"id": f"g{i}", "circle": {"center": place, "radius": 0.3}}
        for i, place in enumerate(places[1:4].tolist())
    ]
    goals[1]["heading"] = wanted[1]
    finish = {"circle": {"center": places[4].tolist(), "radius": 0.3}}
    if seed % 2:
        finish["heading"] = wanted[4]
    robot = {"id": "r1", "pose": [*places[0].tolist(), wanted[0]], "finish": finish}
    model = {"like": "diffdrive", "limits": {"v_min": -0.8 if seed % 3 else -1.6}}
    scene = yard(goals=goals, robots=[{**robot, "model": model}], objective=objective)
    return scene, rng.permutation(3).tolist()


def turner_cost_m(
    problem: Problem, stops: np.ndarray, tour: list[int], gears: tuple[int, ...]
) -> float:
    """Return what turning on straight legs costs, and the time that they take."""
    scene, limit = problem.scene, problem.mission.fleet[0]["limit"]
    target = problem.mission.targets.target
    legs = np.diff(stops, axis=0)
    noses = [float(problem.start[0, 2])]
    for leg, gear, number in zip(legs, gears, tour, strict=True):
        direction = atan2(*(gear * leg[::-1]))
        noses += [direction, direction]
        if target["tolerance"][number] < pi:
            noses.append(float(target["heading"][number]))
    turned = sum(abs(remainder(b - a, tau)) for a, b in pairwise(noses))
    back, ahead = abs(limit[0]), limit[1]
    share = energy_share(problem.preference.driving, scene.robots[0])
    share = 0.0 if problem.minimum_time else share
    slower = np.where(np.array(gears) > 0, 0.0, 1.0 / back - 1.0 / ahead)
    lost_s = float((np.hypot(*legs.T) * slower).sum())
    worth_m = (WORTH_M_S + (1.0 - share) * ahead) * lost_s
    return float(cost_maps_of(problem)[0].scrub * turned + worth_m)


@pytest.mark.parametrize(
    ("objective", "late"), [("energy", False), ("energy", True), ("makespan", False)]
)
@pytest.mark.parametrize("seed", range(12))
def test_robots_that_turn_on_the_spot_turn_as_little_as_they_can(
    yard: Callable[..., Scene],
    state: Callable[..., Problem],
    seed: int,
    objective: str,
    late: bool,
) -> None:
    scene, tour = turner_mission(yard, seed, objective)
    problem = replace(state(scene, samples=0), minimum_time=late)
    tour.append(int(problem.mission.targets.finish[0]))
    path = tour_path(problem, 0, tour)
    stops = path.node[[0, *path.stop]]
    found = [int(path.gear[at - 1]) for at in path.stop]
    costs_m = {
        gears: turner_cost_m(problem, stops, tour, gears)
        for gears in product((1, -1), repeat=len(tour))
    }
    assert costs_m[tuple(found)] == pytest.approx(min(costs_m.values()))
    assert max(costs_m.values()) > min(costs_m.values())
