"""What seconds are worth: ways that are priced by it, and braking."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from mrmg.planning.parameters import PlannerParams
from mrmg.planning.path_following.tracking import HARD_SHARE, deceleration
from mrmg.planning.problem.problem import state_mission
from mrmg.planning.problem.time_weighting import (
    along_ways,
    brakes_hard,
    energy_share,
    priced_world,
    way_lengths_m,
    with_energies,
)
from mrmg.scene.objective import ENERGY, MAKESPAN, Objective
from mrmg.world.world import World

PARAMS = PlannerParams(samples=300)
MUD = {"id": "mud", "polygon": [[12, 4], [18, 4], [18, 20], [12, 20]], "multiplier": 4}


def test_the_share_falls_as_seconds_get_worth_more(yard: Any) -> None:
    (robot,) = yard().robots
    top_m_s = robot.model.limits.scaled(robot.model.planning_share).v_max_m_s
    power_W = robot.model.energy_model.plain_ground_J_per_m() * top_m_s
    blends = [Objective(makespan_weight=w * power_W) for w in (0.0, 0.5, 1.0, 4.0)]
    shares = [energy_share(objective, robot) for objective in (*blends, MAKESPAN)]
    assert shares == pytest.approx([1.0, 2 / 3, 0.5, 0.2, 0.0])


def test_robots_brake_hard_where_time_is_worth_more_than_driving(yard: Any) -> None:
    (robot,) = yard().robots
    assert not brakes_hard(ENERGY, robot)
    assert brakes_hard(MAKESPAN, robot)


def test_decelerations_follow_from_the_objective(yard: Any) -> None:
    def ease(**changes: Any) -> float:
        problem = state_mission(yard(**changes), 0, PARAMS)
        return deceleration(problem, 0)

    hard = yard().robots[0].model.limits.scaled(yard().robots[0].model.planning_share)
    assert ease(objective="makespan") == pytest.approx(HARD_SHARE * hard.u1_max_m_s2)
    assert ease() < 0.5 * ease(objective="makespan")


def test_ways_are_summed_up_along_successors(yard: Any) -> None:
    """Oracle: every way walked vertex by vertex."""
    wall = {"id": "wall", "box": {"center": [15, 8], "size": [2, 14]}}
    roadmap = state_mission(yard(obstacles=[wall]), 0, PARAMS).roadmap
    vertex, after = roadmap.arrays.vertex, roadmap.arrays.successor[0, 0]
    found = way_lengths_m(roadmap)[0, 0]
    finite = np.isfinite(roadmap.arrays.cost_to_go[0, 0])
    assert (np.isfinite(found) == finite).all()
    for v in np.flatnonzero(finite)[::7]:
        walked, here = 0.0, int(v)
        while after[here] >= 0:
            walked += float(np.hypot(*(vertex[after[here]] - vertex[here])))
            here = int(after[here])
        assert found[v] == pytest.approx(walked)
    ones = np.where(roadmap.arrays.successor >= 0, 1.0, 0.0)
    assert along_ways(roadmap, ones)[0, 0][finite].max() > 1.0


@pytest.mark.parametrize("x", [4.0, 0.7])  # its back to the map's edge at 0.7
def test_energies_of_ways_that_are_not_priced_are_the_distances(
    yard: Any, x: float
) -> None:
    robot = {"id": "r1", "model": "car", "pose": [x, 10, 0]}
    scene = yard(terrain=[MUD], robots=[robot])
    world = World.from_scene(scene)
    assert priced_world(scene, world) is world
    roadmap = state_mission(scene, 0, PARAMS).roadmap
    again = with_energies(roadmap, scene, world, PARAMS.margins)
    assert again.distance == pytest.approx(roadmap.distance, rel=2e-3)
    assert again.start_distance == pytest.approx(roadmap.start_distance, rel=2e-3)
    assert np.isfinite(again.start_distance).all()


def test_who_is_in_a_hurry_drives_through_the_mud(yard: Any) -> None:
    by_energy = state_mission(yard(terrain=[MUD]), 0, PARAMS).roadmap
    by_time = state_mission(
        yard(terrain=[MUD], objective="makespan"), 0, PARAMS
    ).roadmap
    ways = [way_lengths_m(roadmap)[0, 0] for roadmap in (by_energy, by_time)]
    start = len(by_energy.targets)
    assert ways[1][start] == pytest.approx(22.0, abs=0.5)
    assert ways[0][start] > ways[1][start] + 2.0
    assert by_time.start_distance[0, 0] > by_energy.start_distance[0, 0]
    assert by_time.start_distance[0, 0] > 22.0 + 3.0 * 6.0 - 1.0
