"""Tours by arcs against brute force, ways between arcs against exact distances."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import combinations, pairwise, permutations, product
from typing import Any

import numpy as np
import pytest
import shapely
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import KDTree

import mrmg
from mrmg.planning.bound import touring
from mrmg.planning.bound._completion_kernels import Completions
from mrmg.planning.bound.arcs import ArcWays
from mrmg.planning.bound.bound import lower_bound_J
from mrmg.planning.bound.completions import Visits, completions
from mrmg.planning.bound.exact_tours import cheapest_tours, exact_routing
from mrmg.planning.bound.relaxation import Relaxation
from mrmg.planning.bound.touring import touring_bound_J
from mrmg.planning.routing._nrpa_kernels import RoutingArrays
from mrmg.planning.routing.instance import RoutingInstance
from mrmg.scene.loading import scene_from_document
from mrmg.scene.types import Scene

Mission = Callable[..., RoutingArrays]

FIRST_GOAL = np.array([8.0, 10.0])
SECOND_GOAL = np.array([24.0, 10.0])
RADIUS_M = 2.0


def legs(seed: int, robots: int, goals: int, stations: int, arcs: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    targets = goals + stations
    return rng.uniform(5.0, 30.0, (robots, targets + 1, arcs, targets, arcs))


def least_cost(leg: np.ndarray, goals: int, range_m: float) -> float:
    """Return the cheapest tours' cost by trying all, with at most one recharge a leg.

    Legs drain batteries by what they cost, those from stations by the least that they
    cost from any arc.
    """
    robots, start = leg.shape[0], leg.shape[1] - 1
    drain = leg.copy()
    drain[:, goals:start] = leg[:, goals:start].min(axis=2, keepdims=True)
    best = math.inf
    for order in permutations(range(goals)):
        for cuts in combinations(range(goals + robots - 1), robots - 1):
            ends = [-1, *cuts, goals + robots - 1]
            own = [
                order[low + 1 - r : high - r]
                for r, (low, high) in enumerate(zip(ends, ends[1:], strict=False))
            ]
            cost = sum(
                route_cost(leg[r], drain[r], route, goals, range_m)
                for r, route in enumerate(own)
            )
            best = min(best, cost)
    return best


def route_cost(
    leg: np.ndarray,
    drain: np.ndarray,
    route: tuple[int, ...],
    goals: int,
    range_m: float,
) -> float:
    """Return the least cost of a route over all stations and arcs between its goals."""
    start = len(leg) - 1
    best = math.inf
    for stops in product((None, *range(goals, start)), repeat=len(route)):
        cost, left, arc = np.zeros(1), np.full(1, range_m), np.zeros(1, int)
        here = start
        for stop, goal in zip(stops, route, strict=True):
            for place in (goal,) if stop is None else (stop, goal):
                cost = (cost[:, None] + leg[here, arc, place]).ravel()
                left = (left[:, None] - drain[here, arc, place]).ravel()
                arc = np.tile(np.arange(leg.shape[1]), len(arc))
                cost, left, arc = (one[left >= 0.0] for one in (cost, left, arc))
                left = np.full_like(left, range_m) if place >= goals else left
                here = place
        best = min(best, float(cost.min(initial=math.inf)))
    return best


def by_arcs(leg: np.ndarray, goals: int, range_m: float) -> RoutingArrays:
    """Return the mission of legs from arc to arc."""
    least = leg.min(axis=(2, 4))
    least[:, -1] = leg[:, -1, 0].min(axis=-1)
    robots = len(leg)
    return RoutingInstance(
        goals=goals,
        distance=least[:, :-1],
        start_distance=least[:, -1],
        plain=np.ones(robots),
        energy=np.full(robots, range_m),
        capacity=np.full(robots, range_m),
        reserve=np.zeros(robots),
    ).arrays


def no_completions(problem: RoutingArrays, visits: Visits) -> Completions:
    """Return completions that know nothing, for searches among all tours."""
    known = completions(problem, visits=visits)
    return Completions._make(map(np.zeros_like, known))


@pytest.mark.parametrize(
    ("goals", "stations", "robots", "range_m"),
    [(4, 0, 1, 1e9), (3, 1, 1, 40.0), (4, 0, 2, 50.0), (3, 2, 2, 25.0)],
)
def test_tours_by_arcs_are_the_cheapest(
    goals: int, stations: int, robots: int, range_m: float
) -> None:
    for seed in range(8):
        leg = legs(seed, robots, goals, stations, arcs=3)
        # One station between two goals at most, as the oracle tries: make two dear.
        leg[:, goals:-1, :, goals:] = 1e6
        problem = by_arcs(leg, goals, range_m)
        nothing = no_completions(problem, Visits.all_remembered(problem))
        exact = least_cost(leg, goals, range_m)
        most = 1e4
        found, _ = cheapest_tours(problem, leg, nothing, most)
        assert found is not None
        if exact <= most:
            assert found.cost_J == pytest.approx(exact)
            rest = completions(problem, leg)
            assert rest.before[0] <= exact * (1.0 + 1e-9)
            pruned, work = cheapest_tours(problem, leg, rest, (1.0 + 1e-9) * exact)
            assert pruned is not None
            assert pruned.cost_J == pytest.approx(exact)
            few, _ = cheapest_tours(problem, leg, rest, (1.0 + 1e-9) * exact, work - 1)
            assert few is None, "too little work is said, not guessed at"
        else:
            assert found.cost_J == math.inf
        below, _ = cheapest_tours(problem, leg, nothing, 0.99 * exact)
        assert below is not None
        assert not below.feasible, "nothing is cheaper than the cheapest"


@pytest.mark.parametrize(
    ("goals", "stations", "robots", "range_m"),
    [(5, 0, 1, 1e9), (4, 1, 1, 40.0), (4, 1, 2, 50.0), (4, 2, 2, 25.0)],
)
def test_counted_visits_prove_no_more_than_the_cheapest_tours_cost(
    goals: int, stations: int, robots: int, range_m: float
) -> None:
    """Whatever the prices; and as much with one goal that need not be remembered."""
    rng = np.random.default_rng(7)
    for seed in range(6):
        leg = legs(seed, robots, goals, stations, arcs=2)
        problem = by_arcs(leg, goals, range_m)
        exact, _ = cheapest_tours(
            problem, leg, no_completions(problem, Visits.all_remembered(problem)), 1e5
        )
        assert exact is not None
        if not exact.feasible:
            continue
        for remembered in range(goals + 1):
            visits = Visits(
                order=rng.permutation(goals),
                remembered=remembered,
                price=np.append(rng.normal(0.0, 5.0, goals), np.zeros(stations)),
                setting_out=np.abs(rng.normal(0.0, 5.0, robots)),
            )
            every = cheapest_tours(
                problem, leg, no_completions(problem, visits), 1e5, visits=visits
            )[0]
            assert every is not None
            least = every.cost_J
            assert least <= exact.cost_J * (1.0 + 1e-9)
            if remembered >= goals - 1:
                assert least >= exact.cost_J * (1.0 - 1e-9)
            rest = completions(problem, leg, visits)
            assert rest.before[0] - visits.surcharge <= exact.cost_J * (1.0 + 1e-9)
            most = exact.cost_J * (1.0 + 1e-9)
            found = cheapest_tours(problem, leg, rest, most, visits=visits)[0]
            assert found is not None
            assert found.cost_J <= most
            assert found.cost_J >= least - 1e-9 * exact.cost_J


@pytest.mark.parametrize("range_m", [1e9, 60.0])
def test_walks_of_counted_visits_are_the_cheapest(range_m: float) -> None:
    """Against all walks that lead nowhere twice in a row, nor straight back."""
    goals, rng = 4, np.random.default_rng(11)
    for seed in range(40):
        leg = legs(seed, 1, goals, 0, arcs=2)
        problem = by_arcs(leg, goals, range_m)
        price = rng.normal(0.0, 5.0, goals)
        visits = Visits(np.arange(goals), 0, price, np.zeros(1))
        nothing = no_completions(problem, visits)
        found, _ = cheapest_tours(problem, leg, nothing, 1e5, visits=visits)
        least = math.inf
        for walk in product(range(goals), repeat=goals):
            if any(walk[k] in walk[max(0, k - 2) : k] for k in range(goals)):
                continue
            for arcs in product(range(2), repeat=goals):
                way = [(goals, 0), *zip(walk, arcs, strict=True)]
                way_m = sum(leg[0][a + b] for a, b in pairwise(way))
                if way_m <= range_m:
                    least = min(least, way_m + price[list(walk)].sum())
        assert found is not None
        assert found.cost_J == pytest.approx(least - price.sum())


def test_a_goal_that_no_robot_reaches_makes_the_tours_infinite() -> None:
    problem = RoutingInstance(
        goals=1,
        distance=np.zeros((1, 1, 1)),
        start_distance=np.array([[np.inf]]),
        plain=np.ones(1),
        energy=np.ones(1),
        capacity=np.ones(1),
        reserve=np.zeros(1),
    ).arrays
    routing = exact_routing(problem)
    assert routing is not None
    assert not routing.feasible


def field(**parts: object) -> Scene:
    document = {
        "format": 1,
        "name": "field",
        "bounds": [0, 0, 32, 20],
        "goals": [
            {"id": f"g{k}", "circle": {"center": list(center), "radius": RADIUS_M}}
            for k, center in enumerate((FIRST_GOAL, SECOND_GOAL))
        ],
        "battery": {"capacity_m": 500},
        "robots": [{"id": "r1", "model": "car", "pose": [2, 4, 0]}],
        **parts,
    }
    return scene_from_document(document, source="field")


def arc_ways(scene: Scene) -> ArcWays:
    (ways,) = Relaxation.of(scene, cells=7000).arc_ways()
    return ways


def tightened(scene: Scene, *pairs: tuple[int, int]) -> ArcWays:
    ways = arc_ways(scene)
    for pair in pairs:
        assert ways.is_loose(pair)
        ways.take(pair, *ways.certificate(pair))
        assert not ways.is_loose(pair)
        assert not ways.is_loose(pair[::-1])
    return ways


def border_points(center: np.ndarray, arc: int, arcs: int) -> np.ndarray:
    angle = 2.0 * np.pi * (arc + np.linspace(0.0, 1.0, 9)) / arcs
    return center + RADIUS_M * np.stack([np.cos(angle), np.sin(angle)], axis=1)


WALL_SHARE = {"id": "w", "polygon": [[15, 6], [17, 6], [17, 20], [15, 20]], "height": 1}


@pytest.mark.parametrize("walls", [0, 1])
def test_ways_between_the_middles_of_arcs_are_known(walls: int) -> None:
    """Straight, or round a wall; the robot passes at half its width, 0.55 m."""
    scene = field(obstacles=[WALL_SHARE] * walls)
    before = arc_ways(scene).between
    ways = tightened(scene, (0, 1))
    assert ways.smooth.all()
    assert (ways.between >= before).all()
    gained = 0.0
    arcs = ways.between.shape[1]
    for a, b in product(range(0, arcs, 3), repeat=2):
        first = border_points(FIRST_GOAL, a, arcs)[4]
        second = border_points(SECOND_GOAL, b, arcs)[4]
        if walls:  # a way there is, clear of both corners; the shortest is rounder
            here, there = np.array([14.45, 5.45]), np.array([17.55, 5.45])
            exact = 3.1 + sum(
                math.dist(*ends) for ends in ((first, here), (second, there))
            )
        else:
            exact = math.dist(first, second)
        assert 0.97 * exact <= ways.between[0, a, 1, b] <= exact + 1e-9
        gained += float((ways.between - before)[0, a, 1, b])
    assert gained > 0.0


def test_no_way_through_dear_ground_costs_less_than_its_bound() -> None:
    """Ways through a strip are refracted: the cheapest one is found point by point."""
    strip = {"id": "mud", "polygon": [[14, 0], [18, 0], [18, 20], [14, 20]]}
    ways = tightened(field(terrain=[{**strip, "multiplier": 2.0}]), (0, 1))
    arcs = ways.between.shape[1]
    shares = product((0.0, 0.12, 0.28), (0.44, 0.5, 0.62))
    pairs = [(int(a * arcs), int(b * arcs)) for a, b in shares]
    y = np.linspace(6.0, 14.0, 801)
    for a, b in pairs:
        first = border_points(FIRST_GOAL, a, arcs)[4:5]
        second = border_points(SECOND_GOAL, b, arcs)[4:5]
        into = np.hypot(14.0 - first[:, :1], y - first[:, 1:]).min(axis=0)
        out = np.hypot(second[:, :1] - 18.0, y - second[:, 1:]).min(axis=0)
        across = into[:, None] + 2.0 * np.hypot(4.0, y[:, None] - y)
        exact = float((across.min(axis=0) + out).min())
        assert 0.98 * exact < ways.between[0, a, 1, b] <= exact + 1e-4


def test_no_way_from_a_start_is_shorter_than_its_bound() -> None:
    """The wall hides the second goal: the shortest path bends at both its corners."""
    ways = tightened(field(obstacles=[WALL_SHARE]), (-1, 1))
    arcs = ways.between.shape[1]
    start, here, there = np.array([[2.0, 4.0], [14.45, 5.45], [17.55, 5.45]])
    for arc in range(arcs):
        last = border_points(SECOND_GOAL, arc, arcs)[4:5] - there
        exact = np.hypot(*(here - start)) + 3.1 + np.hypot(*last.T).min()
        assert ways.from_start[0, 1, arc] <= exact + 1e-9
        if last[:, 1].min() > 0.0 and last[:, 0].min() > 0.0:
            assert ways.from_start[0, 1, arc] >= 0.98 * exact


@pytest.mark.parametrize(
    "seed", [0, 1, *(pytest.param(k, marks=pytest.mark.ci) for k in range(2, 12))]
)
def test_certificates_are_below_paths_among_random_polygons_and_near_them(
    seed: int,
) -> None:
    """Against paths over a lattice of directions, priced exactly by shapely.

    Such paths may be driven, so none may cost less than its certificate. They bend in
    points of the lattice alone, so they are longer than the shortest ones; and where
    areas overlap, as they do here, a certificate is the less.
    """
    rng = np.random.default_rng(seed)
    scene = random_polygons(rng)
    ways = tightened(scene, (0, 1), (-1, 1))
    costs = driven_paths(scene)
    arcs = ways.between.shape[1]
    here, there = (
        [np.array([border_points(c, a, arcs)[4]]) for a in range(0, arcs, 8)]
        for c in (FIRST_GOAL, SECOND_GOAL)
    )
    ratios = []
    for a, b in product(range(len(here)), repeat=2):
        exact = costs(here[a], there[b])
        certified = ways.between[0, 8 * a, 1, 8 * b]
        assert certified <= exact + 1e-9
        if np.isfinite(exact):
            ratios.append(certified / exact)
    start = np.array([scene.robots[0].pose[:2]])
    for b in range(len(there)):
        assert ways.from_start[0, 1, 8 * b] <= costs(start, there[b]) + 1e-9
    assert np.median(ratios) > 0.75


@pytest.mark.parametrize("seed", range(6))
def test_no_tour_that_touches_all_goals_costs_less_than_the_bound(
    seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Among goals of two kinds, round a wall; against tours by way of dense points.

    Half of the times all ways to near places are tightened after the first round.
    """
    if seed % 2:
        monkeypatch.setattr(touring, "LONG_ROUND", 0)
    rng = np.random.default_rng(seed)
    square = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    spots = [(8.0, 5.0), (8.0, 14.0), (25.0, 15.0), (25.0, 5.0)]
    borders, goals = [], []
    for k, center in enumerate(np.array(spots) + rng.uniform(-2.0, 2.0, (4, 2))):
        shape: dict[str, Any]
        if k % 2:
            corners = center + square * rng.uniform(0.8, 1.8)
            shape = {"polygon": corners.tolist()}
            share = np.linspace(0.0, 1.0, 100, endpoint=False)[:, None]
            sides = zip(corners, np.roll(corners, -1, axis=0), strict=True)
            borders.append(np.concatenate([a + share * (b - a) for a, b in sides]))
        else:
            radius = rng.uniform(0.8, 1.8)
            shape = {"circle": {"center": center.tolist(), "radius": radius}}
            angle = np.linspace(0.0, 2.0 * np.pi, 400)[:, None]
            ring = np.concatenate([np.cos(angle), np.sin(angle)], axis=1)
            borders.append(center + radius * ring)
        goals.append({"id": f"g{k}", **shape})
    scene = field(goals=goals, obstacles=[WALL_SHARE])
    start = np.array([scene.robots[0].pose[:2]])

    def legs(one: np.ndarray, other: np.ndarray) -> np.ndarray:
        straight = np.hypot(*(one[:, None] - other[None]).transpose(2, 0, 1))
        lines = shapely.linestrings(
            np.stack(np.broadcast_arrays(one[:, None], other[None]), axis=2)
        )
        wall = shapely.box(14.45, 5.45, 17.55, 20.0)
        shapely.prepare(wall)
        left, right = np.array([[14.45, 5.45]]), np.array([[17.55, 5.45]])
        low = one[:, None, 0] < 16.0
        first = np.where(low, _off(one, left), _off(one, right))
        round_it = (
            first + 3.1 + np.where(low, _off(other, right).T, _off(other, left).T)
        )
        return np.where(shapely.intersects(lines, wall), round_it, straight)

    between = {
        (i, j): legs(borders[i], borders[j]) for i, j in permutations(range(4), 2)
    }
    least = math.inf
    for order in permutations(range(4)):
        cost = legs(start, borders[order[0]])[0]
        for i, j in pairwise(order):
            cost = (cost[:, None] + between[i, j]).min(axis=0)
        least = min(least, float(cost.min()))
    price = scene.robots[0].model.energy_model.plain_ground_J_per_m()
    bound_m = lower_bound_J(scene) / price
    assert 0.98 * least <= bound_m <= least


