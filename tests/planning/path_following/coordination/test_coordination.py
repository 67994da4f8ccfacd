"""The search over motions has room for all that it may come to."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

import mrmg
from mrmg.planning import PlannerParams
from mrmg.planning.path_following.band import Path
from mrmg.planning.path_following.coordination import coordination
from mrmg.planning.path_following.coordination.coordination import (
    coordinated,
    empty_nodes,
)
from mrmg.planning.path_following.coordination.rounds import ROUNDS
from mrmg.planning.path_following.coordination.tasks import no_path, task_of
from mrmg.planning.path_following.tracking import Motion, drive_alone
from mrmg.planning.problem._target_kernels import at_target
from mrmg.planning.problem.problem import Problem
from mrmg.scene.types import Scene

OTHERS = 6
"""To track, hold, wait, stay, visit and end."""


@pytest.mark.parametrize("model", ["car", "diffdrive", "husky"])
def test_the_table_of_cells_is_never_full(
    yard: Callable[..., Scene], state: Callable[..., Problem], model: str
) -> None:
    """A full one would be looked through for ever, as keys without nodes count, too."""
    robots = [{"id": "r", "model": model, "pose": [6, 10, 0]}]
    problem = state(yard(robots=robots), samples=50)
    for effort in ROUNDS:
        task = task_of(problem, 0, [], no_path(problem, 0), np.zeros((1, 3)), effort)
        keys = effort.most * (len(task.motion) + OTHERS)
        assert len(empty_nodes(task).table) > keys


def test_a_robot_ends_where_its_tolerances_leave_room(
    yard: Callable[..., Scene], state: Callable[..., Problem]
) -> None:
    """With the very pose that is wanted, its side would touch the wall."""
    finish = {
        "circle": {"center": [20, 10], "radius": 0.5},
        "heading": 0.0,
        "heading_tolerance": 0.2,
    }
    pose = {"id": "r", "model": "car", "pose": [6, 10, 0]}
    half_m = yard(robots=[pose]).robots[0].model.half_width_m
    wall = [[17, 10 + half_m], [23, 10 + half_m], [23, 14], [17, 14]]
    scene = yard(
        goals=[],
        robots=[{**pose, "finish": finish}],
        obstacles=[{"id": "wall", "polygon": wall}],
    )
    problem = state(scene, samples=50)
    found = coordinated(
        problem, [[0]], [no_path(problem, 0)], np.zeros(1, bool), rounds=ROUNDS[:1]
    )
    assert found
    assert at_target(problem.mission.targets, 0, found[0].state[-1])


def test_a_robot_sets_out_by_shorter_motions_where_there_is_no_room_for_longer_ones(
    yard: Callable[..., Scene],
) -> None:
    """Every motion of the first length runs into a wall; later rounds' are shorter."""
    obstacles = [
        {"id": name, "polygon": [[x, 4], [x + 0.5, 4], [x + 0.5, 16], [x, 16]]}
        for name, x in (("ahead", 12.3), ("behind", 8.4))
    ]
    scene = yard(
        goals=[{"id": "g", "circle": {"center": [10.3, 10], "radius": 0.2}}],
        robots=[{"id": "r", "model": "car", "pose": [10, 10, 0]}],
        obstacles=obstacles,
    )
    plan = mrmg.plan(scene).plan
    assert plan is not None
    assert mrmg.verify(scene, plan).ok


def test_a_robot_without_targets_makes_room(
    yard: Callable[..., Scene], state: Callable[..., Problem]
) -> None:
    poses = {"drives": [6, 10, 0], "stands": [12, 10, 0]}
    robots = [
        {"id": name, "model": "diffdrive", "pose": pose} for name, pose in poses.items()
    ]
    problem = state(yard(robots=robots), samples=50)
    paths = [no_path(problem, r) for r in range(2)]
    planning = coordination._Planning(problem, [[], []], paths, [None, None], 2000)
    away = problem.trajectory(0, np.repeat([[0.4, 0.0], [0.0, 0.0]], [20, 60], axis=0))
    motions = [Motion(away.state, away.control), None]
    found = planning.find(1, motions, np.zeros(2, bool), yielding=True)
    assert found is not None
    assert not np.isfinite(planning.conflicts(1, [motions[0], found])).any()


def test_a_motion_that_begins_anew_is_the_old_one_until_then(
    yard: Callable[..., Scene], state: Callable[..., Problem]
) -> None:
    robots = [{"id": "own", "model": "diffdrive", "pose": [6, 10, 2.0]}]
    goals = [{"id": "g", "circle": {"center": [12, 5], "radius": 1}}]
    problem = state(yard(robots=robots, goals=goals), samples=50)
    tours, paths = [[0]], [no_path(problem, 0)]
    planning = coordination._Planning(problem, tours, paths, [None], 2000)
    away = problem.trajectory(0, np.repeat([[0.2, 0.1], [-0.2, -0.1]], 10, axis=0))
    before = [Motion(away.state, away.control)]
    found = planning.find(0, before, np.zeros(1, bool), since=15)
    assert found is not None
    assert np.array_equal(found.state[:16], away.state[:16])
    assert np.hypot(*(found.state[:, :2] - (12.0, 5.0)).T).min() < 1.0


