"""Proofs of infeasibility: closed-form cases, and never against what can be done."""

from __future__ import annotations

import heapq
import re
from collections.abc import Callable
from dataclasses import replace
from math import hypot, pi, sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely

import mrmg
from mrmg.energy.metering import find_visits, plan_ledger
from mrmg.planning.feasibility import (
    impossible_goals,
    mission_warnings,
    proof_of_infeasibility,
)
from mrmg.planning.path_bounds import Walls, shortest_way_m
from mrmg.plans import Plan, Trajectory
from mrmg.scene.types import Scene
from mrmg.shipped import scene_names

SCENES = Path(__file__).parents[1] / "scenes"
CAR_WIDTH_M = 1.1
NOTHING = Walls.of(shapely.MultiPolygon())

MakeScene = Callable[..., Scene]


def circle(name: str, x: float, y: float, radius: float = 1.0) -> dict[str, Any]:
    return {"id": name, "circle": {"center": [x, y], "radius": radius}}


def car(name: str, x: float, y: float, yaw: float = 0.0, **more: Any) -> dict[str, Any]:
    return {"id": name, "model": "car", "pose": [x, y, yaw], **more}


def wall_with_gap(gap_m: float, **more: Any) -> list[dict[str, Any]]:
    """Return a wall across the yard at x = 15 with a gap about y = 10."""
    size = 0.5 * (20.0 - gap_m)
    return [
        {
            "id": name,
            "box": {"center": [15, y], "size": [0.4, size]},
            "height": 1,
            **more,
        }
        for name, y in (("south", 0.5 * size), ("north", 20.0 - 0.5 * size))
    ]


# --- goals cut off -----------------------------------------------------------------


RING = {
    "id": "ring",
    "polygon": [[12, 5], [20, 5], [20, 15], [12, 15]],
    "holes": [[[13, 6], [19, 6], [19, 14], [13, 14]]],
    "height": 1,
}


def test_a_goal_inside_a_ring_is_unreachable_and_named(yard: MakeScene) -> None:
    goals = [circle("free", 26, 10), circle("caged", 16, 10)]
    proof = proof_of_infeasibility(yard(obstacles=[RING], goals=goals))
    assert proof is not None
    assert "caged" in proof
    assert "unreachable" in proof


def test_a_goal_that_reaches_out_of_its_ring_is_reachable(yard: MakeScene) -> None:
    goals = [circle("wide", 16, 10, radius=5.5)]
    assert proof_of_infeasibility(yard(obstacles=[RING], goals=goals)) is None


def test_a_robot_inside_the_ring_can_serve_it(yard: MakeScene) -> None:
    goals = [circle("caged", 16, 12), circle("free", 26, 10)]
    robots = [car("in", 15, 8), car("out", 4, 10)]
    assert (
        proof_of_infeasibility(yard(obstacles=[RING], goals=goals, robots=robots))
        is None
    )


@pytest.mark.parametrize("gap_m", [0.2, 0.8, 0.9 * CAR_WIDTH_M])
def test_no_way_leads_through_a_gap_narrower_than_the_car(
    yard: MakeScene, gap_m: float
) -> None:
    assert "unreachable" in (
        proof_of_infeasibility(yard(obstacles=wall_with_gap(gap_m))) or ""
    )


@pytest.mark.parametrize(
    ("gap_m", "said"), [(0.2, "0.20 m wide near (15.0, 10.0)"), (0.004, "none at all")]
)
def test_the_widest_gap_is_named_unless_it_is_a_crack(
    yard: MakeScene, gap_m: float, said: str
) -> None:
    proof = proof_of_infeasibility(yard(obstacles=wall_with_gap(gap_m)))
    assert said in (proof or "")


@pytest.mark.parametrize("gap_m", [CAR_WIDTH_M, 1.02 * CAR_WIDTH_M, 2.0])
def test_nothing_is_proven_of_a_gap_as_wide_as_the_car(
    yard: MakeScene, gap_m: float
) -> None:
    assert proof_of_infeasibility(yard(obstacles=wall_with_gap(gap_m))) is None


