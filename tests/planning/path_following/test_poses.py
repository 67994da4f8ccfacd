"""Ways over poses, for robots that have to turn among obstacles."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from math import pi
from typing import Any

import numpy as np
import pytest
from shapely import affinity
from shapely.geometry import Point, Polygon, box
from shapely.ops import unary_union

import mrmg
from mrmg.planning import PlannerParams, plan_mission
from mrmg.planning.path_following import _pose_kernels, poses
from mrmg.planning.path_following.band import Path
from mrmg.planning.path_following.coordination.fields import Fields
from mrmg.planning.path_following.cost_map import cost_maps_of
from mrmg.planning.path_following.poses import HEADINGS, posed
from mrmg.planning.problem.problem import Problem, state_mission
from mrmg.scene.loading import scene_from_document
from mrmg.scene.types import Scene

QUICK = PlannerParams(improvements=0)
NEVER = np.zeros(1, bool)
AISLE = [("low", [10, 4], [7, 1]), ("high", [10, 8], [7, 1])]
"""Racks beside an aisle in which a car cannot turn round: middles and sizes [m]."""

BAY = [("low", [11, 5.125], [3, 0.5]), ("high", [11, 6.875], [3, 0.5])]
"""Walls beside a bay that is 15 cm wider than a car."""

OPPOSITE = ((10.0, 5.3), (10.5, 6.7))
"""Places of goals beside the two racks."""

BESIDE = (*OPPOSITE, (15.2, 6.0), (9.0, 2.7), (11.0, 9.3))
"""Places of goals on both sides of both racks, and beside a wall."""


def hall(
    *places: tuple[float, float],
    pose: tuple[float, float, float] = (3.0, 6.0, 0.0),
    finish: dict[str, Any] | None = None,
    model: str = "car",
    walls: list[tuple[str, list[float], list[float]]] = AISLE,
    margin_m: float = 0.25,
    radius_m: float = 0.3,
) -> Scene:
    """Return a hall of 16 x 12 m with two racks, and goals for one robot.

    Args:
        places: of goals [m].
        pose: of the robot.
        finish: where it must end.
        model: of the robot.
        walls: name, middle and size of each rack [m].
        margin_m: that the robot keeps from them.
        radius_m: of goals.
    """
    robot: dict[str, Any] = {"id": "r", "model": model, "pose": list(pose)}
    if finish:
        robot["finish"] = finish
    return scene_from_document(
        {
            "format": 1,
            "name": "hall",
            "bounds": [0, 0, 16, 12],
            "obstacles": [
                {"id": name, "box": {"center": at, "size": size}, "height": 1.8}
                for name, at, size in walls
            ],
            "margins": {"obstacle": margin_m},
            "goals": [
                {"id": f"g{i}", "circle": {"center": list(at), "radius": radius_m}}
                for i, at in enumerate(places)
            ],
            "battery": {"capacity_m": 300},
            "robots": [robot],
        },
        source="hall",
    )


def with_steering_rate(scene: Scene, rate: float) -> Scene:
    """Return a scene whose only robot steers no faster than that [rad/s]."""
    (robot,) = scene.robots
    model = replace(robot.model, limits=replace(robot.model.limits, u2_max=rate))
    return replace(scene, robots=(replace(robot, model=model),))


def stated(scene: Scene) -> tuple[Problem, list[int]]:
    """Return the problem of a scene, and its targets in their order."""
    problem = state_mission(scene, 0, QUICK)
    targets = problem.mission.targets
    ends = [int(t) for t in targets.finish if t >= 0]
    return problem, [*range(targets.goals), *ends]


def way_of(scene: Scene) -> tuple[Problem, Path]:
    """Return the problem of a scene, and a way over poses through its targets."""
    problem, tour = stated(scene)
    task = posed(problem, 0, cost_maps_of(problem)[0], tour, NEVER)
    assert task is not None
    return problem, task.path


@contextmanager
def recorded() -> Iterator[list[tuple[np.ndarray, float]]]:
    """Yield a list that receives poses as they are found, and the cost of their way."""
    original, found = _pose_kernels.poses_to, list[tuple[np.ndarray, float]]()

    def poses_to(search: Any, poses: np.ndarray, last: int) -> Any:
        pose, stop, kept = original(search, poses, last)
        found.append((pose, float(poses["cost"][last])))
        return pose, stop, kept

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(_pose_kernels, "poses_to", poses_to)
        yield found


def headings(path: Path) -> np.ndarray:
    """Return the heading half way along each segment of a path [rad]."""
    chord = np.diff(path.node, axis=0) * path.gear[:, None]
    return np.arctan2(chord[:, 1], chord[:, 0])


def free_ground(scene: Scene) -> Polygon:
    """Return the ground of a scene without its obstacles."""
    racks = unary_union([one.shape for one in scene.barriers])
    return box(0, 0, 16, 12).difference(racks)


DOCK = (0.56, 6.0, 0.0)
"""A pose with the back to a wall."""

DOCKED = {"circle": {"center": list(DOCK[:2]), "radius": 0.25}, "heading": DOCK[2]}

MISSIONS = [
    hall(*OPPOSITE),
    hall(*OPPOSITE[::-1], pose=(3.0, 2.0, pi)),
    hall((10.0, 5.3), pose=DOCK, finish=DOCKED),
]

OF_TURNERS = [
    hall((10.0, 5.0), (10.5, 7.0), model="diffdrive"),
    hall((13.0, 5.0), pose=DOCK, finish=DOCKED, model="diffdrive"),
]
"""Missions of a robot that turns on the spot, though not where its goals are."""


BAYED = [
    hall(
        pose=(3.0, 2.5, 2.06),
        finish={
            "circle": {"center": [11.0, 6.1], "radius": 0.35},
            "heading": heading,
            "heading_tolerance": 0.2,
        },
        model=model,
        walls=BAY,
        margin_m=0.03,
    )
    for model, heading in (("car", 0.1), ("car", pi - 0.1), ("diffdrive", 0.1))
]
"""Missions that end in a bay, beside the middle and the heading of the finish."""


NOSED = [
    hall(
        (10.0, 5.3),
        finish={"circle": {"center": [x, 6.0], "radius": 0.25}, "heading": heading},
    )
    for x, heading in ((14.35, 0.0), (14.28, 0.5))
]
"""Missions that end nose to a wall, where a car has room in a small part of a finish.
"""

TINY = hall((10.0, 5.1), (10.5, 6.9), model="diffdrive", radius_m=0.06)
"""A mission whose goals are hardly wider than targets are deep."""


@pytest.mark.parametrize("scene", [*MISSIONS, *OF_TURNERS, *BAYED, *NOSED, TINY])
def test_ways_keep_clear(scene: Scene) -> None:
    """Every footprint along a way, turns included, lies in free ground, by shapely."""
    _, path = way_of(scene)
    footprint, free = Polygon(scene.robots[0].model.footprint_m), free_ground(scene)
    middles = 0.5 * (path.node[1:] + path.node[:-1])
    poses = [*zip(middles, headings(path), strict=True)]
    for pivot in path.pivot[path.pivot < len(path.gear)]:
        before = headings(path)[pivot - 1] if pivot > 0 else path.heading
        swing = (headings(path)[pivot] - before + pi) % (2.0 * pi) - pi
        poses += [(path.node[pivot], before + t * swing) for t in np.linspace(0, 1, 9)]
    for (x, y), angle in poses:
        turned = affinity.rotate(footprint, angle, (0, 0), use_radians=True)
        assert free.contains(affinity.translate(turned, x, y))


@pytest.mark.parametrize("scene", OF_TURNERS)
def test_robots_that_turn_on_the_spot_drive_straight_between(scene: Scene) -> None:
    """Headings differ only where a way has a turn on the spot or changes gear."""
    _, path = way_of(scene)
    angle = np.array([path.heading, *headings(path)])
    turn = np.abs((np.diff(angle) + pi) % (2.0 * pi) - pi)
    assert set(np.flatnonzero(turn > 1e-6)) <= set(path.pivot)
    assert len(path.pivot) > 0


def test_robots_that_cannot_back_never_do() -> None:
    """Without a gear to back in, a robot leaves a goal beside a rack forwards."""
    problem, tour = stated(hall((10.0, 5.1), (3.0, 6.0), model="diffdrive"))
    cost_map = cost_maps_of(problem)[0]
    backed = posed(problem, 0, cost_map, tour, NEVER)
    assert backed is not None
    assert (backed.path.gear == -1).any()
    problem.mission.fleet["limit"][0, 0] = 0.0
    with recorded() as found:
        ahead_alone = posed(problem, 0, cost_map, tour, NEVER)
    assert ahead_alone is not None
    assert (ahead_alone.path.gear == 1).all()
    pose, _ = found[0]
    ahead = np.stack([np.cos(pose[:-1, 2]), np.sin(pose[:-1, 2])], axis=1)
    assert ((np.diff(pose[:, :2], axis=0) * ahead).sum(axis=1) > -1e-9).all()


@pytest.mark.parametrize("scene", MISSIONS)
def test_ways_turn_as_cars_do(scene: Scene) -> None:
    """No turn is sharper than the car's least radius, and none is on the spot."""
    problem, path = way_of(scene)
    radius_m = float(problem.mission.fleet[0]["turning_radius"])
    angle = np.array([path.heading, *headings(path)])
    turn = np.abs((np.diff(angle) + pi) % (2.0 * pi) - pi)
    size = np.hypot(*np.diff(path.node, axis=0).T)
    between = 0.5 * (size + np.concatenate([[0.0], size[:-1]]))
    assert (turn <= between / radius_m + 1e-6).all()