@pytest.mark.parametrize("seed", range(4))
def test_goals_that_overlap_on_costly_ground_are_told_apart(seed: int) -> None:
    """Against tours by way of dense points of their borders; a station beside them."""
    rng = np.random.default_rng(seed)
    centres = rng.uniform((18.0, 6.0), (25.0, 13.0), (4, 2))
    apart = np.hypot(*(centres[:, None] - centres).transpose(2, 0, 1))
    assert (apart < 3.0).sum() > 4, "none overlaps another one"
    scene = field(
        goals=[
            {"id": f"g{k}", "circle": {"center": center.tolist(), "radius": 1.5}}
            for k, center in enumerate(centres)
        ],
        stations=[{"id": "s", "circle": {"center": [21, 9], "radius": 1.5}}],
        terrain=[
            {
                "id": "sand",
                "polygon": [[8, 0], [32, 0], [32, 20], [8, 20]],
                "multiplier": 5.0,
            }
        ],
        robots=[{"id": "r1", "model": "car", "pose": [12, 10, 0]}],
    )
    least = 5.0 * shortest_tour_m((12.0, 10.0), centres)
    price = scene.robots[0].model.energy_model.plain_ground_J_per_m()
    assert 0.78 * least <= lower_bound_J(scene) / price <= least


def shortest_tour_m(start: tuple[float, float], centres: np.ndarray) -> float:
    """Return the shortest tour by dense points of borders of circles of 1.5 m."""
    angle = np.linspace(0.0, 2.0 * np.pi, 721)
    ring = 1.5 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    least_m = math.inf
    for order in permutations(range(len(centres))):
        cost, points = np.zeros(1), np.array([start])
        for k in order:
            to = centres[k] + ring
            leg = np.hypot(*(points[:, None] - to[None]).transpose(2, 0, 1))
            cost, points = (cost[:, None] + leg).min(axis=0), to
        least_m = min(least_m, float(cost.min()))
    return least_m