def test_no_node_is_looked_at_where_another_robot_fills_the_only_way(
    yard: Callable[..., Scene], state: Callable[..., Problem]
) -> None:
    """A search along the path, in vain, would take five times a round's nodes."""
    poses = {"own": [4, 10, 0], "other": [15, 10, 0]}
    goals = {"first": [20, 10], "second": [26, 10]}
    scene = yard(
        goals=[
            {"id": name, "circle": {"center": at, "radius": 0.5}}
            for name, at in goals.items()
        ],
        obstacles=[
            {"polygon": [[0, y], [30, y], [30, y + 9.2], [0, y + 9.2]]}
            for y in (0, 10.8)
        ],
        robots=[
            {"id": name, "model": "diffdrive", "pose": pose}
            for name, pose in poses.items()
        ],
    )
    problem = state(scene, samples=50)
    node = np.stack([np.linspace(4.0, 26.0, 23), np.full(23, 10.0)], axis=1)
    stops = {"stop": np.array([16, 22]), "target": np.array([0, 1])}
    none = {"deeper": np.zeros(2), "pause_s": np.zeros(2), "aim": np.full(2, np.nan)}
    path = Path(node, np.ones(22, np.int64), 0.0, **stops, **none)
    drives = [drive_alone(problem, 0, path), None]
    paths = [path, no_path(problem, 1)]
    planning = coordination._Planning(problem, [[0, 1], []], paths, drives, 2000)
    stands = [None, Motion(problem.start[1:2], np.zeros((0, 2)))]
    assert planning.find(0, stands, np.array([False, True])) is None
    assert planning.nodes == 1
    assert planning.find(0, stands, np.zeros(2, bool)) is not None


def test_who_finds_no_motion_with_regard_to_others_has_one_without(
    yard: Callable[..., Scene],
    state: Callable[..., Problem],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    finish = {"circle": {"center": [20, 10], "radius": 0.5}}
    poses = {"a": [4, 10, 0], "b": [8, 14, 0]}
    robots = [
        {"id": name, "model": "car", "pose": pose, "finish": finish}
        for name, pose in poses.items()
    ]
    problem = state(yard(goals=[], robots=robots), samples=50)
    paths = [no_path(problem, r) for r in range(2)]
    planning = coordination._Planning(problem, [[0], [1]], paths, [None] * 2, 2000)
    find, asked = planning.find, []

    def in_vain(r: int, motions: list[Motion | None], above: np.ndarray) -> object:
        asked.append((r, planning.round))
        return find(r, motions, above) if motions == [None] * 2 else None

    monkeypatch.setattr(planning, "find", in_vain)
    found = planning.find_alone([0, 1], [None] * 2, ROUNDS[0], np.zeros(1, bool))
    assert found is not None
    assert asked == [(0, ROUNDS[0]), (1, ROUNDS[0]), (1, ROUNDS[1])]


@pytest.mark.parametrize("model", ["car", "diffdrive", "husky"])
@pytest.mark.parametrize("aimed", [False, True])
def test_long_tours_lead_round_robots_that_stand(
    aimed: bool, model: str, yard: Callable[..., Scene]
) -> None:
    """Two that have too little charge for any goal stand in a lane that all lie behind.

    The first attempt finds it.
    """
    places = [[18, 10], [40, 12], [44, 5], [40, 34], [12, 34], [6, 28], [30, 30]]
    looks = {"heading": 2.0, "heading_tolerance": 0.3}
    goals = [
        {
            "id": f"g{i}",
            "circle": {"center": at, "radius": 0.6},
            **(looks if aimed and i % 2 else {}),
        }
        for i, at in enumerate(places)
    ]
    standing = [
        {
            "id": f"s{x}",
            "model": model,
            "pose": [x, 9, 0],
            "battery": {"capacity_m": 8},
            "finish": {"circle": {"center": [x, 9], "radius": 0.4}},
        }
        for x in (11, 25)
    ]
    scene = yard(
        bounds=[0, 0, 48, 40],
        battery={"capacity_m": 2000},
        obstacles=[
            {"polygon": [[0, 13], [34, 13], [34, 16], [0, 16]]},
            {"polygon": [[0, 0], [34, 0], [34, 4.5], [0, 4.5]]},
        ],
        goals=goals,
        robots=[{"id": "r", "model": model, "pose": [4, 9, 0]}, *standing],
    )
    params = PlannerParams(trees=1, improvements=0)
    result = mrmg.plan(scene, params=params)
    assert result.plan is not None, result.reason
    assert mrmg.verify(scene, result.plan).ok
