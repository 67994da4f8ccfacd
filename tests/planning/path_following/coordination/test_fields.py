"""Costs-to-go over grids: what turning costs, and which gaps are wide enough."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from math import cos, hypot, inf, pi, sin

import networkx as nx
import numpy as np
import pytest
import shapely
from shapely import affinity

from mrmg.planning.parameters import PlannerParams
from mrmg.planning.path_following.coordination import _field_kernels, _guide_kernels
from mrmg.planning.path_following.coordination._guide_kernels import BEARINGS
from mrmg.planning.path_following.coordination.fields import (
    MOST_POSES,
    NO_GUIDE,
    Fields,
)
from mrmg.planning.path_following.coordination.traffic import FleetTraffic
from mrmg.planning.path_following.tracking import Motion
from mrmg.planning.problem.problem import Problem, state_mission
from mrmg.scene.types import Scene

Pose = tuple[int, int, int]


def moves(
    price: np.ndarray, turn_s: np.ndarray, back: float
) -> Iterator[tuple[Pose, Pose, float]]:
    """Yield (from, to, cost) of all moves from pose to pose, (heading, row, column)."""
    rows, columns = price.shape
    for h, i, j in np.ndindex(BEARINGS, rows, columns):
        angle = 2.0 * pi * h / BEARINGS
        for side, factor in ((1, 1.0), (-1, back)):
            a, b = i + side * round(sin(angle)), j + side * round(cos(angle))
            if 0 <= a < rows and 0 <= b < columns:
                way = hypot(a - i, b - j) * 0.5 * (price[i, j] + price[a, b])
                if way * factor < inf:
                    yield (h, i, j), (h, a, b), way * factor
        for g in ((h + 1) % BEARINGS, (h - 1) % BEARINGS):
            yield (h, i, j), (g, i, j), turn_s[i, j]


@pytest.mark.parametrize("back", [1.0, 2.5, inf])
def test_costs_of_poses_are_those_of_the_shortest_ways(back: float) -> None:
    """Against Dijkstra's algorithm of networkx, on priced ground with obstacles."""
    for seed in range(4):
        rng = np.random.default_rng(seed)
        price = rng.uniform(0.2, 2.0, (7, 9))
        price[rng.random(price.shape) < 0.25] = inf
        turn_s = rng.uniform(0.1, 3.0, price.shape)
        cost = np.full((BEARINGS, *price.shape), inf)
        cost[:, 3, 4] = rng.uniform(0.0, 5.0, BEARINGS)
        graph: nx.DiGraph[object] = nx.DiGraph()
        for one, other, way in moves(price, turn_s, back):
            graph.add_edge(other, one, weight=way)
        for h in range(BEARINGS):
            graph.add_edge("end", (h, 3, 4), weight=cost[h, 3, 4])
        expected = nx.single_source_dijkstra_path_length(graph, "end")
        _field_kernels.turning_cost_to_go(price, turn_s, back, cost)
        for pose in np.ndindex(cost.shape):
            assert cost[pose] == pytest.approx(expected.get(pose, inf), abs=1e-9)


def test_turning_is_counted_beside_the_way(
    yard: Callable[..., Scene], state: Callable[..., Problem]
) -> None:
    robots = [{"id": "r", "model": "diffdrive", "pose": [4, 10, 0]}]
    goals = [{"id": "g", "circle": {"center": [12, 10], "radius": 0.5}}]
    small = yard(robots=robots, goals=goals, bounds=[0, 0, 16, 16])
    problem = state(small, samples=50)
    rate = float(problem.mission.fleet[0]["limit"][2])
    fields = Fields(problem)
    turning = fields.turning(0, [0])
    assert turning.shape[:2] == (1, BEARINGS)
    assert turning.min() >= -1e-9
    guide = fields.static(0, [0])._replace(turning=turning)

    def turn_s(theta: float) -> float:
        at = np.array([4.0, 10.0, theta, 0.0, 0.0])
        return float(_guide_kernels.turning_at(guide, 0, at))

    assert turn_s(0.0) == pytest.approx(0.0, abs=1e-9)
    assert turn_s(pi / 8) == pytest.approx(pi / 8 / rate)
    assert turn_s(pi / 2) == pytest.approx(pi / 2 / rate)
    assert turn_s(-pi / 2) == pytest.approx(pi / 2 / rate)


