"""The shipped scenes are what the table of missions says, and worth planning for."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
import shapely
from places import nearest
from scipy.optimize import Bounds, LinearConstraint, milp
from shapely import affinity
from shapely.geometry import Polygon

from mrmg import shipped
from mrmg.scene.loading import load_scene
from mrmg.scene.populating.ground import Ground
from mrmg.scene.types import Scene

# name: robots, goals, stations, terrain areas, capacity in metres of plain ground
TABLE = {
    "scene1": (2, 14, 5, 4, 240),
    "scene2": (2, 8, 3, 4, 200),
    "scene3": (2, 9, 5, 3, 200),
    "scene4": (2, 9, 2, 0, 300),
    "scene5": (2, 14, 5, 2, 240),
    "scene6": (4, 20, 4, 0, 250),
    "scene6_r1": (1, 20, 4, 0, 250),
    "scene6_r2": (2, 20, 4, 0, 250),
    "scene6_r6": (6, 20, 4, 0, 250),
    "scene6_r8": (8, 20, 4, 0, 250),
    "quickstart": (2, 4, 1, 1, 48),
    "mixed": (3, 10, 3, 2, 70),
    "diffdrive": (2, 6, 2, 1, 45),
    "hills": (2, 8, 2, 3, 95),
    "boreal": (2, 5, 3, 5, 38),
}
QUICK = pytest.mark.quick("scene1", "scene4", "quickstart", "mixed", "hills")
MARGIN_M = 0.1
"""Beside half the robot's width: what a road must at least leave."""


def kinds_of(scene: Scene) -> list[list[int]]:
    """Group the robots (by number) of one model that the same obstacles stop."""
    kinds: dict[tuple[str, ...], list[int]] = {}
    for number, robot in enumerate(scene.robots):
        walls = tuple(wall.id for wall in scene.obstacles if wall.stops(robot.id))
        kinds.setdefault((robot.model.name, *walls), []).append(number)
    return list(kinds.values())


@cache
def ground_of(name: str, number: int = 0) -> Ground:
    """Where the robot of that number can drive."""
    scene = load_scene(name)
    robot = scene.robots[number]
    return Ground.over(
        scene.bounds,
        [wall.shape for wall in scene.obstacles if wall.stops(robot.id)],
        [(area.shape, area.multiplier) for area in scene.terrain],
        margin_m=robot.model.half_width_m + MARGIN_M,
    )


@cache
def road_m(name: str, number: int = 0) -> np.ndarray:
    """Distances between robots, goals and stations [m of plain ground], in this order.

    They are those of one robot: places it cannot reach are infinitely far. The grid
    makes a road up to 2.8 % longer than it must be.
    """
    scene, ground = load_scene(name), ground_of(name, number)
    places = [robot.pose[:2] for robot in scene.robots]
    places += [tuple(target.region.center) for target in scene.targets()]
    cells = [nearest(ground, place) for place in places]
    return ground.distances(cells)[:, cells]


def per_metre_J(scene: Scene, number: int) -> float:
    """Energy of a metre of plain ground."""
    return scene.robots[number].model.energy_model.plain_ground_J_per_m()


def usable_m(scene: Scene) -> float:
    """The way one battery drives on plain ground; `test_table` has them all equal."""
    battery = scene.robots[0].battery
    usable_J = battery.capacity_J * (1.0 - battery.reserve_fraction)
    return usable_J / per_metre_J(scene, 0)


def test_every_shipped_scene_is_in_the_table() -> None:
    assert set(TABLE) == set(shipped.scene_names())


@pytest.mark.parametrize("name", TABLE)
def test_table(name: str) -> None:
    scene = load_scene(name)
    robots, goals, stations, terrain, capacity_m = TABLE[name]
    assert len(scene.robots) == robots
    assert len(scene.goals) == goals
    assert len(scene.stations) == stations
    assert len(scene.terrain) == terrain
    for number, robot in enumerate(scene.robots):
        capacity_J = capacity_m * per_metre_J(scene, number)
        assert robot.battery.capacity_J == pytest.approx(capacity_J)
        assert robot.battery.start_J == robot.battery.capacity_J


