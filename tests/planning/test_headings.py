"""Goals that are visited with a heading: planned, judged and driven."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from math import remainder, tau
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from solved import verified_plan

import mrmg
from mrmg.energy.visits import is_at
from mrmg.errors import UsageError
from mrmg.planning import PlannerParams, plan_mission, profile_params
from mrmg.plans import Plan
from mrmg.scene.loading import dump_scene, load_scene, scene_from_document
from mrmg.scene.types import Scene

MakeScene = Callable[..., Scene]
QUICK = PlannerParams(improvements=0)
PLACES = ((8, 4), (22, 4), (24, 16), (7, 16))


def hall(yard: MakeScene, seed: int, model: str, **changes: Any) -> Scene:
    """Four goals with random headings, for two robots."""
    rng = np.random.default_rng(seed)
    goals = [
        {
            "id": f"g{i}",
            "circle": {"center": list(place), "radius": 1.2},
            "heading": float(rng.uniform(-3.1, 3.1)),
            "heading_tolerance": 0.2,
        }
        for i, place in enumerate(PLACES)
    ]
    robots = [
        {"id": "r1", "model": model, "pose": [4, 10, 0]},
        {"id": "r2", "model": model, "pose": [26, 10, 3.14]},
    ]
    return yard(**{"goals": goals, "robots": robots, **changes})


def planned(scene: Scene, seed: int = 0) -> Plan:
    return verified_plan(scene, seed, QUICK)


def deviations_rad(scene: Scene, plan: Plan) -> Iterator[float]:
    """Yield how far each goal's visit is off its heading."""
    for goal in scene.goals:
        (visit,) = [item for item in plan.visits if item.target == goal.id]
        state = plan.trajectory(visit.robot).state[visit.step]
        assert goal.region.depth(state[:2])[0] >= 0.0
        assert goal.heading_rad is not None
        yield abs(remainder(state[2] - goal.heading_rad, tau))


@pytest.mark.parametrize("model", ["car", "diffdrive"])
@pytest.mark.parametrize("seed", range(3))
def test_goals_are_visited_with_their_headings(
    yard: MakeScene, model: str, seed: int
) -> None:
    scene = hall(yard, seed, model)
    assert max(deviations_rad(scene, planned(scene, seed))) <= 0.2


def test_a_robot_stays_with_the_heading(yard: MakeScene) -> None:
    dock = {
        "id": "dock",
        "circle": {"center": [20, 14], "radius": 1.0},
        "heading": -1.0,
        "dwell": 4.0,
    }
    scene = hall(yard, 0, "car", goals=[dock])
    plan = planned(scene)
    (visit,) = plan.visits
    steps = round(4.0 / plan.dt_s)
    stay = plan.trajectory(visit.robot).state[visit.step : visit.step + steps + 1]
    assert is_at(scene.goals[0], stay).all()


def test_a_heading_is_kept_where_the_mission_lies_elsewhere(yard: MakeScene) -> None:
    """Planning moves and turns the map; a fleet in the north-east shows it."""
    corner = [{"id": "r1", "model": "car", "pose": [26, 16, 3.14]}]
    scene = hall(yard, 1, "car", robots=corner)
    assert max(deviations_rad(scene, planned(scene))) <= 0.2


@pytest.mark.slow
@pytest.mark.parametrize("model", ["car", "diffdrive"])
def test_headings_are_kept_in_the_simulation(yard: MakeScene, model: str) -> None:
    scene = hall(yard, 2, model)
    plan = planned(scene)
    account = mrmg.audit(scene, plan, mrmg.execute(scene, plan))
    assert account.mission_ok, account.reasons


def test_scenes_with_headings_are_written_as_they_are_read(
    yard: MakeScene, tmp_path: Path
) -> None:
    scene = hall(yard, 0, "car")
    (tmp_path / "again.yaml").write_text(dump_scene(scene))
    again = load_scene(tmp_path / "again.yaml")
    assert again.goals == scene.goals
    assert again.digest == scene.digest


def test_the_paper_s_method_refuses_headings(yard: MakeScene) -> None:
    with pytest.raises(UsageError, match=r"goals with headings \(g0, g1, g2, g3\)"):
        plan_mission(hall(yard, 0, "car"), params=profile_params("paper"))