@pytest.mark.parametrize("scene", [*MISSIONS, *OF_TURNERS, *BAYED, *NOSED, TINY])
def test_ways_visit_targets_in_order(scene: Scene) -> None:
    """The nodes at stops lie in the targets' regions, and the last one ends the way."""
    problem, path = way_of(scene)
    places = [*scene.targets(), *[r.finish for r in scene.robots if r.finish]]
    assert (np.diff(path.stop) >= 0).all()
    assert path.stop[-1] == len(path.node) - 1
    for node, target in zip(path.stop, path.target, strict=True):
        assert places[target].region.shape.contains(Point(path.node[node]))
    assert np.allclose(path.node[0], problem.start[0, :2])


@pytest.mark.parametrize("scene", BAYED[:2])
def test_ways_go_straight_into_bays(scene: Scene) -> None:
    """Cars go straight from a metre before the end that leads reaches the mouth."""
    _, path = way_of(scene)
    ahead = scene.robots[0].model.footprint_m[:, 0] * path.gear[-1]
    near = path.node[:-1, 0] > 9.5 - ahead.max() - 1.0
    assert np.ptp(headings(path)[near]) < 0.01


def test_shortening_gains_and_keeps_stops() -> None:
    """Chains of shortest curves are shorter than the arcs that were found."""
    ways_m, arcs_m = 0.0, 0.0
    for scene in MISSIONS:
        with recorded() as found:
            _, path = way_of(scene)
        pose, _ = found[0]
        ways_m += path.way[-1]
        arcs_m += float(np.hypot(*np.diff(pose[:, :2], axis=0).T).sum())
        assert np.allclose(path.node[-1], pose[-1, :2], atol=1e-3)
        assert len(stated(scene)[1]) == len(path.stop)
    assert ways_m < 0.97 * arcs_m