@QUICK
@pytest.mark.parametrize("name", TABLE)
def test_every_target_can_be_reached_and_left(name: str) -> None:
    """Goals have room about them and a station well within half a battery."""
    scene = load_scene(name)
    robots, goals = len(scene.robots), len(scene.goals)
    reached = np.zeros(goals, dtype=bool)
    for kind in kinds_of(scene):
        ground, road = ground_of(name, kind[0]), road_m(name, kind[0])
        for target in scene.targets():
            at = nearest(ground, target.region.center)
            assert ground.clearance_m[at] >= 1.0, target.id
        to_goal = road[np.ix_(kind, range(robots, robots + goals))]
        within = np.isfinite(to_goal).all(axis=0)
        assert (within == np.isfinite(to_goal).any(axis=0)).all()
        assert np.isfinite(road[kind, robots + goals :]).any(axis=1).all()
        to_station = road[robots : robots + goals, robots + goals :].min(axis=1)
        assert to_station[within].max() <= 0.45 * usable_m(scene)
        reached |= within
    assert reached.all()


@pytest.mark.parametrize("name", TABLE)
def test_robots_start_with_room_about_them(name: str) -> None:
    """A metre from footprint to obstacles, bounds and the other robots."""
    scene = load_scene(name)
    footprints = [
        affinity.translate(
            affinity.rotate(
                Polygon(robot.model.footprint_m),
                robot.pose[2],
                origin=(0, 0),
                use_radians=True,
            ),
            *robot.pose[:2],
        )
        for robot in scene.robots
    ]
    outline = shapely.box(*scene.bounds)
    for number, footprint in enumerate(footprints):
        others = [other for k, other in enumerate(footprints) if k != number]
        about = [outline.exterior, *(wall.shape for wall in scene.obstacles), *others]
        assert outline.contains(footprint)
        assert min(footprint.distance(thing) for thing in about) >= 1.0


@cache
def cheapest_mission(name: str) -> tuple[list[list[int]], list[float]]:
    """Routes of the cheapest assignment that ignores energy, and their lengths [m]."""
    scene = load_scene(name)
    kinds = kinds_of(scene)
    roads = np.stack([road_m(name, kind[0]) for kind in kinds])
    prices_J = np.array([per_metre_J(scene, kind[0]) for kind in kinds])
    costs_J = roads * prices_J[:, None, None]
    cost_J, routes = cheapest_routes(costs_J, kinds, len(scene.goals))
    road_of = {number: k for k, kind in enumerate(kinds) for number in kind}
    lengths_m = [
        sum(roads[road_of[r[0]], a, b] for a, b in zip(r, r[1:], strict=False))
        for r in routes
    ]
    own_J = [prices_J[road_of[route[0]]] for route in routes]
    assert np.dot(own_J, lengths_m) == pytest.approx(cost_J)
    return routes, lengths_m


@QUICK
@pytest.mark.parametrize("name", TABLE)
def test_the_energy_limit_binds(name: str) -> None:
    """The cheapest assignment that ignores energy overdraws some battery."""
    _, lengths_m = cheapest_mission(name)
    # More than the grid can err.
    assert max(lengths_m) > 1.03 * usable_m(load_scene(name))


@QUICK
@pytest.mark.parametrize("name", TABLE)
def test_every_robot_is_worth_using(name: str) -> None:
    """It starts where it is the cheapest for some goal."""
    routes, _ = cheapest_mission(name)
    assert min(len(route) - 1 for route in routes) >= 1


def cheapest_routes(
    cost: np.ndarray, kinds: list[list[int]], goals: int
) -> tuple[float, list[list[int]]]:
    """Return the cheapest open routes that visit all goals, and their total cost.

    An exact integer programme: every goal is entered once, and left at most once by the
    kind of robot that entered it; cycles are cut off until none is left.

    Args:
        cost: from place to place, for each kind of robot, infinite where there is no
            way; robots first, then goals. Shape (kinds, n, n).
        kinds: the robots of each kind.
        goals: how many.
    """
    robots = sum(map(len, kinds))
    size = robots + goals
    arcs = [
        (kind, i, j)
        for kind, members in enumerate(kinds)
        for i in (*members, *range(robots, size))
        for j in range(robots, size)
        if i != j and np.isfinite(cost[kind, i, j])
    ]
    enter = [[float(j == goal) for _, _, j in arcs] for goal in range(robots, size)]
    start = [[float(i == robot) for _, i, _ in arcs] for robot in range(robots)]
    flow = [
        [float(k == kind) * ((j == goal) - (i == goal)) for k, i, j in arcs]
        for kind in range(len(kinds))
        for goal in range(robots, size)
    ]
    rules = [
        LinearConstraint(enter, 1, 1),
        LinearConstraint(start, 0, 1),
        LinearConstraint(flow, 0, 1),
    ]
    prices = [cost[arc] for arc in arcs]
    while True:
        found = milp(
            prices,
            constraints=rules,
            integrality=np.ones(len(arcs)),
            bounds=Bounds(0, 1),
        )
        after = {arcs[k][1]: arcs[k][2] for k in np.flatnonzero(found.x > 0.5)}
        routes = [walk(first, after) for first in range(robots)]
        astray = set(range(robots, size)).difference(*routes)
        if not astray:
            return float(found.fun), routes
        while astray:
            cycle = set(walk(min(astray), after))
            astray -= cycle
            inside = [float(i in cycle and j in cycle) for _, i, j in arcs]
            rules.append(LinearConstraint(inside, 0, len(cycle) - 1))