def test_a_wall_for_one_robot_leaves_the_goal_to_the_other(yard: MakeScene) -> None:
    robots = [car("r1", 4, 6), car("r2", 4, 14)]
    for blocks, provable in ((["r1"], False), (["r1", "r2"], True), (None, True)):
        more = {} if blocks is None else {"blocks": blocks}
        scene = yard(obstacles=wall_with_gap(0.2, **more), robots=robots)
        assert (proof_of_infeasibility(scene) is not None) is provable


def test_walls_may_add_up_only_for_the_robots_they_stop(yard: MakeScene) -> None:
    """Each half of a wall stops another robot: both get past."""
    halves = wall_with_gap(0.2)
    halves[0]["blocks"], halves[1]["blocks"] = ["r1"], ["r2"]
    robots = [car("r1", 4, 6), car("r2", 4, 14)]
    assert proof_of_infeasibility(yard(obstacles=halves, robots=robots)) is None


def test_a_goal_only_the_rear_axle_can_enter_is_reachable(yard: MakeScene) -> None:
    """Backed up to the wall, the axle is nearer to it than any disc's centre."""
    goals = [circle("rear", 0.35, 10, radius=0.1)]
    assert proof_of_infeasibility(yard(goals=goals)) is None


# --- no room for the body -----------------------------------------------------------


def beside_a_wall(heading: float, tolerance: float = 0.1) -> dict[str, Any]:
    """Return a place whose middle is 0.7 m from the wall at x = 15, gap elsewhere."""
    return {
        "circle": {"center": [14.1, 4], "radius": 0.1},
        "heading": heading,
        "heading_tolerance": tolerance,
    }


@pytest.mark.parametrize(
    ("heading", "tolerance", "provable"),
    [(0.0, 0.1, True), (pi / 2, 0.1, False), (pi, 0.1, False), (0.0, 3.0, False)],
)
def test_a_body_must_fit_where_it_stops(
    yard: MakeScene, heading: float, tolerance: float, provable: bool
) -> None:
    """Nose first, a car whose front is 1.5 m ahead of its middle meets the wall."""
    place = beside_a_wall(heading, tolerance)
    wall = wall_with_gap(3.0)
    finish = yard(obstacles=wall, robots=[car("r1", 4, 10, finish=place)])
    goal = yard(obstacles=wall, goals=[{"id": "dock", **place}])
    for scene, name in ((finish, "the finish of r1"), (goal, "goal dock")):
        proof = proof_of_infeasibility(scene)
        assert (proof is not None) is provable
        assert proof is None or name in proof
        assert proof is None or "with the heading wanted there" in proof


def test_a_place_is_for_whoever_has_room_there(yard: MakeScene) -> None:
    goals = [{"id": "dock", **beside_a_wall(0.0)}]
    robots = [car("r1", 4, 6), {"id": "r2", "model": "diffdrive", "pose": [4, 14, 0]}]
    scene = yard(obstacles=wall_with_gap(3.0), goals=goals, robots=robots)
    assert proof_of_infeasibility(scene) is None
    assert list(impossible_goals(yard(obstacles=wall_with_gap(3.0), goals=goals)))


# --- goals out of energy's reach ----------------------------------------------------


def long_scene(
    yard: MakeScene, capacity_m: float, stations: list[dict[str, Any]], **more: Any
) -> Scene:
    """Return a straight lane: start at x = 4, goal's edge at x = 104."""
    return yard(
        bounds=[0, 0, 120, 20],
        goals=[circle("far", 105, 10)],
        stations=stations,
        battery={"capacity_m": capacity_m, "reserve": 0.1},
        **more,
    )


