"""Robots in each other's way: who waits, who is led round whom."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import mrmg
from mrmg.planning import PlannerParams
from mrmg.planning.drafting.drafting import draftable, drafts, tour_path, whole_tour
from mrmg.planning.drafting.encounters import MOST, Encounters, in_the_way, waits_at
from mrmg.planning.drafting.errand import Errand
from mrmg.planning.drafting.refine import surfaces_of
from mrmg.planning.drafting.tracking import Drive
from mrmg.planning.problem.problem import Problem, state_mission
from mrmg.planning.routing.routing import Routing
from mrmg.plans import Plan
from mrmg.scene.types import Scene

PARAMS = PlannerParams(samples=400)


def finishing(
    name: str, x: float, y: float, yaw: float, to: tuple[float, float]
) -> Any:
    finish = {"circle": {"center": list(to), "radius": 1.0}}
    return {"id": name, "model": "car", "pose": [x, y, yaw], "finish": finish}


SWAP = [
    finishing("a", 4, 10, 0.0, (26, 10)),
    finishing("b", 26, 10, np.pi, (4, 10)),
]

CROSSING = [
    finishing("a", 4, 10, 0.0, (26, 10)),
    finishing("b", 15, 3, np.pi / 2, (15, 17)),
]


def drafted(scene: Scene) -> list[Plan]:
    problem = state_mission(scene, 0, PARAMS)
    assert draftable(problem)
    tours = Routing(tours=tuple(() for _ in scene.robots), cost_J=0.0)
    return list(drafts(problem, PARAMS, tours, 0, np.zeros(1, np.bool_)))


def errands_of(problem: Problem) -> list[Errand]:
    routing = Routing(tours=tuple(() for _ in problem.scene.robots), cost_J=0.0)
    errands = []
    for r, surface in enumerate(surfaces_of(problem)):
        tour = whole_tour(problem, routing, r)
        errands.append(Errand(tour, tour_path(problem, r, tour), surface))
        errands[-1].tighten(problem, (0.8,))
    return errands


def stuck(problem: Problem, *states: tuple[float, float, float], driven: Any) -> Drive:
    """Return a drive in which the first robot got stuck."""
    state = np.zeros((len(states), 5))
    state[:, :3] = states
    return Drive((), 0, state, np.array(driven, float))


@pytest.mark.parametrize("robots", [SWAP, CROSSING], ids=["swap", "crossing"])
def test_robots_whose_ways_meet_get_past_each_other(
    yard: Callable[..., Scene], robots: list[Any]
) -> None:
    scene = yard(goals=[], robots=robots)
    plans = drafted(scene)
    assert plans
    for plan in plans:
        assert mrmg.verify(scene, plan).violations == ()
    assert plans[-1].makespan_s < 35.0  # 22 m at 1.7 m/s, and slowing down


def test_in_a_lane_for_one_somebody_waits(yard: Callable[..., Scene]) -> None:
    """One robot leaves a narrow lane in which the other one wants to enter."""
    walls = [
        {"id": f"w{y}", "box": {"center": [15, y], "size": [14, 3]}}
        for y in (7.0, 13.0)
    ]
    robots = [
        finishing("a", 4, 10, 0.0, (26, 10)),
        finishing("b", 26, 14, -np.pi / 2, (4, 5)),
    ]
    scene = yard(goals=[], robots=robots, obstacles=walls)
    plans = drafted(scene)
    assert plans
    assert mrmg.verify(scene, plans[-1]).violations == ()


def test_who_is_near_is_in_the_way(yard: Callable[..., Scene]) -> None:
    problem = state_mission(yard(goals=[], robots=SWAP), 0, PARAMS)
    errands = errands_of(problem)
    near = stuck(problem, (13.5, 10, 0), (16.8, 10, np.pi), driven=(9.5, 9.2))
    assert in_the_way(problem, errands, near) == 1
    far = stuck(problem, (10, 10, 0), (20, 10, np.pi), driven=(6, 6))
    assert in_the_way(problem, errands, far) == -1


def test_who_waits_stands_before_the_shared_stretch_until_it_is_left(
    yard: Callable[..., Scene],
) -> None:
    problem = state_mission(yard(goals=[], robots=CROSSING), 0, PARAMS)
    errands = errands_of(problem)
    outcome = stuck(problem, (12, 10, 0), (15, 7, np.pi / 2), driven=(8, 4))
    waits = waits_at(problem, errands, outcome, 0, 1)
    assert {wait.at.robot for _, wait in waits} == {0, 1}
    assert waits[0][0] <= waits[1][0]
    for other_m, wait in waits:
        waiting = wait.at.robot
        assert other_m == pytest.approx(wait.until.way_m - (4 if waiting == 0 else 8))
        assert wait.until.robot == 1 - waiting
        # The one stands short of the crossing at (15, 10), the other has left it.
        assert np.hypot(*(wait.at.point - (15, 10))) > 2.0
        assert np.hypot(*(wait.until.point - (15, 10))) > 1.5
        crossing = 11.0 if waiting == 0 else 7.0
        assert wait.at.way_m < crossing


def test_nobody_waits_on_the_other_ones_way(yard: Callable[..., Scene]) -> None:
    """Robots that change places can only be led round each other."""
    problem = state_mission(yard(goals=[], robots=SWAP), 0, PARAMS)
    errands = errands_of(problem)
    outcome = stuck(problem, (13.5, 10, 0), (16.8, 10, np.pi), driven=(9.5, 9.2))
    assert waits_at(problem, errands, outcome, 0, 1) == []
    encounters = Encounters()
    before = [errand.path.node.copy() for errand in errands]
    assert encounters.resolve(problem, errands, outcome)
    assert not encounters.waits
    changed = [
        len(errand.path.node) != len(node) or not np.allclose(errand.path.node, node)
        for errand, node in zip(errands, before, strict=True)
    ]
    assert any(changed)


def test_what_did_not_help_is_not_tried_again(yard: Callable[..., Scene]) -> None:
    problem = state_mission(yard(goals=[], robots=CROSSING), 0, PARAMS)
    errands = errands_of(problem)
    straight = [errand.path for errand in errands]
    outcome = stuck(problem, (12.8, 10, 0), (15, 8, np.pi / 2), driven=(8.8, 5))
    encounters = Encounters()
    seen: list[Any] = []
    while encounters.resolve(problem, errands, outcome):
        waiting = [wait.at.robot for wait in encounters.waits]
        led = [
            errand.path is not path
            for errand, path in zip(errands, straight, strict=True)
        ]
        assert bool(waiting) != any(led)
        seen.append((waiting, [errand.path for errand in errands]))
    assert sorted(waiting for waiting, _ in seen[:2]) == [[0], [1]]
    assert 4 <= len(seen) <= MOST * len(errands)
    paths = [tuple(id(path) for path in paths) for _, paths in seen[2:]]
    assert len(set(paths)) == len(paths)


def test_a_detour_on_which_a_robot_gets_stuck_is_given_up(
    yard: Callable[..., Scene],
) -> None:
    """Also where nobody is near: it may lack the room there."""
    problem = state_mission(yard(goals=[], robots=SWAP), 0, PARAMS)
    errands = errands_of(problem)
    straight = [errand.path for errand in errands]
    outcome = stuck(problem, (13.5, 10, 0), (16.8, 10, np.pi), driven=(9.5, 9.2))
    encounters = Encounters()
    assert encounters.resolve(problem, errands, outcome)
    led = [r for r in range(2) if errands[r].path is not straight[r]]
    first = [errand.path for errand in errands]
    alone = [(14.0, 10.5, 0.0), (25.0, 10.0, np.pi)]
    if led[0] == 1:
        alone = [(4.0, 10.0, 0.0), (15.0, 10.5, np.pi)]
    again = replace(stuck(problem, *alone, driven=(9.5, 9.2)), stuck=led[0])
    assert in_the_way(problem, errands, again) == -1
    assert encounters.resolve(problem, errands, again)
    assert any(
        errand.path is not path for errand, path in zip(errands, first, strict=True)
    )


def test_a_robot_stuck_alone_is_not_in_anybodys_way(
    yard: Callable[..., Scene],
) -> None:
    problem = state_mission(yard(goals=[], robots=SWAP), 0, PARAMS)
    errands = errands_of(problem)
    outcome = stuck(problem, (8, 10, 0), (20, 10, np.pi), driven=(4, 6))
    assert not Encounters().resolve(problem, errands, outcome)


@pytest.mark.parametrize("objective", ["energy", "makespan"])
def test_robots_wait_for_nothing_but_energy_if_a_detour_is_sooner(
    yard: Callable[..., Scene], objective: str
) -> None:
    """Ways that share a long stretch aslant: who waits there waits long."""
    robots = [
        finishing("a", 4, 4, 0.0, (26, 12)),
        finishing("b", 26, 4, np.pi, (4, 12)),
    ]
    scene = yard(goals=[], robots=robots, objective=objective)
    problem = state_mission(scene, 0, PARAMS)
    errands = errands_of(problem)
    outcome = stuck(problem, (13.4, 7.5, 0.3), (16.6, 7.5, 2.8), driven=(10, 10))
    waits = waits_at(problem, errands, outcome, 0, 1)
    assert waits
    assert waits[0][0] > 3.0
    encounters = Encounters()
    assert encounters.resolve(problem, errands, outcome)
    assert bool(encounters.waits) == (objective == "energy")