def test_ways_are_cheaper_where_there_is_time() -> None:
    """Between goals on both sides of an aisle, ways that have time cost less."""
    problem, tour = stated(hall(*((x, y) for x in (8.0, 10.0) for y in (5.25, 6.75))))
    cost_map = cost_maps_of(problem)[0]
    with recorded() as found:
        assert posed(problem, 0, cost_map, tour, NEVER, soon=True) is not None
        assert posed(problem, 0, cost_map, tour, NEVER) is not None
    (_, soon_m), (_, cheap_m) = found
    assert cheap_m < 0.95 * soon_m


def test_long_tours_take_poses_by_the_target(monkeypatch: pytest.MonkeyPatch) -> None:
    """Twice as many targets take about twice as many poses, and no more."""
    looked_at = []
    original = _pose_kernels.find_poses

    def find_poses(search: Any, poses: np.ndarray, table: np.ndarray) -> int:
        poses["cost"] = -1.0
        last = original(search, poses, table)
        looked_at.append(int((poses["cost"] >= 0.0).sum()))
        return int(last)

    monkeypatch.setattr(_pose_kernels, "find_poses", find_poses)
    for rounds in (1, 2):
        way_of(hall(*rounds * BESIDE))
    assert looked_at[1] < 3 * looked_at[0]