def test_turning_is_not_known_on_wide_ground(
    yard: Callable[..., Scene], state: Callable[..., Problem]
) -> None:
    robots = [{"id": "r", "model": "diffdrive", "pose": [4, 10, 0]}]
    problem = state(yard(robots=robots, bounds=[0, 0, 200, 200]), samples=50)
    cells = Fields(problem).static(0, [0]).field[0, 0].size
    assert cells * BEARINGS > MOST_POSES
    assert Fields(problem).turning(0, [0]).size == 0
    assert Fields(problem).turning(0, []).size == 0


@pytest.mark.parametrize(("gap_m", "through"), [(1.55, False), (1.9, True)])
def test_costs_to_go_lead_through_gaps_that_are_wide_enough_alone(
    gap_m: float, through: bool, yard: Callable[..., Scene]
) -> None:
    """A car needs 1.7 m, with its margin and what driving may be off; else round it."""
    low, high = 5.125 - 0.5 * gap_m, 5.125 + 0.5 * gap_m
    wall = [
        {"polygon": [[7, 0], [8, 0], [8, low], [7, low]]},
        {"polygon": [[7, high], [8, high], [8, 12], [7, 12]]},
    ]
    scene = yard(
        bounds=[0, 0, 15, 16],
        obstacles=wall,
        goals=[{"id": "g", "circle": {"center": [12, 5], "radius": 1.0}}],
        robots=[{"id": "r", "model": "car", "pose": [3, 5, 0]}],
    )
    problem = state_mission(scene, 0, PlannerParams(samples=400))
    assert not problem.openings
    guide = Fields(problem).static(0, [0])
    top = float(problem.mission.fleet[0]["limit"][1])
    way_m = top * float(_guide_kernels.guide_at(guide, 0, 0, 3.0, 5.0))
    assert (way_m < 2.0 * 9.0) == through
    assert way_m < inf


def test_joined_cells_lead_through_an_opening(yard: Callable[..., Scene]) -> None:
    """Where others move for long; round the wall there is no way."""
    wall = [
        [[7, 0], [8, 0], [8, 4.4], [7, 4.4]],
        [[7, 5.85], [8, 5.85], [8, 12], [7, 12]],
    ]
    scene = yard(
        bounds=[0, 0, 15, 12],
        obstacles=[{"polygon": corners} for corners in wall],
        goals=[{"id": "g", "circle": {"center": [12, 5], "radius": 1.0}}],
        robots=[{"id": "r", "model": "car", "pose": [3, 5, 0]}],
    )
    problem = state_mission(scene, 0, PlannerParams(samples=400))
    assert problem.openings
    fields, traffic = Fields(problem), FleetTraffic(problem, 1)
    nobody = traffic.around(0, [None], np.zeros(1, bool))
    assert fields.in_time(0, [0], nobody) is fields
    joined = fields.in_time(0, [0], nobody._replace(end=2000))
    assert joined.static(0, [0]).cell > fields.static(0, [0]).cell
    fine_s, joined_s = (
        _guide_kernels.guide_at(one.static(0, [0]), 0, 0, 3.0, 5.0)
        for one in (fields, joined)
    )
    assert joined_s == pytest.approx(fine_s, rel=0.1)