def walk(start: int, after: dict[int, int]) -> list[int]:
    route = [start]
    while route[-1] in after and after[route[-1]] not in route:
        route.append(after[route[-1]])
    return route


LINE = np.array([0.0, 10.0, 1.0, 2.0, 9.0])
"""Robots at 0 and 10, goals at 1, 2, 9."""


def test_cheapest_routes_on_a_line() -> None:
    """Two goals are left for the left robot, one for the right."""
    cost = np.abs(LINE[:, None] - LINE)[None]
    cost_m, routes = cheapest_routes(cost, [[0, 1]], 3)
    assert cost_m == pytest.approx(3.0)
    assert routes == [[0, 2, 3], [1, 4]]


def test_cheapest_routes_keep_off_what_is_closed_to_a_robot() -> None:
    """The left robot must not visit the goal at 2, so the right one comes over."""
    cost = np.stack([np.abs(LINE[:, None] - LINE)] * 2)
    cost[0, 3, :] = cost[0, :, 3] = np.inf
    cost_m, routes = cheapest_routes(cost, [[0], [1]], 3)
    assert cost_m == pytest.approx(9.0)
    assert routes == [[0, 2], [1, 4, 3]]


def test_scene4_makes_both_robots_back_out() -> None:
    """Both start nose first in dead ends too narrow to turn round in."""
    scene = load_scene("scene4")
    solid = shapely.union_all([obstacle.shape for obstacle in scene.obstacles])
    for robot in scene.robots:
        x, y, yaw = robot.pose
        model = robot.model
        turning_width_m = 2.0 * (model.turning_radius_m + model.half_width_m)
        ahead = np.array([np.cos(yaw), np.sin(yaw)])
        across = np.array([-ahead[1], ahead[0]])
        start = np.array([x, y])
        sides = [_way_m(solid, start, side) for side in (across, -across)]
        assert 2.6 <= sum(sides) < turning_width_m
        assert _way_m(solid, start, ahead) < 6.0
        narrow = [
            sum(_way_m(solid, start - s * ahead, side) for side in (across, -across))
            for s in np.arange(0.0, 5.5, 0.5)
        ]
        assert max(narrow) < turning_width_m


def test_scene4_makes_both_robots_use_narrow_passages() -> None:
    """Each robot alone can visit some goal, and that lies where no car can turn."""
    scene = load_scene("scene4")
    robots, goals = len(scene.robots), len(scene.goals)
    reach = np.stack(
        [
            np.isfinite(road_m("scene4", number)[number, robots : robots + goals])
            for number in range(robots)
        ]
    )
    solid = shapely.union_all(
        [wall.shape for wall in scene.obstacles if not wall.blocks]
    )
    for number, robot in enumerate(scene.robots):
        model = robot.model
        turning_width_m = 2.0 * (model.turning_radius_m + model.half_width_m)
        only = [
            scene.goals[goal]
            for goal in np.flatnonzero(reach[number] & (reach.sum(axis=0) == 1))
        ]
        assert only, robot.id
        for goal in only:
            narrow = [
                _way_m(solid, goal.region.center, side)
                + _way_m(solid, goal.region.center, -side)
                for side in (np.array([1.0, 0.0]), np.array([0.0, 1.0]))
            ]
            assert min(narrow) < turning_width_m


def _way_m(solid: shapely.Geometry, start: np.ndarray, along: np.ndarray) -> float:
    """Return how far one can go from `start` before touching `solid`."""
    ray = shapely.LineString([start, start + 200.0 * along])
    return float(shapely.Point(start).distance(ray.intersection(solid)))


@pytest.mark.parametrize("name", [n for n in TABLE if n.startswith("scene6_")])
def test_variants_of_scene6_share_its_map(name: str) -> None:
    base, variant = load_scene("scene6"), load_scene(name)
    for part in ("bounds", "obstacles", "goals", "stations", "battery"):
        assert variant.document[part] == base.document[part]
    for one, other in zip(base.robots, variant.robots, strict=False):
        assert one.pose == other.pose