@pytest.mark.parametrize(
    ("capacity_m", "stations", "start", "provable"),
    [
        # 100 m to go on 0.9 of the battery
        (110.0, [], 1.0, True),
        (112.0, [], 1.0, False),
        (112.0, [], 0.95, True),
        # a station of 49 m to go to and 49 m to go on from
        (54.0, [circle("mid", 54, 10)], 1.0, True),
        (55.0, [circle("mid", 54, 10)], 1.0, False),
        # the second leg is too long; a second station helps
        (52.0, [circle("early", 34, 10)], 1.0, True),
        (52.0, [circle("early", 34, 10), circle("late", 70, 10)], 1.0, False),
        # the station itself cannot be reached at first
        (60.0, [circle("mid", 54, 10)], 0.5, True),
    ],
)
def test_energy_decides_to_the_metre_on_a_straight_lane(
    yard: MakeScene,
    capacity_m: float,
    stations: list[dict[str, Any]],
    start: float,
    provable: bool,
) -> None:
    robots = [car("r1", 4, 10, start_energy=start)]
    scene = long_scene(yard, capacity_m, stations, robots=robots)
    proof = proof_of_infeasibility(scene)
    assert (proof is not None) is provable
    if proof is not None:
        assert "far" in proof


def test_what_consumers_draw_on_the_way_is_energy_too(yard: MakeScene) -> None:
    """With half as much again as the ground takes, a battery reaches two thirds."""
    for capacity_m, provable in ((1.5 * 110.0, True), (1.5 * 112.0, False)):
        scene = long_scene(yard, capacity_m, [])
        (robot,) = scene.robots
        plain_J_per_m = robot.model.energy_model.plain_ground_J_per_m()
        drawn_W = 0.5 * plain_J_per_m * robot.model.top_speed_m_s
        model = replace(robot.model, idle_power_W=drawn_W)
        drawing = replace(scene, robots=(replace(robot, model=model),))
        assert (proof_of_infeasibility(drawing) is not None) is provable


def test_the_missing_energy_is_that_of_the_missing_way(yard: MakeScene) -> None:
    scene = long_scene(yard, 100.0, [])
    joules = scene.robots[0].model.energy_model.plain_ground_J_per_m()
    proof = proof_of_infeasibility(scene)
    assert proof is not None
    assert f"at least {10.0 * joules:.0f} J" in proof


def test_all_goals_out_of_reach_are_named_with_what_is_missing(
    yard: MakeScene,
) -> None:
    goals = [circle("near", 20, 10), circle("far", 105, 10), circle("further", 115, 10)]
    scene = yard(bounds=[0, 0, 120, 20], goals=goals, battery={"capacity_m": 90})
    proof = str(proof_of_infeasibility(scene))
    joules = scene.robots[0].model.energy_model.plain_ground_J_per_m()
    usable_m = 90.0 * (1.0 - scene.robots[0].battery.reserve_fraction)
    first, others = proof.split("; ")
    assert first.startswith("goal far is out of energy's reach")
    missing = [100.0 - usable_m, 110.0 - usable_m]
    for text, missing_m in zip((first, others), missing, strict=True):
        found = re.search(r"(\d+) J \((.*) m of plain ground\)", text)
        assert found is not None
        assert float(found[1]) == pytest.approx(missing_m * joules, rel=1e-3)
        assert float(found[2]) == pytest.approx(missing_m, abs=0.06)
    assert others.startswith("likewise further by ")


def test_climbing_counts_and_rolling_down_is_paid_back(yard: MakeScene) -> None:
    """100 m of plain ground; 3 m of height are worth 50 m of it."""
    rising, falling = ({"grid": [[a, b]] * 2} for a, b in ((0, 3.6), (3.6, 0)))
    climb_m = 100.0 / 120.0 * 3.6 / 0.06
    assert proof_of_infeasibility(long_scene(yard, 120.0, [])) is None
    proof = proof_of_infeasibility(long_scene(yard, 120.0, [], elevation=rising))
    assert proof is not None
    assert "far is out of energy's reach" in proof
    for elevation, needed_m in (
        (rising, (100.0 + climb_m) / 0.9),
        (falling, (100.0 - climb_m) / 0.9),
    ):
        rich, poor = (
            long_scene(yard, needed_m + more_m, [], elevation=elevation)
            for more_m in (2.0, -3.0)
        )
        assert proof_of_infeasibility(rich) is None
        assert proof_of_infeasibility(poor) is not None