@pytest.mark.parametrize("inflation", [0.5, -0.5])
def test_costs_to_go_in_time_keep_out_of_where_others_are(
    inflation: float, yard: Callable[..., Scene], state: Callable[..., Problem]
) -> None:
    """Against shapely: of a hauler that turns and then stands for good."""
    fleet = {"r1": ("car", [4, 16, 0]), "r2": ("hauler", [10, 9, 0.3])}
    scene = yard(
        robots=[
            {"id": name, "model": model, "pose": pose}
            for name, (model, pose) in fleet.items()
        ]
    )
    problem = state(scene, samples=50)
    steps = np.linspace(0.0, 1.0, 60)[:, None]
    drive = np.array([10.0, 9.0, 0.3, 0.0, 0.0]) + steps * [6.0, 3.5, 0.9, 0.0, 0.0]
    motions = [None, Motion(drive, np.zeros((len(drive) - 1, 2)))]
    traffic = FleetTraffic(problem, 200).around(0, motions, np.array([False, True]))
    traffic = traffic._replace(end=200)
    fields = Fields(problem)
    free = np.isfinite(fields.static(0, [0]).field[0, 0])
    guide, _ = fields.timed(0, [0], np.zeros(1, int), traffic, (0.3, 1.0), inflation)
    own, other = problem.mission.fleet
    model = scene.robots[0].model
    near_m = model.inscribed_radius_m + max(own["spacing"], other["spacing"])
    near_m += inflation * guide.cell
    _, layers, rows, columns = guide.field.shape
    y, x = (guide.cell * (np.mgrid[:rows, :columns] + 0.5)) + [
        [[guide.y_min]],
        [[guide.x_min]],
    ]
    footprint = shapely.Polygon(scene.robots[1].model.footprint_m)
    for t in range(layers):
        px, py, theta = drive[min(t * guide.layer, len(drive) - 1), :3]
        turned = affinity.rotate(footprint, theta, origin=(0, 0), use_radians=True)
        placed = affinity.translate(turned, px, py)
        apart_m = shapely.distance(placed, shapely.points(x, y))
        assert np.isinf(guide.field[0, t][apart_m < near_m - 1e-6]).all()
        if t * guide.layer >= len(drive) - 1:
            beside = free & (apart_m > near_m + 1e-6)
            assert np.isfinite(guide.field[0, t][beside]).all()
    assert layers * guide.layer > 2 * len(drive)


@pytest.mark.parametrize("tour", [[], [0]])
def test_costs_to_go_lead_out_of_the_way_of_others_after_the_last_target(
    tour: list[int], yard: Callable[..., Scene], state: Callable[..., Problem]
) -> None:
    """Of a robot in a dead end, to which another one drives to stay."""
    scene = yard(
        bounds=[0, 0, 21, 10],
        obstacles=[
            {"polygon": [[8, 0], [21, 0], [21, 4.2], [8, 4.2]]},
            {"polygon": [[8, 5.8], [21, 5.8], [21, 10], [8, 10]]},
        ],
        goals=[{"id": "g", "circle": {"center": [20, 5], "radius": 0.4}}],
        robots=[
            {"id": "r1", "model": "diffdrive", "pose": [20, 5, 0]},
            {"id": "r2", "model": "diffdrive", "pose": [2, 5, 0]},
        ],
    )
    problem = state(scene, samples=50)
    drive = np.linspace(2.0, 20.0, 400)[:, None] * [1.0, 0, 0, 0, 0] + [0, 5, 0, 0, 0]
    motions = [None, Motion(drive, np.zeros((len(drive) - 1, 2)))]
    traffic = FleetTraffic(problem, 500).around(0, motions, np.array([False, True]))
    guide, way = Fields(problem).timed(
        0, tour, np.zeros(len(tour), int), traffic, (0.3, 1.0), -0.5
    )

    def rest_s(step: int, x: float, y: float) -> float:
        return float(_guide_kernels.guide_at(guide, len(tour), step, x, y))

    top = float(problem.mission.fleet["limit"][0, 1])
    assert rest_s(0, 4.0, 8.0) == 0.0
    assert (20.0 - 8.0) / top < rest_s(0, 20.0, 5.0) < 3.0 * (20.0 - 8.0) / top
    assert rest_s(400, 20.0, 5.0) == inf
    assert rest_s(400, 4.0, 5.0) == 0.0
    assert way[-1, 0] < 8.0
    assert guide.field.shape[0] == len(tour) + 1


@pytest.mark.parametrize("leg", [0, 1, 7])
def test_who_does_without_costs_to_go_has_none_on_any_leg(leg: int) -> None:
    assert _guide_kernels.guide_at(NO_GUIDE, leg, 0, 3.0, 5.0) == 0.0


def test_costs_to_go_do_not_depend_on_what_was_asked_for_other_robots(
    yard: Callable[..., Scene], state: Callable[..., Problem]
) -> None:
    """One with its back to a wall may stand where equal robots elsewhere may not."""
    poses = {"away": [8, 3, 0], "docked": [0.56, 6, 0]}
    scene = yard(
        bounds=[0, 0, 16, 12],
        goals=[{"id": "g", "circle": {"center": [12, 6], "radius": 0.5}}],
        robots=[{"id": name, "model": "car", "pose": at} for name, at in poses.items()],
    )
    problem = state(scene, samples=50)
    fields = Fields(problem)
    _, docked = (fields.static(r, [0]).field for r in range(2))
    assert np.array_equal(docked, Fields(problem).static(1, [0]).field)
