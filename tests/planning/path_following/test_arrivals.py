"""Targets that want a heading, come to along paths."""

from __future__ import annotations

from math import pi
from typing import Any

import numpy as np
import pytest

import mrmg
from mrmg.planning import PlannerParams, plan_mission
from mrmg.planning.path_following.arrivals import with_arrivals
from mrmg.planning.path_following.band import smooth_path
from mrmg.planning.path_following.cost_map import cost_maps_of
from mrmg.planning.path_following.following import tour_path
from mrmg.planning.problem.problem import state_mission
from mrmg.scene.loading import scene_from_document
from mrmg.scene.types import Scene

QUICK = PlannerParams(improvements=0)
HEADINGS = [round(i * pi / 4.0 - 3.0, 2) for i in range(8)]


def yard(
    heading: float | None,
    *places: tuple[float, float],
    model: str = "car",
    at_goal: float | None = None,
) -> Scene:
    """Return 30 x 20 m of open ground, for a robot that ends at the last place.

    Args:
        heading: at the end [rad], None for any.
        places: of goals and of the end [m].
        model: of the robot.
        at_goal: heading at the first goal [rad].
    """
    goals: list[dict[str, Any]] = [
        {"id": f"g{i}", "circle": {"center": list(center), "radius": 0.7}}
        for i, center in enumerate(places[:-1])
    ]
    if at_goal is not None:
        goals[0]["heading"] = at_goal
    end: dict[str, Any] = {"circle": {"center": list(places[-1]), "radius": 0.4}}
    if heading is not None:
        end["heading"] = heading
    robot = {"id": "r1", "model": model, "pose": [6, 10, 0], "finish": end}
    return scene_from_document(
        {
            "format": 1,
            "name": "yard",
            "bounds": [0, 0, 30, 20],
            "goals": goals,
            "battery": {"capacity_m": 300},
            "robots": [robot],
        },
        source="yard",
    )


def cost_m(scene: Scene, arriving: bool) -> float:
    """Return the cost of the first robot's smoothed path along all its targets."""
    problem = state_mission(scene, 0, QUICK)
    targets, cost_map = problem.mission.targets, cost_maps_of(problem)[0]
    path = tour_path(problem, 0, [*range(targets.goals), int(targets.finish[0])])
    if arriving:
        path = with_arrivals(problem, 0, cost_map, path)
    return smooth_path(targets, cost_map, path)[1]


@pytest.mark.parametrize(
    ("heading", "goals", "share"),
    [
        (-2.21, ((12, 4), (20, 14)), 0.75),  # the gear changes at the goal
        (1.71, ((15, 10), (8, 12)), 0.95),  # and beyond the finish
        (-3.0, ((15, 10), (24, 10)), 0.82),
    ],
)
def test_gears_suit_the_heading(
    heading: float, goals: tuple[tuple[float, float], ...], share: float
) -> None:
    scene = yard(heading, *goals)
    assert cost_m(scene, True) < share * cost_m(scene, False)


@pytest.mark.parametrize("heading", HEADINGS)
def test_other_gears_never_cost_more(heading: float) -> None:
    scene = yard(heading, (15, 10), (24, 10))
    assert cost_m(scene, True) < 1.01 * cost_m(scene, False)


def found(scene: Scene) -> mrmg.Plan:
    """Return the scene's plan, for which no motions were searched for."""
    result = plan_mission(scene, seed=0, params=QUICK)
    assert result.plan is not None, result.reason
    assert mrmg.verify(scene, result.plan).violations == ()
    assert result.statistics["coordinated"] == 0
    return result.plan


def driven_m(plan: mrmg.Plan) -> float:
    """Return how far the only robot drives."""
    (trajectory,) = plan.trajectories
    return float(np.hypot(*np.diff(trajectory.state[:, :2], axis=0).T).sum())