def test_easy_ground_anywhere_weakens_the_bound(yard: MakeScene) -> None:
    """Ground of multiplier 0.8 might lie on the way: 100 m may cost as little as 80."""
    area = {
        "id": "ice",
        "box": {"center": [60, 2], "size": [4, 2]},
        "multiplier": 0.8,
    }
    assert proof_of_infeasibility(long_scene(yard, 90.0, [], terrain=[area])) is None
    assert proof_of_infeasibility(long_scene(yard, 88.0, [], terrain=[area]))
    mud = {**area, "multiplier": 5.0}
    assert proof_of_infeasibility(long_scene(yard, 112.0, [], terrain=[mud])) is None


def test_one_robot_in_reach_is_enough(yard: MakeScene) -> None:
    robots = [car("r1", 4, 6), car("r2", 80, 14)]
    assert proof_of_infeasibility(long_scene(yard, 60.0, [], robots=robots)) is None
    assert proof_of_infeasibility(long_scene(yard, 60.0, [], robots=robots[:1]))


def test_a_detour_counts(yard: MakeScene) -> None:
    """A wall up to y = 19.9 forces the way over its top (its corners at x 60)."""
    wall = [{"id": "w", "box": {"center": [60, 9.5], "size": [2, 19]}, "height": 1}]
    stretched = {"bounds": [0, 0, 120, 40], "obstacles": wall}
    over = hypot(55, 9) + 2.0 + hypot(44, 9) - 1.0
    for capacity_m, provable in (((over - 1) / 0.9, True), ((over + 1) / 0.9, False)):
        scene = yard(
            **stretched,
            goals=[circle("far", 105, 10)],
            battery={"capacity_m": capacity_m, "reserve": 0.1},
        )
        assert (proof_of_infeasibility(scene) is not None) is provable


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=[pytest.mark.slow] if "scene6" in name else [])
        for name in scene_names()
    ],
)
def test_nothing_is_proven_of_shipped_scenes(name: str) -> None:
    assert proof_of_infeasibility(mrmg.load_scene(name)) is None


@pytest.mark.parametrize("path", sorted(SCENES.glob("*.yaml")), ids=lambda p: p.stem)
def test_of_the_edge_scenes_two_are_proven_infeasible(path: Path) -> None:
    proof = proof_of_infeasibility(mrmg.load_scene(path))
    words = {"goal_enclosed": "unreachable", "goal_out_of_energy": "out of energy"}
    if path.stem in words:
        assert proof is not None
        assert words[path.stem] in proof
    else:
        assert proof is None


