"""What every refinement must keep: never worse, never newly invalid, deterministic."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import combinations_with_replacement
from pathlib import Path

import numpy as np
import pytest

import mrmg
from mrmg.planning import PlannerParams, Request, plan_mission
from mrmg.planning.path_following.band import visit_steps
from mrmg.planning.path_following.refine import (
    nearest_in_order,
    refine,
    tour_numbers,
)
from mrmg.planning.problem.problem import Problem, state_mission
from mrmg.planning.problem.targets import target_depth_m
from mrmg.planning.routers import find_router
from mrmg.plans import Plan
from mrmg.scene.loading import scene_from_document
from mrmg.scene.types import Scene

SCENES = Path(__file__).parents[2] / "scenes"
RAW = PlannerParams(improvements=0, refinements=0, samples=600, follow_paths=False)

MISSIONS = (
    "two_swap",
    "station_needed",
    "obstacle_with_hole",
    "overlapping_terrain",
    "quickstart",
    "diffdrive",
)


@dataclass(frozen=True)
class Refined:
    """A mission, a plan as a tree found it, and what refining it gave."""

    scene: Scene
    problem: Problem
    before: Plan
    after: Plan


def asked(seed: int = 0) -> Request:
    return Request(params=RAW, router=find_router(RAW.router), seed=seed)


def refined(scene: Scene, seed: int = 0) -> Refined:
    before = plan_mission(scene, seed=seed, params=RAW).plan
    assert before is not None
    problem = state_mission(scene, seed, RAW)
    return Refined(scene, problem, before, refine(problem, asked(seed), before))


@pytest.fixture(params=MISSIONS, scope="module")
def mission(request: pytest.FixtureRequest) -> Refined:
    own = SCENES / f"{request.param}.yaml"
    return refined(mrmg.load_scene(own if own.exists() else request.param))


def test_never_worse(mission: Refined) -> None:
    assert mission.after.cost_J <= mission.before.cost_J


def test_never_newly_invalid(mission: Refined) -> None:
    assert mrmg.verify(mission.scene, mission.before).violations == ()
    verdict = mrmg.verify(mission.scene, mission.after)
    assert verdict.violations == ()
    first = mrmg.verify(mission.scene, mission.before)
    for now_m, least_m in (
        (verdict.min_obstacle_clearance_m, first.min_obstacle_clearance_m),
        (verdict.min_robot_distance_m, first.min_robot_distance_m),
    ):
        if now_m is not None and least_m is not None:
            # Between steps a little less than the margin may be left.
            assert now_m >= min(least_m, 0.15)


def test_the_same_targets_in_the_same_order_as_deep(mission: Refined) -> None:
    assert mission.after.tours == mission.before.tours
    for visits in (mission.before.visits, mission.after.visits):
        assert {visit.target for visit in visits} == {
            name for tour in mission.before.tours.values() for name in tour
        }
    tours = tour_numbers(mission.problem, mission.after)
    targets = mission.scene.targets()
    for tour, trajectory in zip(tours, mission.after.trajectories, strict=True):
        steps = visit_steps(mission.problem.mission.targets, tour, trajectory.state)
        assert len(steps) == len(tour)
        assert steps == sorted(steps)
        for t, step in zip(tour, steps, strict=True):
            depth = targets[t].region.depth(trajectory.state[step, :2])
            assert depth[0] >= target_depth_m(mission.scene) - 1e-9


def test_the_planners_limits_are_kept(mission: Refined) -> None:
    for robot, trajectory in zip(
        mission.scene.robots, mission.after.trajectories, strict=True
    ):
        limits = robot.model.limits.scaled(robot.model.planning_share)
        u1, u2 = np.abs(trajectory.control).max(axis=0)
        assert u1 <= limits.u1_max_m_s2 + 1e-9
        assert u2 <= limits.u2_max + 1e-9
        speed, turn = trajectory.state[:, 3], trajectory.state[:, 4]
        assert limits.v_min_m_s - 1e-9 <= speed.min()
        assert speed.max() <= limits.v_max_m_s + 1e-9
        assert np.abs(turn).max() <= limits.w_max + 1e-9


def test_the_same_again(mission: Refined) -> None:
    again = refine(mission.problem, asked(), mission.before)
    assert again.digest == mission.after.digest


@pytest.mark.parametrize(
    "name", ["diffdrive", pytest.param("scene1", marks=pytest.mark.ci)]
)
def test_most_missions_gain(name: str) -> None:
    """What a search found without a path leaves something to gain."""
    one = refined(mrmg.load_scene(name), seed=1)
    assert one.after.cost_J < one.before.cost_J


def test_halted_it_hands_back_what_it_was_given(mission: Refined) -> None:
    halted = replace(asked(), halt=np.ones(1, np.bool_))
    assert refine(mission.problem, halted, mission.before) is mission.before


def test_a_straight_drive_comes_near_to_its_distance(
    yard: Callable[..., Scene],
) -> None:
    """22 m to the centre of the goal, whose edge is 1.5 m nearer, and no braking."""
    scene = yard()
    one = refined(scene)
    metre_J = scene.robots[0].model.energy_model.plain_ground_J_per_m()
    assert 20.5 <= one.after.cost_J / metre_J < 20.8


def test_a_goal_behind_obstacles_is_met_at_the_margin(
    yard: Callable[..., Scene],
) -> None:
    wall = {"id": "wall", "box": {"center": [15, 8], "size": [2, 10]}, "height": 1}
    scene = yard(obstacles=[wall])
    one = refined(scene)
    assert one.after.cost_J < one.before.cost_J
    clearance_m = mrmg.verify(scene, one.after).min_obstacle_clearance_m
    assert clearance_m is not None
    assert 0.2 < clearance_m < 0.6


def test_refining_again_and_again_never_costs_more() -> None:
    one = refined(mrmg.load_scene("quickstart"))
    plan = one.after
    for _ in range(3):
        better = refine(one.problem, asked(), plan)
        assert better.cost_J <= plan.cost_J
        plan = better


def test_a_plan_that_misses_its_targets_is_left_alone() -> None:
    one = refined(mrmg.load_scene(SCENES / "two_swap.yaml"))
    short = replace(
        one.before,
        trajectories=tuple(
            replace(item, state=item.state[:5].copy(), control=item.control[:4].copy())
            for item in one.before.trajectories
        ),
    )
    assert refine(one.problem, asked(), short) is short


def test_a_robot_without_a_tour_stays(yard: Callable[..., Scene]) -> None:
    robots = [
        {"id": "r1", "model": "car", "pose": [4, 10, 0]},
        {"id": "r2", "model": "car", "pose": [4, 16, 0]},
    ]
    one = refined(yard(robots=robots))
    assert mrmg.verify(one.scene, one.after).violations == ()
    idle = next(robot for robot, tour in one.after.tours.items() if not tour)
    assert np.ptp(one.after.trajectory(idle).state[:, :2], axis=0).max() < 1e-9


def test_moving_the_scene_by_whole_cells_changes_no_gain(
    yard: Callable[..., Scene],
) -> None:
    one = refined(yard())
    moved = {
        **one.scene.document,
        "bounds": [40, -30, 70, -10],
        "goals": [{"id": "g", "circle": {"center": [66, -20], "radius": 1.5}}],
        "robots": [{"id": "r1", "model": "car", "pose": [44, -20, 0]}],
    }
    other = refined(scene_from_document(moved, source="moved"))
    assert other.after.cost_J == pytest.approx(one.after.cost_J, rel=5e-3)


def test_robots_still_end_where_they_must(yard: Callable[..., Scene]) -> None:
    """A car drives back to its start; a robot that turns ends with its heading."""
    goals = [
        {"id": "g1", "circle": {"center": [24, 6], "radius": 1.5}},
        {"id": "g2", "circle": {"center": [24, 15], "radius": 1.5}},
    ]
    finish = {"circle": {"center": [10, 15], "radius": 1.0}, "heading": 1.0}
    robots = [
        {"id": "r1", "model": "car", "pose": [4, 5, 0], "finish": "start"},
        {"id": "r2", "model": "diffdrive", "pose": [4, 15, 0], "finish": finish},
    ]
    one = refined(yard(goals=goals, robots=robots))
    assert one.after.cost_J <= one.before.cost_J
    assert mrmg.verify(one.scene, one.before).violations == ()
    assert mrmg.verify(one.scene, one.after).violations == ()


def test_places_on_a_way_are_found_in_their_order() -> None:
    """As by trying all of them; a place to which the way comes back is there twice."""
    rng = np.random.default_rng(7)
    for _ in range(50):
        way = rng.uniform(0.0, 9.0, (12, 2))
        places = rng.uniform(0.0, 9.0, (3, 2))
        places = np.vstack([places, places[:1]])
        gap = np.hypot(*(way[:, None] - places).T)
        best = min(
            sum(gap[i, k] for i, k in enumerate(steps))
            for steps in combinations_with_replacement(range(len(way)), len(places))
        )
        found = nearest_in_order(way, places)
        assert found == sorted(found)
        assert sum(gap[i, k] for i, k in enumerate(found)) == pytest.approx(best)


def test_a_station_is_met_each_time_that_a_tour_comes_to_it() -> None:
    way = np.array([[0, 0], [5, 0.4], [9, 0], [5, 0.1], [0, 0]], float)
    stops = np.array([[5, 0], [9, 0], [5, 0]], float)
    assert nearest_in_order(way, stops) == [1, 2, 3]