@pytest.mark.parametrize("goals", [((15, 10), (24, 10)), ((12, 4), (20, 14))])
@pytest.mark.parametrize("heading", HEADINGS)
def test_final_headings_take_no_search(
    heading: float, goals: tuple[tuple[float, float], ...]
) -> None:
    """Turning round in the open takes less than half the way again."""
    easiest_J = min(found(yard(one, *goals)).cost_J for one in HEADINGS[::3])
    assert found(yard(heading, *goals)).cost_J < 1.5 * easiest_J


@pytest.mark.parametrize("model", ["car", "diffdrive"])
@pytest.mark.parametrize("heading", HEADINGS)
def test_headings_at_goals_take_no_search(heading: float, model: str) -> None:
    places = (12.0, 6.0), (18.0, 12.0), (26.0, 10.0)
    free = found(yard(0.0, *places, model=model))
    aimed = found(yard(0.0, *places, model=model, at_goal=heading))
    assert aimed.cost_J < 1.6 * free.cost_J


def with_headings(scene: Scene, heading: float, **more: float) -> Scene:
    """Return a scene whose goals all want one heading [rad]."""
    goals = [{**goal, "heading": heading, **more} for goal in scene.document["goals"]]
    return scene_from_document({**scene.document, "goals": goals}, source="yard")


@pytest.mark.parametrize("heading", HEADINGS[::3])
def test_headings_that_are_missed_are_aimed_at_better(heading: float) -> None:
    """A path that is off by more than the tolerance takes no search for motions."""
    scene = yard(None, (12.0, 6.0), (18.0, 12.0), (26.0, 10.0))
    found(with_headings(scene, heading, heading_tolerance=0.1))


@pytest.mark.parametrize(("heading", "share"), [(-0.64, 1.25), (2.5, 1.37)])
def test_cars_turn_round_over_poses_where_that_costs_less(
    heading: float, share: float
) -> None:
    """Along paths alone it takes 1.34 and 1.43 times what it does without headings."""
    scene = yard(None, (12.0, 6.0), (18.0, 12.0), (26.0, 10.0))
    aimed = with_headings(scene, heading, heading_tolerance=0.2)
    result = plan_mission(aimed, params=PlannerParams(improvements=1))
    assert result.plan is not None
    assert result.plan.cost_J < share * found(scene).cost_J


@pytest.mark.parametrize("heading", HEADINGS)
def test_a_goal_where_the_robot_ends_has_its_heading(heading: float) -> None:
    """The last of the stops at the end of the way wants none."""
    places = (22.0, 8.0), (22.0, 8.0)
    ended = found(yard(heading, *places))
    aimed = found(yard(None, *places, at_goal=heading))
    assert aimed.cost_J < 1.1 * ended.cost_J


@pytest.mark.parametrize("model", ["car", "diffdrive"])
def test_many_goals_at_one_place_have_their_headings(model: str) -> None:
    places = 6 * ((15.0, 10.0),) + ((24.0, 10.0),)
    found(with_headings(yard(0.0, *places, model=model), 1.5))


@pytest.mark.parametrize("model", ["car", "diffdrive"])
@pytest.mark.parametrize("dwell_s", [0.0, 5.0])
def test_robots_stay_and_turn_where_they_begin(model: str, dwell_s: float) -> None:
    """At a goal that they are in; a unicycle has its heading to turn to as well.

    None drives a loop for it, and none takes much longer than its way in its slower
    gear: once turned, a unicycle may well go on backwards.
    """
    scene = yard(None, (6.2, 10.0), (24.0, 10.0), model=model)
    goal = {**scene.document["goals"][0], "dwell": dwell_s}
    if model == "diffdrive":
        goal["heading"] = 2.0
    staying = scene_from_document({**scene.document, "goals": [goal]}, source="yard")
    plan, limits = found(staying), staying.robots[0].model.planned_limits
    assert driven_m(plan) < driven_m(found(scene)) + 1.5
    slowest_m_s = min(limits.v_max_m_s, -limits.v_min_m_s)
    assert plan.makespan_s < driven_m(plan) / slowest_m_s + dwell_s + 10.0