def test_a_robot_may_pass_through_a_station_at_speed(yard: MakeScene) -> None:
    """It rolls out over the last metres: 4 m for nothing, and a valid plan."""
    usable_m = 67.8
    early = [circle("early", 34, 10)]
    robots = [car("r1", 4, 10)]
    scene = long_scene(yard, usable_m / 0.9, early, robots=robots)
    robot = scene.robots[0]
    rolling_m_s2 = robot.model.energy_model.rolling_force_N
    rolling_m_s2 /= robot.model.effective_mass_kg
    control = np.zeros((700, 2))
    state = np.zeros((len(control) + 1, 5))
    state[0, :2] = 4, 10
    for k in range(len(control)):
        left_m, speed_m_s = 104.0 - state[k, 0], state[k, 3]
        rolls_out = left_m <= speed_m_s**2 / (2.0 * rolling_m_s2)
        change = -rolling_m_s2 if rolls_out else 1.5
        control[k, 0] = 10.0 * (np.clip(speed_m_s + 0.1 * change, 0, 2) - speed_m_s)
        state[k + 1] = state[k]
        state[k + 1, 3] += 0.1 * control[k, 0]
        state[k + 1, 0] += 0.05 * (state[k, 3] + state[k + 1, 3])
    trajectory = Trajectory(robot="r1", dt_s=0.1, state=state, control=control)
    visits = find_visits(scene, trajectory, ("early", "far"))
    plan = Plan(
        scene_name=scene.name,
        scene_digest=scene.digest,
        seed=0,
        profile="",
        parameters_digest="",
        versions={},
        dt_s=0.1,
        trajectories=(trajectory,),
        tours={"r1": ("early", "far")},
        visits=visits,
        ledger=plan_ledger(scene, [trajectory], visits),
    )
    assert [one.message for one in mrmg.verify(scene, plan).violations] == []
    assert proof_of_infeasibility(scene) is None


# --- warnings before anything is planned ---------------------------------------------


def test_a_goal_that_no_battery_reaches_is_warned_of_with_what_is_missing(
    yard: MakeScene,
) -> None:
    scene = long_scene(yard, 100.0, [])
    (warning,) = mission_warnings(scene)
    assert warning == proof_of_infeasibility(scene)
    assert "(10.0 m of plain ground)" in warning
    assert mission_warnings(long_scene(yard, 112.0, [])) == []


def test_a_goal_that_a_wall_runs_through_is_reached_beside_it(yard: MakeScene) -> None:
    """No corner of the wall is on the way, though it cuts the straight line."""
    scene = yard(
        bounds=[0, 0, 60, 20],
        obstacles=[{"id": "wall", "box": {"center": [30, 10], "size": [60, 0.6]}}],
        goals=[circle("g", 30, 10, 3.0)],
        robots=[car("r1", 10, 11.5)],
        battery={"capacity_m": 30},
    )
    assert mission_warnings(scene) == []
    assert impossible_goals(scene) == {}
    assert proof_of_infeasibility(scene) is None


def test_one_robots_battery_is_warned_of_by_name(yard: MakeScene) -> None:
    robots = [car("r1", 4, 6), car("r2", 80, 14)]
    (warning,) = mission_warnings(long_scene(yard, 60.0, [], robots=robots))
    assert warning.startswith("r1 cannot reach far with its battery")


@pytest.mark.parametrize("name", ["quickstart", "scene1", "mixed", "hills", "scene4"])
def test_shipped_scenes_give_no_warnings(name: str) -> None:
    assert mission_warnings(mrmg.load_scene(name)) == []


def test_missions_are_warned_of_all_that_is_cut_off(yard: MakeScene) -> None:
    goals = [circle("free", 26, 10), circle("caged", 16, 10)]
    robots = [car("r1", 4, 10, **finish(16, 10))]
    scene = yard(obstacles=[RING], goals=goals, robots=robots)
    cut_off, finishes = mission_warnings(scene)
    assert "caged is unreachable" in cut_off
    assert "finish of r1 is unreachable" in finishes
    assert mission_warnings(yard(robots=[])) == []


# --- shortest ways -----------------------------------------------------------------


def test_with_nothing_in_the_way_it_is_the_distance() -> None:
    a, b = shapely.Point(0, 0), shapely.Point(3, 4).buffer(1.0)
    assert shortest_way_m(a, b, NOTHING) == pytest.approx(4.0, abs=0.01)
    assert shortest_way_m(a, b, Walls.of(shapely.box(5, 5, 6, 6))) == a.distance(b)
    assert shortest_way_m(b, b, NOTHING) == 0.0