@pytest.mark.parametrize("scene", [MISSIONS[0], *OF_TURNERS, *BAYED, *NOSED])
def test_driving_needs_no_smoothing(scene: Scene) -> None:
    """A way is driven as it is, to all of its targets."""
    problem, tour = stated(scene)
    task = posed(problem, 0, cost_maps_of(problem)[0], tour, NEVER)
    assert task is not None
    assert task.before is not None
    assert task.before.arrived


def test_cost_to_go_reaches_robots_beside_walls() -> None:
    """A car with its back to a wall has a way to its targets."""
    problem, tour = stated(hall((10.0, 5.3), pose=DOCK))
    field = Fields(problem).static(0, tour)
    column, row = (
        int((value - corner) // field.cell)
        for value, corner in zip(
            problem.start[0, :2], (field.x_min, field.y_min), strict=True
        )
    )
    assert np.isfinite(field.field[0, 0, row, column])


def test_searches_end_when_told() -> None:
    """A search that is halted finds nothing."""
    problem, tour = stated(MISSIONS[0])
    cost_map = cost_maps_of(problem)[0]
    assert posed(problem, 0, cost_map, tour, np.ones(1, bool)) is None


def test_searches_end_without_room(monkeypatch: pytest.MonkeyPatch) -> None:
    """A search that has no more room for poses finds nothing."""
    problem, tour = stated(MISSIONS[0])
    monkeypatch.setattr(poses, "MOST_POSES", 100)
    assert posed(problem, 0, cost_maps_of(problem)[0], tour, NEVER) is None


def test_headings_that_targets_want_are_kept() -> None:
    """A way ends within a step of headings of what a finish wants."""
    scene = MISSIONS[2]
    _, path = way_of(scene)
    last = headings(path)[-1]
    assert abs((last + pi) % (2.0 * pi) - pi) < 2.0 * pi / HEADINGS


@pytest.mark.parametrize(
    "scene", [*MISSIONS, hall(*BESIDE), hall(*BESIDE, pose=DOCK, finish=DOCKED)]
)
def test_robots_get_through_halls(scene: Scene) -> None:
    """Missions in halls have plans that the verifier accepts.

    The last two have none by smoothed paths and the search for motions alone.
    """
    result = plan_mission(scene, params=QUICK)
    assert result.plan is not None, result.reason
    assert mrmg.verify(scene, result.plan).ok


@pytest.mark.parametrize(
    ("scene", "rate"),
    [
        (hall(*OPPOSITE), 0.3),
        (hall(*OPPOSITE[::-1], pose=(3.0, 2.0, pi)), 0.2),
        (hall(*BESIDE), 0.2),
    ],
)
def test_cars_that_steer_slowly_get_through_halls(scene: Scene, rate: float) -> None:
    """They need no search for motions: that found worse plans, if any."""
    scene = with_steering_rate(scene, rate)
    result = plan_mission(scene, params=QUICK)
    assert result.plan is not None, result.reason
    assert mrmg.verify(scene, result.plan).ok
    assert result.statistics["coordinated"] == 0


def test_ways_that_cannot_be_driven_are_smoothed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Smoothing helps a car that steers slowly where stops do not."""
    scene = hall(*OPPOSITE[::-1], pose=(3.0, 2.0, pi))
    scene = with_steering_rate(scene, 0.25)
    monkeypatch.setattr(poses, "JUMP_SHARE", np.inf)
    problem, tour = stated(scene)
    task = posed(problem, 0, cost_maps_of(problem)[0], tour, NEVER)
    assert task is not None
    assert task.before is None
    result = plan_mission(scene, params=QUICK)
    assert result.plan is not None, result.reason
    assert result.statistics["coordinated"] == 0


@pytest.mark.parametrize("scene", OF_TURNERS)
def test_robots_that_turn_on_the_spot_need_no_search(scene: Scene) -> None:
    """Goals beside racks and docks beside walls take no search for motions."""
    result = plan_mission(scene, params=QUICK)
    assert result.plan is not None, result.reason
    assert mrmg.verify(scene, result.plan).ok
    assert result.statistics["coordinated"] == 0
