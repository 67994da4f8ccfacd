"""The roadmap against straight lines, networkx and exact geometry."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import networkx as nx
import numpy as np
import pytest
import shapely

from mrmg import seeding, shipped
from mrmg.planning.roadmap.fleet import travel_classes
from mrmg.planning.roadmap.roadmap import Roadmap, build_roadmap
from mrmg.planning.roadmap.vertices import departure
from mrmg.scene.loading import scene_from_document
from mrmg.scene.margins import Margins
from mrmg.scene.types import Scene
from mrmg.world._kernels import clearance_estimate
from mrmg.world.elevation import height_at
from mrmg.world.world import CELL_M, World


def circle(name: str, x: float, y: float, radius: float = 1.0) -> dict[str, Any]:
    return {"id": name, "circle": {"center": [x, y], "radius": radius}}


def box(
    name: str, x: tuple[float, float], y: tuple[float, float], **more: Any
) -> dict[str, Any]:
    centre = [0.5 * (x[0] + x[1]), 0.5 * (y[0] + y[1])]
    size = [x[1] - x[0], y[1] - y[0]]
    return {"id": name, "box": {"center": centre, "size": size}, **more}


def make_scene(**changes: Any) -> Scene:
    """Return 60 x 40 m with a start at (5, 20), three goals and a station."""
    document = {
        "format": 1,
        "name": "yard",
        "bounds": [0, 0, 60, 40],
        "goals": [circle("a", 55, 20), circle("b", 30, 5), circle("c", 12, 34)],
        "stations": [circle("s", 45, 35)],
        "battery": {"capacity_m": 500},
        "robots": [{"id": "r1", "model": "car", "pose": [5, 20, 0]}],
    }
    return scene_from_document({**document, **changes}, source="yard")


def make_roadmap(
    scene: Scene, *, samples: int = 600, neighbours: int = 12, seed: int = 0
) -> Roadmap:
    return build_roadmap(
        scene,
        World.from_scene(scene),
        samples=samples,
        neighbours=neighbours,
        margins=Margins(),
        rng=seeding.stream(seed, "roadmap"),
    )


def way_to(roadmap: Roadmap, target: int, vertex: int, field: int = 0) -> list[int]:
    """Return the vertices from `vertex` to the target, by successors."""
    way = [vertex]
    while way[-1] != target:
        way.append(int(roadmap.arrays.successor[field, target, way[-1]]))
        assert len(way) <= len(roadmap.arrays.vertex), "a circle"
    return way


def line_of(roadmap: Roadmap, way: list[int]) -> shapely.LineString:
    return shapely.LineString(roadmap.arrays.vertex[way])


WALLS = [
    box("north", (20, 22), (14, 40), height=1),
    box("south", (38, 40), (0, 26), height=1),
]


# --- distances ---------------------------------------------------------------------


def test_on_an_empty_map_ways_are_nearly_straight() -> None:
    scene = make_scene()
    roadmap = make_roadmap(scene)
    centre = np.array([target.region.center for target in scene.targets()])
    straight = np.hypot(*(centre - (5.0, 20.0)).T)
    assert (roadmap.start_distance[0] >= straight - 1e-9).all()
    assert (roadmap.start_distance[0] <= 1.05 * straight).all()


@pytest.mark.parametrize("obstacles", [[], WALLS], ids=["empty", "walls"])
def test_the_distance_matrix_is_a_metric(obstacles: list[dict[str, Any]]) -> None:
    d = make_roadmap(make_scene(obstacles=obstacles)).distance[0]
    assert d == pytest.approx(d.T)
    assert (np.diag(d) == 0.0).all()
    assert (d[~np.eye(len(d), dtype=bool)] > 0.0).all()
    through = d[:, :, None] + d[None, :, :]
    assert (d[:, None, :] <= through + 1e-9).all()


def test_walls_force_ways_round_their_ends() -> None:
    """Against the exact shortest way past the two inflated corners."""
    scene = make_scene(obstacles=WALLS)
    corners = [(5, 20), (20, 14), (22, 14), (38, 26), (40, 26), (55, 20)]
    taut = shapely.LineString(corners).length
    way = make_roadmap(scene).start_distance[0, 0]
    assert taut < way < 1.2 * taut


def test_goals_behind_closed_walls_are_infinitely_far() -> None:
    closed = box("wall", (20, 22), (0, 40), height=1)
    roadmap = make_roadmap(make_scene(obstacles=[closed]))
    assert np.isfinite(roadmap.start_distance[0]).tolist() == [
        False,  # a, beyond
        False,  # b, beyond
        True,  # c, on the robot's side
        False,  # the station
    ]
    assert np.isinf(roadmap.distance[0, 0, 2])
    assert np.isfinite(roadmap.distance[0, 0, 1])


@pytest.mark.parametrize(
    ("width_m", "passable"),
    [
        (1.4, False),  # a car of 1.1 m with less than its margin on both sides
        (2.2, True),
        (3.0, True),
        (6.0, True),
    ],
)
def test_gaps_are_passable_from_the_passage_width_on(
    width_m: float, passable: bool
) -> None:
    half = 0.5 * width_m
    for at in (20.0, 20.11):  # on and off the grid of cells
        wall = [
            box("low", (28, 32), (0, at - half), height=1),
            box("high", (28, 32), (at + half, 40), height=1),
        ]
        scene = make_scene(obstacles=wall, goals=[circle("a", 55, 20)], stations=[])
        roadmap = make_roadmap(scene)
        assert np.isfinite(roadmap.start_distance[0, 0]) == passable


# --- terrain -----------------------------------------------------------------------


@pytest.mark.parametrize(
    ("multiplier", "detour"),
    [
        (8.0, True),  # round the mud: about 60 m against 50 + 7 * 10
        (1.1, False),  # straight on: 51 m
    ],
)
def test_the_cheaper_of_mud_and_detour_is_taken(
    multiplier: float, detour: bool
) -> None:
    mud = box("mud", (25, 35), (6, 34), multiplier=multiplier)
    scene = make_scene(terrain=[mud], goals=[circle("a", 55, 20)])
    roadmap = make_roadmap(scene, samples=1500)
    way = line_of(roadmap, way_to(roadmap, 0, len(scene.targets())))
    in_mud = way.intersection(scene.terrain[0].shape).length
    corners = [(5, 20), (25, 34), (35, 34), (55, 20)]
    if detour:
        assert in_mud < 0.5
        round_it = shapely.LineString(corners).length
        assert roadmap.start_distance[0, 0] == pytest.approx(round_it, rel=0.05)
    else:
        assert in_mud > 9.0
        assert roadmap.start_distance[0, 0] == pytest.approx(51.0, rel=0.05)


def test_uniform_terrain_scales_every_distance() -> None:
    """Vertices come from terrain borders too, so only the optimum is compared."""
    field = box("field", (-1, 61), (-1, 41), multiplier=3)
    plain = make_roadmap(make_scene()).start_distance
    heavy = make_roadmap(make_scene(terrain=[field])).start_distance
    assert heavy == pytest.approx(3.0 * plain, rel=0.03)


# --- the graph ---------------------------------------------------------------------


@pytest.fixture(scope="module")
def walled() -> tuple[Scene, Roadmap]:
    """Two walls and mud: 300 samples."""
    mud = box("mud", (44, 58), (10, 16), multiplier=4)
    scene = make_scene(obstacles=WALLS, terrain=[mud])
    return scene, make_roadmap(scene, samples=300)


def test_networkx_finds_the_same_distances(walled: tuple[Scene, Roadmap]) -> None:
    scene, roadmap = walled
    graph = roadmap.graph()
    assert graph.number_of_nodes() == len(roadmap.arrays.vertex)
    for target in range(len(scene.targets())):
        lengths = nx.single_source_dijkstra_path_length(graph, target)
        expected = np.full(len(roadmap.arrays.vertex), np.inf)
        expected[list(lengths)] = list(lengths.values())
        field = roadmap.arrays.cost_to_go[0, target]
        assert field == pytest.approx(expected)


def test_successors_lead_to_the_target_at_the_stated_cost(
    walled: tuple[Scene, Roadmap],
) -> None:
    scene, roadmap = walled
    graph = roadmap.graph()
    for target in range(len(scene.targets())):
        field = roadmap.arrays.cost_to_go[0, target]
        for vertex in range(0, len(field), 7):
            if np.isinf(field[vertex]):
                assert roadmap.arrays.successor[0, target, vertex] == -1
                continue
            way = way_to(roadmap, target, vertex)
            weight = nx.path_weight(graph, way, "weight")
            assert weight == pytest.approx(field[vertex])


def test_edges_keep_the_passage_clear(walled: tuple[Scene, Roadmap]) -> None:
    scene, roadmap = walled
    world = World.from_scene(scene)
    (_, passage, _), *_ = travel_classes(scene, world, Margins())[0]
    walls = shapely.union_all([world.obstacles[0], shapely.box(*scene.bounds).exterior])
    first, second, weight = roadmap.edges[0]
    lines = shapely.linestrings(
        np.stack([roadmap.arrays.vertex[first], roadmap.arrays.vertex[second]], axis=1)
    )
    assert shapely.distance(lines, walls).min() >= passage - 0.5 * CELL_M
    assert (weight >= shapely.length(lines)[:, None] - 1e-9).all()
    assert np.array_equal(weight[:, 0], weight[:, 1])
    assert len(weight) > len(roadmap.arrays.vertex)


def test_targets_and_starts_come_first(walled: tuple[Scene, Roadmap]) -> None:
    scene, roadmap = walled
    fixed = [target.region.center for target in scene.targets()]
    fixed += [robot.pose[:2] for robot in scene.robots]
    assert roadmap.arrays.vertex[: len(fixed)] == pytest.approx(np.array(fixed))
    start = roadmap.arrays.cost_to_go[0, :, len(scene.targets())]
    assert roadmap.start_distance[0].tolist() == start.tolist()


def test_buckets_hold_every_vertex_once(walled: tuple[Scene, Roadmap]) -> None:
    arrays = walled[1].arrays
    buckets = arrays.buckets
    assert sorted(buckets.member.tolist()) == list(range(len(arrays.vertex)))
    for b in range(buckets.rows * buckets.columns):
        held = buckets.member[buckets.start[b] : buckets.start[b + 1]]
        row, column = divmod(b, buckets.columns)
        corner = np.array([column, row]) * buckets.side
        offset = arrays.vertex[held] - corner - (buckets.x_min, buckets.y_min)
        assert ((offset >= 0.0) & (offset <= buckets.side)).all()


# --- vertices ----------------------------------------------------------------------


def test_narrow_corridors_have_vertices_in_their_middle() -> None:
    """Without any samples: from the ridge of the distance field."""
    rows = [
        box("low", (10, 50), (0, 18.5), height=1),
        box("high", (10, 50), (21.5, 40), height=1),
    ]
    scene = make_scene(obstacles=rows, goals=[circle("a", 55, 20)], stations=[])
    roadmap = make_roadmap(scene, samples=0)
    vertex = roadmap.arrays.vertex
    middle = vertex[(np.abs(vertex[:, 1] - 20.0) <= CELL_M) & (vertex[:, 0] > 12)]
    x = np.sort(middle[middle[:, 0] < 48, 0])
    assert np.diff(x).max() <= 2.0
    assert roadmap.start_distance[0, 0] == pytest.approx(50.0, rel=0.1)


def test_the_same_stream_gives_the_same_roadmap() -> None:
    scene = make_scene(obstacles=WALLS)
    first, second = (make_roadmap(scene, seed=3) for _ in range(2))
    other = make_roadmap(scene, seed=4)
    assert np.array_equal(first.arrays.vertex, second.arrays.vertex)
    assert np.array_equal(first.arrays.cost_to_go, second.arrays.cost_to_go)
    assert np.array_equal(first.arrays.successor, second.arrays.successor)
    assert not np.array_equal(first.arrays.vertex, other.arrays.vertex)


# --- slopes ------------------------------------------------------------------------

RIDGE = {"hills": [{"center": [28, 20], "height": 1.9, "radius": 15}]}


def regenerating(tmp_path: Path, share: float) -> str:
    """Return a model like the car that feeds back a share of what it brakes."""
    folder = tmp_path / f"car{share:g}"
    shutil.copytree(shipped.models_folder() / "car", folder)
    text = (folder / "robot.yaml").read_text()
    old = "regeneration_efficiency: 0.0"
    assert old in text
    (folder / "robot.yaml").write_text(text.replace(old, f"{old[:-3]}{share}"))
    return str(folder)


@pytest.mark.parametrize("share", [0.0, 0.6])
def test_ways_up_and_down_a_ramp_in_closed_form(tmp_path: Path, share: float) -> None:
    """5 % up or down; rolling takes 6 %, so that no way brakes."""
    robots = [{"id": "r", "model": regenerating(tmp_path, share), "pose": [5, 20, 0]}]
    goals = [circle("low", 8, 20), circle("high", 52, 20)]
    ramp = {"grid": [[0, 3.0]] * 2}
    scene = make_scene(goals=goals, stations=[], robots=robots, elevation=ramp)
    d = make_roadmap(scene).distance[0]
    climb_m = 44.0 * 0.05 / 0.06
    detour_m = 2.0  # as on the flat, ways over vertices are not quite straight
    assert 44.0 + climb_m - 1e-6 <= d[0, 1] <= 44.0 + climb_m + detour_m
    assert 44.0 - climb_m - 1e-6 <= d[1, 0] <= 44.0 - climb_m + detour_m


def test_steep_descents_count_little_without_and_nothing_with_regeneration(
    tmp_path: Path,
) -> None:
    """10 % down, more than rolling takes."""
    goals = [circle("low", 8, 20), circle("high", 52, 20)]
    for share, expected_m in ((0.0, 0.1 * 44.0), (0.6, 0.0)):
        model = regenerating(tmp_path, share)
        robots = [{"id": "r", "model": model, "pose": [5, 20, 0]}]
        ramp = {"grid": [[0, 6.0]] * 2}
        scene = make_scene(goals=goals, stations=[], robots=robots, elevation=ramp)
        roadmap = make_roadmap(scene)
        assert roadmap.distance[0, 1, 0] == pytest.approx(expected_m, rel=0.05)
        assert (roadmap.arrays.cost_to_go >= 0.0).all()


@pytest.mark.parametrize("share", [0.0, 0.6])
def test_fields_are_shortest_ways_of_the_directed_graph(
    tmp_path: Path, share: float
) -> None:
    """Against Bellman-Ford on the exported graph, whose weights may be negative."""
    robots = [{"id": "r", "model": regenerating(tmp_path, share), "pose": [5, 20, 0]}]
    scene = make_scene(robots=robots, elevation=RIDGE)
    roadmap = make_roadmap(scene, samples=150)
    graph = roadmap.graph()
    assert graph.is_directed()
    weights = [weight for *_, weight in graph.edges.data("weight")]
    assert (min(weights) < 0.0) == (share > 0.0)
    start = len(scene.targets())
    against = graph.reverse(copy=False)
    heights = np.array([graph.nodes[v]["z_m"] for v in graph])
    refund = roadmap.arrays.slope_refund[0]
    for target in range(len(scene.targets())):
        exact = nx.single_source_bellman_ford_path_length(against, target)
        field = roadmap.arrays.cost_to_go[0, target]
        for vertex, cost in exact.items():
            rise = heights[target] - heights[vertex]
            assert field[vertex] + refund * rise == pytest.approx(cost, abs=1e-6)
        told = roadmap.start_distance[0, target]
        assert told == pytest.approx(max(exact[start], 0.0))


def test_a_way_leads_round_a_hill_where_that_is_cheaper() -> None:
    scene = make_scene(elevation=RIDGE)
    flat, hilly = make_roadmap(make_scene()), make_roadmap(scene)
    start = len(scene.targets())
    over, around = (
        line_of(roadmap, way_to(roadmap, 0, start)) for roadmap in (flat, hilly)
    )
    points = shapely.get_coordinates(shapely.segmentize(over, 1.0))
    assert height_at(scene, points).max() > 1.7
    points = shapely.get_coordinates(shapely.segmentize(around, 1.0))
    assert height_at(scene, points).max() < 0.9
    assert around.length > over.length + 1.0


# --- special scenes ----------------------------------------------------------------


def test_a_goal_at_the_start_is_no_way_away() -> None:
    scene = make_scene(goals=[circle("here", 5, 20), circle("a", 55, 20)])
    roadmap = make_roadmap(scene, samples=300)
    assert roadmap.start_distance[0, 0] == 0.0
    assert roadmap.start_distance[0, 1] == pytest.approx(roadmap.distance[0, 0, 1])


def test_a_scene_without_targets_has_a_roadmap() -> None:
    roadmap = make_roadmap(make_scene(goals=[], stations=[]), samples=100)
    assert roadmap.distance.shape == (1, 0, 0)
    assert roadmap.start_distance.shape == (1, 0)


def test_very_few_vertices_are_enough() -> None:
    scene = make_scene(goals=[circle("a", 55, 20)], stations=[])
    roadmap = make_roadmap(scene, samples=0, neighbours=12)
    assert np.isfinite(roadmap.start_distance).all()


def test_obstacles_for_one_robot_only_lengthen_its_ways_alone() -> None:
    kerb = box("kerb", (30, 32), (0, 40), height=0.3, blocks=["r1"])
    robots = [
        {"id": "r1", "model": "car", "pose": [5, 10, 0]},
        {"id": "r2", "model": "car", "pose": [5, 20, 0]},
    ]
    scene = make_scene(obstacles=[kerb], robots=robots, goals=[circle("a", 55, 20)])
    roadmap = make_roadmap(scene)
    assert np.isinf(roadmap.start_distance[0, 0])
    assert roadmap.start_distance[1, 0] == pytest.approx(50.0, rel=0.05)
    assert roadmap.distance.shape[0] == 2


def test_a_goal_with_a_tight_centre_is_entered_where_there_is_room() -> None:
    """A post in the middle of the goal."""
    post = box("post", (54.7, 55.3), (19.7, 20.3), height=1)
    scene = make_scene(obstacles=[post], goals=[circle("a", 55, 20, 2.5)])
    roadmap = make_roadmap(scene)
    assert np.isfinite(roadmap.start_distance[0, 0])
    assert scene.goals[0].region.depth(roadmap.arrays.vertex[0])[0] >= 0.0


def test_room_in_a_goal_is_looked_for_with_every_robots_eyes() -> None:
    """The centre is free for r2 alone; r1, which cannot enter at all, has no say."""
    fence = box("fence", (48, 60), (10, 30), height=1, blocks=["r1"])
    post = box("post", (48, 54.6), (10, 30), height=1)
    robots = [
        {"id": "r1", "model": "car", "pose": [5, 10, 0]},
        {"id": "r2", "model": "car", "pose": [5, 20, 0]},
    ]
    scene = make_scene(
        obstacles=[fence, post], robots=robots, goals=[circle("a", 55, 20, 2.0)]
    )
    roadmap = make_roadmap(scene)
    assert np.isinf(roadmap.start_distance[0, 0])
    assert np.isfinite(roadmap.start_distance[1, 0])


@pytest.mark.parametrize(
    ("pose", "way"),
    [
        ([0.4, 20, 0.0], [1.0, 0.0]),  # its back to the map's edge: straight ahead
        ([0.4, 8, 0.0], None),  # a shed is in its way
        ([40, 39.55, -np.pi / 2], [0.0, -1.0]),
        ([29.55, 12, 0.0], [-1.0, 0.0]),  # its rear axle between walls: back
    ],
)
def test_robots_leave_walls_straight(
    pose: list[float], way: list[float] | None
) -> None:
    """A car's rear axle is nearer to a wall behind it than half its width."""
    sheds = [
        {"id": "ahead", "box": {"center": [3.2, 8], "size": [2, 6]}},
        {"id": "left", "box": {"center": [31, 12.8], "size": [3.5, 0.3]}},
        {"id": "right", "box": {"center": [31, 11.2], "size": [3.5, 0.3]}},
    ]
    robot = {"id": "r1", "model": "car", "pose": pose}
    scene = make_scene(robots=[robot], obstacles=sheds)
    world = World.from_scene(scene)
    classes, _ = travel_classes(scene, world, Margins())
    space, passage = world.spaces[0], classes[0].passage
    places = departure(scene.robots[0], space, world.obstacles[0], passage)
    roadmap = make_roadmap(scene)
    joined = np.isfinite(roadmap.start_distance).any()
    assert joined == (way is not None)
    assert len(places) == joined
    if way is None:
        return
    apart = places[0] - pose[:2]
    far_m = float(np.hypot(*apart))
    assert apart / far_m == pytest.approx(way, abs=1e-9)
    assert clearance_estimate(space, *places[0]) >= passage
    model = scene.robots[0].model
    bodies = model.footprint_at([pose, [*places[0], pose[2]]])
    swept = shapely.MultiPoint(bodies.reshape(-1, 2)).convex_hull
    assert not any(swept.intersects(shed.shape) for shed in scene.obstacles)
    assert roadmap.start_distance[0, 0] >= np.hypot(55 - pose[0], 20 - pose[1]) - 2.0