SQUARE = shapely.box(-1, -1, 1, 1)
GAP = shapely.union_all([shapely.box(0, -50, 1, 9), shapely.box(0, 11, 1, 50)])
TOUCHING = shapely.union_all([shapely.box(0, -3, 1, 0), shapely.box(0, 0, 1, 2)])
DISC = shapely.Point(0, 0).buffer(1.0, quad_segs=64)


@pytest.mark.parametrize(
    ("start", "end", "blocked", "exact_m"),
    [
        ((-2, 0.5), (0.5, 1.5), SQUARE, hypot(1, 0.5) + hypot(1.5, 0.5)),  # one corner
        ((-3, 0), (3, 0), SQUARE, 2 * hypot(2, 1) + 2),  # two corners
        ((-5, -1), (6, -1), GAP, 2 * hypot(5, 10) + 1),  # through the gap
        ((-1, 0), (2, 0), TOUCHING, 2 * hypot(1, 2) + 1),  # not between the walls
        ((-2, 0), (2, 0), DISC, 2 * sqrt(3) + pi / 3),  # two tangents and an arc
    ],
)
def test_it_is_between_the_distance_and_the_true_way_round_obstacles(
    start: tuple[float, float],
    end: tuple[float, float],
    blocked: shapely.Geometry,
    exact_m: float,
) -> None:
    way = shortest_way_m(shapely.Point(start), shapely.Point(end), Walls.of(blocked))
    straight = hypot(end[0] - start[0], end[1] - start[1])
    assert straight - 1e-9 <= way <= exact_m + 1e-9


def test_round_one_corner_it_is_exact() -> None:
    way = shortest_way_m(
        shapely.Point(-2, 0.5), shapely.Point(0.5, 1.5), Walls.of(SQUARE)
    )
    assert way == pytest.approx(hypot(1, 0.5) + hypot(1.5, 0.5))


def test_many_corners_fall_back_on_the_straight_distance() -> None:
    rough = shapely.Point(0, 0).buffer(1.0, quad_segs=200)
    assert (
        shortest_way_m(shapely.Point(-2, 0), shapely.Point(2, 0), Walls.of(rough))
        == 4.0
    )


GRID_M = 0.25


def grid_way_m(
    start: tuple[float, float], end: tuple[float, float], blocked: shapely.Geometry
) -> float:
    """Return the shortest way on a fine grid with 16 directions of moves."""
    n = int(20.0 / GRID_M) + 1
    axis = np.arange(n) * GRID_M
    x, y = np.meshgrid(axis, axis, indexing="ij")
    free = ~shapely.intersects_xy(blocked, x, y)
    steps = [
        (i, j)
        for i in range(-2, 3)
        for j in range(-2, 3)
        if np.gcd(i, j) == 1  # (0, 1), (1, 1), (1, 2) and so on
    ]
    able = {}
    for i, j in steps:
        lines = np.stack([x, y, x + i * GRID_M, y + j * GRID_M], axis=-1).reshape(
            -1, 2, 2
        )
        able[i, j] = ~shapely.intersects(blocked, shapely.linestrings(lines)).reshape(
            n, n
        )
    first = tuple(round(c / GRID_M) for c in start)
    last = tuple(round(c / GRID_M) for c in end)
    best = {first: 0.0}
    heap = [(0.0, first)]
    while heap:
        far, here = heapq.heappop(heap)
        if here == last:
            return far
        if far > best[here]:
            continue
        for i, j in steps:
            to = here[0] + i, here[1] + j
            if not (0 <= to[0] < n and 0 <= to[1] < n):
                continue
            if not able[i, j][here] or not free[to]:
                continue
            further = far + GRID_M * hypot(i, j)
            if further < best.get(to, np.inf):
                best[to] = further
                heapq.heappush(heap, (further, to))
    return np.inf


