"""Goals, docks and starts beside walls, where robots have no room to turn round."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mrmg
from mrmg.planning import PlannerParams, plan_mission
from mrmg.planning.path_following.band import Path
from mrmg.planning.path_following.following import tour_path
from mrmg.planning.path_following.narrow_turns import turned_outside
from mrmg.planning.problem.problem import state_mission
from mrmg.scene.loading import scene_from_document
from mrmg.scene.types import Scene

FRONT_M, HALF_M = 0.55, 0.35
"""The footprint of the model diffdrive, from its reference point."""


def yard(*goals: tuple[float, float, float], **robot: Any) -> Scene:
    """Return 20 x 14 m of open ground with goals (x, y, radius)."""
    return scene_from_document(
        {
            "format": 1,
            "name": "yard",
            "bounds": [0, 0, 20, 14],
            "goals": [
                {"id": f"g{i}", "circle": {"center": [x, y], "radius": radius}}
                for i, (x, y, radius) in enumerate(goals)
            ],
            "battery": {"capacity_m": 200},
            "robots": [{"id": "r1", "model": "diffdrive", "pose": [8, 5, 0], **robot}],
        },
        source="yard",
    )


def outside(scene: Scene, passing: float = 0.0) -> tuple[Path, Path]:
    """Return the way along all goals, as the roadmap has it and as it is driven."""
    problem = state_mission(scene, 0, PlannerParams())
    path = tour_path(problem, 0, list(range(len(scene.goals))))
    return path, turned_outside(problem, 0, path, passing)


@pytest.mark.parametrize("goal", [(0.3, 7, 0.3), (0.5, 7, 0.2), (0.5, 0.5, 0.5)])
def test_goals_beside_walls_take_no_search(goal: tuple[float, float, float]) -> None:
    scene = yard(goal, (15, 10, 1))
    result = plan_mission(scene, seed=0)
    assert result.plan is not None, result.reason
    assert mrmg.verify(scene, result.plan).violations == ()
    assert result.statistics["coordinated"] == 0


def test_a_dock_is_left_and_entered_straight() -> None:
    dock = {"circle": {"center": [0.5, 3], "radius": 0.25}, "heading": 0}
    scene = yard((15, 10, 1), pose=[0.5, 3, 0], finish=dock)
    result = plan_mission(scene, seed=0)
    assert result.plan is not None, result.reason
    assert mrmg.verify(scene, result.plan).violations == ()
    assert result.statistics["coordinated"] == 0


def test_robots_turn_before_narrow_goals_and_back_in() -> None:
    before, after = outside(yard((0.5, 7, 0.3), (15, 10, 1)))
    (number,) = set(after.pivot) - {0}
    stop = after.stop[0]
    assert number < stop
    assert (after.gear[number:stop] == -1).all()
    assert (np.delete(after.gear, range(number, stop)) == 1).all()
    turning_m = np.hypot(FRONT_M, HALF_M)
    assert after.node[number, 0] >= turning_m
    assert len(after.node) == len(before.node) + 1
    assert after.node[after.stop].tolist() == before.node[before.stop].tolist()


def test_they_pass_through_such_goals_on_their_way() -> None:
    scene = yard((12, 0.6, 0.3), (18, 5, 1))
    before, passed = outside(scene, passing=0.5 * np.pi)
    assert before.stop[0] in before.pivot
    assert passed.stop[0] not in passed.pivot
    assert (passed.gear == 1).all()
    _, backed = outside(scene)
    assert (backed.gear == -1).any()


def test_those_that_cannot_drive_backwards_never_back_in() -> None:
    problem = state_mission(yard((0.5, 7, 0.3), (15, 10, 1)), 0, PlannerParams())
    path = tour_path(problem, 0, [0, 1])
    problem.mission.fleet["limit"][0, 0] = 0.0
    assert turned_outside(problem, 0, path, 0.0) is path


def test_where_there_is_room_nothing_changes() -> None:
    before, after = outside(yard((1.5, 7, 0.5), (15, 10, 1)))
    assert after is before


def test_a_robot_that_cannot_turn_where_it_starts_drives_out_first() -> None:
    _, after = outside(yard((0.8, 13, 0.5), (15, 10, 1), pose=[0.5, 3, 0]))
    assert 0 not in after.pivot
    assert 1 in after.pivot
    assert after.node[1, 1] == pytest.approx(3.0)
    assert after.node[1, 0] >= np.hypot(FRONT_M, HALF_M)