def test_cars_come_to_poses_that_they_find_no_motion_to_at_once() -> None:
    """A box stands between a car's start and where it must end, others on its way.

    The search for motions, which tours to a single pose begin with, fails.
    """
    ends = {
        "r0": ([17.53, 14.99], 2.87, [31.21, 9.4, -0.78]),
        "r1": ([34.62, 8.34], -2.65, [6.26, 12.3, 2.37]),
        "r2": ([27.0, 15.67], 1.29, [10.81, 15.15, -2.69]),
    }
    goals: dict[str, tuple[list[float], dict[str, float]]] = {
        "g1": ([25.8, 5.83], {"heading": -0.25}),
        "g4": ([11.87, 25.74], {}),
        "g5": ([19.16, 7.92], {}),
    }
    scene = scene_from_document(
        {
            "format": 1,
            "name": "poses",
            "bounds": [0, 0, 40, 30],
            "obstacles": [
                {
                    "id": "o1",
                    "box": {"center": [23.44, 12.28], "size": [4.21, 1.7]},
                    "height": 1.0,
                }
            ],
            "battery": {"capacity_m": 400},
            "goals": [
                {"id": name, "circle": {"center": center, "radius": 0.7}, **heading}
                for name, (center, heading) in goals.items()
            ],
            "robots": [
                {
                    "id": name,
                    "model": "car",
                    "pose": pose,
                    "finish": {
                        "circle": {"center": center, "radius": 0.4},
                        "heading": heading,
                        "heading_tolerance": 0.2,
                    },
                }
                for name, (center, heading, pose) in ends.items()
            ],
        },
        source="poses",
    )
    planned(scene)


@pytest.mark.parametrize("aside_m", [0.0, 0.1, 0.16])
def test_cars_enter_bays_beside_the_middle_of_their_finish(
    yard: MakeScene, aside_m: float
) -> None:
    """A bay 12 cm wider than the car: in the finish's own pose it has no room."""
    half = 0.5 * 1.1 + 0.06
    walls = [
        {
            "id": name,
            "box": {"center": [x, 13], "size": [1, 6]},
            "height": 1,
        }
        for name, x in (("left", 9.5 - half), ("right", 10.5 + half))
    ]
    finish = {
        "circle": {"center": [10 + aside_m, 12.5], "radius": 0.35},
        "heading": 1.5708 + 0.6 * aside_m,
        "heading_tolerance": 0.2,
    }
    robot = {"id": "r1", "model": "car", "pose": [4, 4, 0.3], "finish": finish}
    scene = yard(obstacles=walls, goals=[], robots=[robot])
    assert plan_mission(scene, params=QUICK).statistics["path_following_plans"] <= 4
    planned(scene)


def test_later_attempts_lead_along_paths_to_single_poses(yard: MakeScene) -> None:
    """The first one takes what the search finds at once: it turns far too much."""
    finish = {
        "circle": {"center": [11.75, 5.76], "radius": 0.35},
        "heading": 0.085,
        "heading_tolerance": 0.15,
    }
    robot = {"id": "r1", "model": "car", "pose": [8.71, 6.59, 0.063], "finish": finish}
    scene = yard(goals=[], robots=[robot])
    first = verified_plan(scene, 0, QUICK)
    later = verified_plan(scene, 0, PlannerParams(improvements=1))
    assert later.cost_J < 0.8 * first.cost_J


def test_planning_ends_at_once_where_there_is_too_little_room(yard: MakeScene) -> None:
    """The car's front is 1.5 m ahead of its middle, and the wall begins at x = 15."""
    wall = {"id": "wall", "box": {"center": [16, 10], "size": [2, 12]}, "height": 1}
    finish = {
        "circle": {"center": [13.53, 10], "radius": 0.1},
        "heading": 0.0,
        "heading_tolerance": 0.1,
    }
    robot = {"id": "r1", "model": "car", "pose": [4, 10, 0], "finish": finish}
    result = plan_mission(yard(obstacles=[wall], goals=[], robots=[robot]))
    assert "too little room" in result.reason
    assert result.statistics["path_following_plans"] <= 1