def _off(points: np.ndarray, corner: np.ndarray) -> np.ndarray:
    return np.hypot(*(points - corner).T)[:, None]


def random_polygons(rng: np.random.Generator) -> Scene:
    """Return the field with obstacles and terrain between its goals."""

    def polygon(low: tuple[float, float], high: tuple[float, float]) -> list[Any]:
        angle = np.sort(rng.uniform(0.0, 2.0 * np.pi, 5)) + 0.2 * np.arange(5)
        ring = np.stack([np.cos(angle), np.sin(angle)], axis=1) * rng.uniform(1.0, 3.5)
        hull = shapely.MultiPoint(ring + rng.uniform(low, high)).convex_hull
        return [list(map(float, p)) for p in hull.exterior.coords[:-1]]

    terrain = [
        {"id": f"t{k}", "polygon": polygon((11, 4), (21, 16)), "multiplier": float(m)}
        for k, m in enumerate(rng.choice([0.6, 1.6, 3.0], 3))
    ]
    obstacles = [
        {"id": f"o{k}", "polygon": polygon((11, 3), (21, 17)), "height": 1}
        for k in range(3)
    ]
    return field(terrain=terrain, obstacles=obstacles)


REACH_M = 1.9
"""Distance within which a path leads straight from point to point of a lattice."""