@pytest.mark.quick("0", "1")
@pytest.mark.parametrize(
    "seed",
    [*range(4), *(pytest.param(seed, marks=pytest.mark.ci) for seed in range(4, 8))],
)
def test_it_is_never_longer_than_a_way_on_a_fine_grid(
    seed: int,
) -> None:
    rng = np.random.default_rng(seed)
    shapes = []
    for _ in range(7):
        spread = rng.uniform(-3.5, 3.5, (6, 2))
        shapes.append(shapely.MultiPoint(rng.uniform(4, 16, 2) + spread).convex_hull)
    if seed % 2:
        shapes.append(shapely.box(9.9, 2.0, 10.4, 20.0))
    blocked = shapely.union_all(shapes)
    shapely.prepare(blocked)
    compared = 0
    while compared < 4:
        start, end = rng.integers(0, 81, (2, 2)) * GRID_M
        ends = shapely.points([start, end])
        if shapely.intersects(blocked, ends).any() or hypot(*(start - end)) < 8.0:
            continue
        on_grid = grid_way_m(tuple(start), tuple(end), blocked)
        way = shortest_way_m(*ends, Walls.of(blocked))
        assert way <= on_grid + 1e-9
        assert way >= np.hypot(*(start - end)) - 1e-9
        compared += 1


def test_between_regions_it_is_no_longer_than_between_their_points() -> None:
    rng = np.random.default_rng(4)
    wall = Walls.of(shapely.box(9, 3, 11, 17))
    for _ in range(40):
        a = shapely.Point(rng.uniform((1, 1), (6, 19))).buffer(rng.uniform(0.5, 2.5))
        b = shapely.Point(rng.uniform((14, 1), (19, 19))).buffer(rng.uniform(0.5, 2.5))
        between = shortest_way_m(a, b, wall)
        for _ in range(5):
            p, q = (
                shapely.get_point(s.exterior, int(rng.integers(0, 60))) for s in (a, b)
            )
            assert between <= shortest_way_m(p, q, wall) + 1e-9


# --- finishes ----------------------------------------------------------------------


def finish(x: float, y: float, radius: float = 0.1) -> dict[str, Any]:
    return {"finish": {"circle": {"center": [x, y], "radius": radius}}}


def test_a_finish_inside_a_ring_is_unreachable_and_named(yard: MakeScene) -> None:
    robots = [car("r1", 4, 10, **finish(16, 10))]
    scene = yard(obstacles=[RING], robots=robots)
    assert "finish of r1 is unreachable" in str(proof_of_infeasibility(scene))


@pytest.mark.parametrize(("apart_m", "crowded"), [(0.0, True), (0.3, True), (3, False)])
def test_two_robots_cannot_end_in_one_place(
    yard: MakeScene, apart_m: float, crowded: bool
) -> None:
    robots = [
        car("r1", 4, 5, **finish(20, 10)),
        car("r2", 4, 15, **finish(20 + apart_m, 10)),
    ]
    proof = proof_of_infeasibility(yard(robots=robots))
    assert (proof is not None) == crowded
    if crowded:
        assert "r1 and r2 cannot both stand at their finishes" in str(proof)


WHOLE = {"circle": {"center": [20, 10], "radius": 4}}
BOXED = {"polygon": [[16, 6], [24, 6], [24, 14], [16, 14]]}


@pytest.mark.parametrize("shape", [WHOLE, BOXED])
@pytest.mark.parametrize(
    ("ends", "more", "possible"),
    [
        (WHOLE, {"capacity": 1}, False),
        (WHOLE, {}, True),
        ({"circle": {"center": [22, 10], "radius": 2.1}}, {"capacity": 1}, True),
    ],
)
def test_only_one_robot_ends_in_a_station_for_one(
    yard: MakeScene,
    shape: dict[str, Any],
    ends: dict[str, Any],
    more: dict[str, Any],
    possible: bool,
) -> None:
    robots = [car("r1", 4, 5, finish=WHOLE), car("r2", 4, 15, finish=ends)]
    stations = [{"id": "s", **shape, **more}]
    proof = proof_of_infeasibility(yard(robots=robots, stations=stations))
    assert (proof is None) == possible
