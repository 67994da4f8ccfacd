"""The bound of the makespan: near the truth where that is known, and never above it."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest

from mrmg.planning.bound import makespan_bound
from mrmg.planning.bound.makespan_bound import makespan_bound_s
from mrmg.scene.types import Scene

CELLS = 3000


def yard_with(yard: Any, seed: int, goals: int, robots: int, **changes: Any) -> Scene:
    rng = np.random.default_rng(seed)
    places = rng.uniform((8, 2), (28, 18), (goals, 2)).round(2).tolist()
    return yard(
        goals=[
            {"id": f"g{i}", "circle": {"center": place, "radius": 0.5}}
            for i, place in enumerate(places)
        ],
        robots=[
            {"id": f"r{i}", "model": "car", "pose": [3, 4 + 6 * i, 0]}
            for i in range(robots)
        ],
        **changes,
    )


def shortest_s(scene: Scene) -> float:
    """Return the least makespan of straight ways from centre to centre, enumerated.

    On open ground that is what the bound falls short of by the regions alone.
    """
    centre = [goal.region.center for goal in scene.goals]
    best_s = math.inf
    for who in itertools.product(range(len(scene.robots)), repeat=len(centre)):
        longest_s = 0.0
        for r, robot in enumerate(scene.robots):
            own = [centre[g] for g in range(len(centre)) if who[g] == r]
            ways_m = [
                sum(math.dist(a, b) for a, b in itertools.pairwise(order))
                for order in ((robot.pose[:2], *p) for p in itertools.permutations(own))
            ]
            limits = robot.model.limits
            ramp_s = limits.v_max_m_s / limits.u1_max_m_s2 if min(ways_m) > 4.0 else 0.0
            longest_s = max(longest_s, min(ways_m) / limits.v_max_m_s + ramp_s)
        best_s = min(best_s, longest_s)
    return best_s


@pytest.mark.parametrize(("seed", "robots"), [(1, 1), (2, 2), (3, 2), (4, 3)])
def test_near_what_enumeration_finds_and_not_above(
    yard: Any, seed: int, robots: int
) -> None:
    scene = yard_with(yard, seed, goals=4, robots=robots)
    truth_s = shortest_s(scene)
    found_s = makespan_bound_s(scene, cells=CELLS)
    # Four regions of 0.5 m radius may be cut short on either side.
    slack_s = 4.0 / scene.robots[0].model.limits.v_max_m_s
    assert truth_s - slack_s - 0.02 * truth_s <= found_s <= truth_s


def test_the_bound_of_many_goals_is_below_the_exact_one(
    yard: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = yard_with(yard, 5, goals=6, robots=2)
    exact_s = makespan_bound_s(scene, cells=CELLS)
    monkeypatch.setattr(makespan_bound, "MOST_GOALS", 5)
    relaxed_s = makespan_bound_s(scene, cells=CELLS)
    assert 0.4 * exact_s < relaxed_s <= exact_s


def test_terrain_and_batteries_do_not_count(yard: Any) -> None:
    mud = {"polygon": [[10, 0], [20, 0], [20, 20], [10, 20]], "multiplier": 3}
    plain_s = makespan_bound_s(yard_with(yard, 6, 3, 1), cells=CELLS)
    muddy_s = makespan_bound_s(
        yard_with(yard, 6, 3, 1, terrain=[mud], battery={"capacity_m": 5}), cells=CELLS
    )
    assert muddy_s == pytest.approx(plain_s)


def test_an_obstacle_never_lowers_it_and_a_stay_adds_to_it(yard: Any) -> None:
    wall = {"box": {"center": [15, 10], "size": [1, 16]}}
    free_s = makespan_bound_s(yard(), cells=CELLS)
    assert makespan_bound_s(yard(obstacles=[wall]), cells=CELLS) > free_s + 1.0
    goal = {"id": "g", "circle": {"center": [26, 10], "radius": 1.5}, "dwell": 30}
    staying_s = makespan_bound_s(yard(goals=[goal]), cells=CELLS)
    assert free_s + 25.0 < staying_s < free_s + 30.0 + 1e-6


def test_no_goals_take_no_time_and_a_walled_goal_forever(yard: Any) -> None:
    assert makespan_bound_s(yard(goals=[])) == 0.0
    ring = [[22, 6], [29.5, 6], [29.5, 14], [22, 14]]
    inside = [[24, 8], [28, 8], [28, 12], [24, 12]]
    cage = {"polygon": ring, "holes": [inside]}
    assert makespan_bound_s(yard(obstacles=[cage]), cells=CELLS) == math.inf