def driven_paths(scene: Scene) -> Callable[..., float]:
    """Return what paths over the points of a lattice cost between two points."""
    robot = scene.robots[0]
    solid = shapely.union_all([o.shape for o in scene.obstacles]).buffer(
        robot.model.inscribed_radius_m, quad_segs=32
    )
    x, y = np.meshgrid(np.arange(1.0, 31.0, 0.5), np.arange(0.5, 19.7, 0.5))
    lattice = np.stack([x.ravel(), y.ravel()], axis=1)
    lattice = lattice[~shapely.contains_xy(shapely.buffer(solid, 1e-6), lattice)]

    def priced(first: np.ndarray, second: np.ndarray) -> np.ndarray:
        lines = shapely.linestrings(np.stack([first, second], axis=1))
        cost, rest = np.zeros(len(lines)), lines
        for area in reversed(scene.terrain):  # the last one counts
            own = shapely.intersection(rest, area.shape)
            cost += area.multiplier * shapely.length(own)
            rest = shapely.difference(rest, area.shape)
        cost += shapely.length(rest)
        cost[shapely.intersects(lines, solid)] = np.inf
        return cost

    tree = KDTree(lattice)
    near = tree.query_pairs(REACH_M, output_type="ndarray")
    cost = priced(lattice[near[:, 0]], lattice[near[:, 1]])
    free = np.isfinite(cost)
    size = len(lattice)
    graph = csr_array((cost[free], near[free].T), shape=(size, size))

    def between(one: np.ndarray, other: np.ndarray) -> float:
        ends = []
        for point in (one, other):
            close = tree.query_ball_point(point[0], REACH_M)
            ends.append(
                (close, priced(np.repeat(point, len(close), 0), lattice[close]))
            )
        (a, first), (b, last) = ends
        middle = dijkstra(graph, directed=False, indices=a)[:, b]
        return float((first[:, None] + middle + last).min())

    return between


TRIANGLE = np.array([[4.0, 4.0], [28.0, 4.0], [16.0, 16.0]])


def triangle() -> Scene:
    """Three goals at the corners of a triangle, which is begun on one of its sides."""
    goals = [
        {"id": f"g{k}", "circle": {"center": center.tolist(), "radius": 1.5}}
        for k, center in enumerate(TRIANGLE)
    ]
    return field(goals=goals, robots=[{"id": "r1", "model": "car", "pose": [16, 4, 0]}])


def test_less_work_proves_less_and_never_less_than_was_known() -> None:
    relaxed = Relaxation.of(triangle(), cells=2000)
    routing = exact_routing(relaxed.problem)
    assert routing is not None
    found_J = [
        touring_bound_J(
            relaxed.problem,
            routing,
            relaxed.arc_ways(),
            relaxed.price,
            rounds=20,
            work=work,
        )
        for work in (0, 3_000, 10_000_000)
    ]
    assert routing.cost_J <= found_J[0] <= found_J[1] <= found_J[2]
    assert found_J[0] < found_J[2]


@pytest.mark.parametrize("step", [pytest.param(0.002, marks=pytest.mark.ci), 0.005])
def test_the_bound_is_as_good_however_small_the_steps_towards_it(
    step: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Costs up to which no tours are found are proven, and more is looked at then."""
    scene = mrmg.load_scene("scene4")
    monkeypatch.setattr(touring, "STEP", 0.05)
    at_once_J = lower_bound_J(scene)
    monkeypatch.setattr(touring, "STEP", step)
    assert lower_bound_J(scene) >= (1.0 - 2.0 * touring.LEAST_RISE) * at_once_J


def test_pairs_of_arcs_prove_less_and_stay_below_the_optimum(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    scene = triangle()
    fine_J = lower_bound_J(scene)
    monkeypatch.setattr(touring, "MOST_LEGS", 20_000)
    assert lower_bound_J(scene, rounds=0) < lower_bound_J(scene) <= fine_J


def test_touching_a_goal_beside_the_way_is_paid_for() -> None:
    """Each goal is entered and left by one arc."""
    scene = triangle()
    joules = scene.robots[0].model.energy_model.plain_ground_J_per_m()
    coarse_m, touring_m = (
        lower_bound_J(scene, rounds=rounds) / joules for rounds in (0, 20)
    )
    exact_m = shortest_tour_m((16.0, 4.0), TRIANGLE)
    finer_m = lower_bound_J(scene, finer=7) / joules
    assert coarse_m < touring_m <= finer_m <= exact_m + 1e-3
    assert touring_m >= 0.97 * exact_m
