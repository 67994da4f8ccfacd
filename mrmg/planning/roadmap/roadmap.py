"""ConstructPRM: a probabilistic roadmap with energy-weighted edges.

Vertices are goals, stations, robot starts, points around obstacle corners and terrain
borders, and free samples. An edge's weight is the integral of the terrain multiplier
along it, in metres of plain ground (a robot's energy is that times its J/m on plain
ground), and on slopes depends on the direction (`slopes`); dynamics are neglected,
obstacles and clearance are not. One Dijkstra per target, against the edges, gives the
cost-to-go fields the steering descends and the distance matrix the router needs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import shapely

from mrmg.planning.roadmap import _graph_kernels, _roadmap_kernels
from mrmg.planning.roadmap._roadmap_kernels import RoadmapArrays
from mrmg.planning.roadmap.fleet import TravelClass, travel_classes
from mrmg.planning.roadmap.slopes import SlopeCost
from mrmg.scene.types import Region, Scene
from mrmg.world._kernels import FreeSpace
from mrmg.world.relief import height_at
from mrmg.world.world import World

if TYPE_CHECKING:
    import networkx as nx

BUCKET_M = 4.0

SPREAD = np.array([0.7548776662466927, 0.5698402909980532])
"""Steps of the R2 sequence (Roberts 2018): 1/p, 1/p^2 with p^3 = p + 1. From a random
start it covers the square evenly; scipy's own sequences take 0.6 s to import."""

ENTRY_DEPTH_M = 0.3
"""How deep inside a region a vertex lies that stands for having entered it [m]."""

NARROW_M = 2.5
"""Clearance below which the middle of a place gets vertices of its own [m]."""


@dataclass(frozen=True, slots=True)
class Roadmap:
    """A roadmap per travel class over common vertices.

    Attributes:
        arrays: what the kernels use.
        distance: the distance matrix: cost from target to target [m of plain ground],
            shape (F, T, T).
        start_distance: from each robot's start to each target, shape (R, T).
        edges: (first, second) vertex and cost of each class's edges there and back,
            shape (n,), (n,) and (n, 2).
        targets: ids of the targets, which are the first vertices.
        height_m: of the vertices, shape (V,); None on flat ground.
    """

    arrays: RoadmapArrays
    distance: np.ndarray
    start_distance: np.ndarray
    edges: tuple[tuple[np.ndarray, np.ndarray, np.ndarray], ...]
    targets: tuple[str, ...]
    height_m: np.ndarray | None

    def graph(self, travel_class: int = 0) -> nx.Graph:
        """Return one class's roadmap as a networkx graph for analysis and export.

        Nodes have `x_m` and `y_m`, and targets a `target`; edges have `weight`, metres
        of plain ground. On slopes the graph is directed and nodes have `z_m`; a weight
        is negative where regeneration feeds back more than driving takes.
        """
        import networkx as nx

        graph: nx.Graph
        graph = nx.Graph() if self.height_m is None else nx.DiGraph()
        for i, (x, y) in enumerate(self.arrays.vertex):
            graph.add_node(i, x_m=float(x), y_m=float(y))
        for i, name in enumerate(self.targets):
            graph.nodes[i]["target"] = name
        first, second, weight = self.edges[travel_class]
        ways = [(first, second, weight[:, 0])]
        if self.height_m is not None:
            for i, z in enumerate(self.height_m):
                graph.nodes[i]["z_m"] = float(z)
            rise = self.height_m[second] - self.height_m[first]
            potential = self.arrays.slope_refund[travel_class] * rise
            ways = [
                (first, second, weight[:, 0] + potential),
                (second, first, weight[:, 1] - potential),
            ]
        for start, end, cost in ways:
            graph.add_weighted_edges_from(
                zip(start.tolist(), end.tolist(), cost.tolist(), strict=True)
            )
        return graph


def build_roadmap(
    scene: Scene,
    world: World,
    *,
    samples: int,
    neighbours: int,
    margin_m: float,
    rng: np.random.Generator,
) -> Roadmap:
    """Build the roadmap of a scene.

    Args:
        scene: the scene.
        world: its geometry.
        samples: number of free samples tried.
        neighbours: number of nearest vertices each vertex is joined to.
        margin_m: distance robots keep from obstacles.
        rng: source of the samples.
    """
    classes, class_of_robot = travel_classes(scene, world, margin_m)
    vertex = _vertices(scene, world, classes, samples, rng)
    first, second = _candidate_edges(vertex, neighbours)
    n_targets = len(planned_regions(scene))
    fields, successors, distances, edges, ways_from = [], [], [], [], []
    height_m = None if scene.elevation is None else height_at(scene, vertex)
    for space, passage, slope in classes:
        weight = _roadmap_kernels.edge_costs(
            world.spaces[space],
            world.terrain,
            vertex,
            first,
            second,
            passage,
            slope.price,
            slope.floor,
        )
        usable = np.isfinite(weight[:, 0])
        low, high, weight = first[usable], second[usable], weight[usable]
        edges.append((low, high, weight))
        entries = _entries(scene, vertex, _graph_kernels.parts(len(vertex), low, high))
        cost, successor = _graph_kernels.cheapest_ways(
            len(vertex),
            low,
            high,
            weight,
            np.concatenate([np.zeros(0, np.int64), *entries]),
            np.cumsum([0, *map(len, entries)]),
        )
        fields.append(cost)
        successors.append(successor)
        energies = _with_potential(cost, height_m, slope.refund)
        distances.append([energies[:, sources].min(axis=1) for sources in entries])
        ways_from.append(energies)
    starts = n_targets + np.arange(len(scene.robots))
    return Roadmap(
        arrays=_with_buckets(
            scene,
            vertex,
            np.stack(fields),
            np.stack(successors),
            [slope for _, _, slope in classes],
        ),
        distance=np.array(distances).reshape(len(classes), n_targets, n_targets),
        start_distance=np.stack(
            [ways_from[c][:, v] for c, v in zip(class_of_robot, starts, strict=True)]
        ),
        edges=tuple(edges),
        targets=(
            *(target.id for target in scene.targets()),
            *(f"finish of {robot.id}" for robot in scene.robots if robot.finish),
        ),
        height_m=height_m,
    )


def _with_potential(
    cost: np.ndarray, height_m: np.ndarray | None, refund: float
) -> np.ndarray:
    """Return what the ways of reduced costs really take, at least 0, (T, V)."""
    if height_m is None or refund == 0.0:
        return cost
    rise = height_m[: len(cost), None] - height_m
    return np.asarray(np.maximum(cost + refund * rise, 0.0))


def planned_regions(scene: Scene) -> list[Region]:
    """Return the regions the planner numbers: goals, stations, finishes of robots."""
    finishes = [robot.finish.region for robot in scene.robots if robot.finish]
    return [*(target.region for target in scene.targets()), *finishes]


def _entries(scene: Scene, vertex: np.ndarray, part: np.ndarray) -> list[np.ndarray]:
    """Return the vertices at which each target may be entered.

    That is the target's own vertex, and where a region reaches across a wall, those of
    its vertices that are cut off from it, which is to say in another part.
    """
    entries = []
    for t, region in enumerate(planned_regions(scene)):
        near = np.hypot(*(vertex - region.center).T)
        inside = np.flatnonzero(near < _reach(region))
        inside = inside[region.depth(vertex[inside]) >= ENTRY_DEPTH_M]
        others = inside[part[inside] != part[t]]
        entries.append(np.concatenate([[t], others[others != t]]))
    return entries


def _reach(region: Region) -> float:
    """Return the radius of a region about its centre."""
    if len(region.corners):
        return float(np.hypot(*(region.corners - region.center).T).max())
    return region.radius_m


def _vertices(
    scene: Scene,
    world: World,
    classes: Sequence[TravelClass],
    samples: int,
    rng: np.random.Generator,
) -> np.ndarray:
    x_min, y_min, x_max, y_max = scene.bounds
    fixed = [
        _anchor(scene, world, classes, region) for region in planned_regions(scene)
    ]
    fixed += [np.array(robot.pose[:2]) for robot in scene.robots]
    unit = (rng.random(2) + np.arange(samples)[:, None] * SPREAD) % 1.0
    spread = unit * (x_max - x_min, y_max - y_min) + (x_min, y_min)
    passage = min(item.passage for item in classes)
    rings = [
        *(
            union.simplify(0.05).buffer(passage + 0.15, quad_segs=2)
            for union in world.obstacles
        ),
        *(area.shape.buffer(0.3, quad_segs=1) for area in scene.terrain),
        *(area.shape.buffer(-0.3, quad_segs=1) for area in scene.terrain),
    ]
    corners = shapely.get_coordinates(
        [shapely.segmentize(ring, 8.0) for ring in rings if not ring.is_empty]
    )
    ridges = [_ridge(world.spaces[item.space]) for item in classes]
    inner = [_inner_points(region) for region in planned_regions(scene)]
    loose = np.concatenate([spread, corners.reshape(-1, 2), *ridges, *inner])
    inside = (
        (loose[:, 0] > x_min)
        & (loose[:, 1] > y_min)
        & (loose[:, 0] < x_max)
        & (loose[:, 1] < y_max)
    )
    loose = loose[inside]
    widest = np.max(
        [_field_at(world.spaces[item.space], loose) for item in classes], axis=0
    )
    return np.concatenate([np.array(fixed).reshape(-1, 2), loose[widest >= passage]])


def _inner_points(region: Region) -> np.ndarray:
    """Return points spread over a region, shape (8, 2)."""
    angle = np.linspace(0.0, 2.0 * np.pi, 8, endpoint=False)
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1) * _reach(region)
    points = region.center + 0.7 * ring
    return np.asarray(points[region.depth(points) >= ENTRY_DEPTH_M])


def _ridge(space: FreeSpace) -> np.ndarray:
    """Return points in the middle of narrow places, about one a square metre.

    They are the local maxima of the distance field along x or y; free samples seldom
    hit a corridor's middle.
    """
    d = space.distance
    inner = d[1:-1, 1:-1]
    across = (inner >= d[1:-1, :-2]) & (inner > d[1:-1, 2:])
    along = (inner >= d[:-2, 1:-1]) & (inner > d[2:, 1:-1])
    row, column = np.nonzero((across | along) & (inner > 0.0) & (inner < NARROW_M))
    points = np.stack([column + 1.5, row + 1.5], axis=1) * space.cell
    _, first = np.unique(np.floor(points).astype(int), axis=0, return_index=True)
    return np.asarray(points[np.sort(first)] + (space.x_min, space.y_min))


def _anchor(
    scene: Scene,
    world: World,
    classes: Sequence[TravelClass],
    region: Region,
) -> np.ndarray:
    """Return a region's centre, or its clearest point where the centre is tight."""
    space, passage, _ = classes[0]
    centre = np.asarray(region.center, dtype=float)
    if _field_at(world.spaces[space], centre[None])[0] >= passage:
        return centre
    x0, y0, x1, y1 = region.shape.bounds
    grid = np.stack(
        np.meshgrid(np.linspace(x0, x1, 21), np.linspace(y0, y1, 21)), axis=-1
    ).reshape(-1, 2)
    grid = grid[region.depth(grid) >= 0.0]
    return np.asarray(grid[np.argmax(_field_at(world.spaces[space], grid))])


def _field_at(space: FreeSpace, points: np.ndarray) -> np.ndarray:
    """Return the distance field at the cells of points; -inf outside."""
    rows, columns = space.distance.shape
    column = np.floor((points[:, 0] - space.x_min) / space.cell).astype(int)
    row = np.floor((points[:, 1] - space.y_min) / space.cell).astype(int)
    valid = (column >= 0) & (row >= 0) & (column < columns) & (row < rows)
    value = np.full(len(points), -np.inf)
    value[valid] = space.distance[row[valid], column[valid]]
    return value


def _candidate_edges(
    vertex: np.ndarray, neighbours: int
) -> tuple[np.ndarray, np.ndarray]:
    count = min(neighbours, len(vertex) - 1)
    second = _graph_kernels.nearest_vertices(vertex, count).reshape(-1)
    first = np.repeat(np.arange(len(vertex)), count)
    low, high = np.minimum(first, second), np.maximum(first, second)
    pair = np.unique(low * len(vertex) + high)
    return pair // len(vertex), pair % len(vertex)


def _with_buckets(
    scene: Scene,
    vertex: np.ndarray,
    cost_to_go: np.ndarray,
    successor: np.ndarray,
    slopes: Sequence[SlopeCost],
) -> RoadmapArrays:
    x_min, y_min, x_max, y_max = scene.bounds
    columns = int(np.ceil((x_max - x_min) / BUCKET_M))
    rows = int(np.ceil((y_max - y_min) / BUCKET_M))
    column = np.clip(((vertex[:, 0] - x_min) / BUCKET_M).astype(int), 0, columns - 1)
    row = np.clip(((vertex[:, 1] - y_min) / BUCKET_M).astype(int), 0, rows - 1)
    key = row * columns + column
    count = np.bincount(key, minlength=rows * columns)
    return RoadmapArrays(
        vertex=vertex,
        cost_to_go=cost_to_go,
        successor=successor,
        slope_price=np.array([slope.price for slope in slopes]),
        slope_floor=np.array([slope.floor for slope in slopes]),
        slope_refund=np.array([slope.refund for slope in slopes]),
        x_min=float(x_min),
        y_min=float(y_min),
        bucket=BUCKET_M,
        columns=columns,
        rows=rows,
        bucket_start=np.concatenate([[0], np.cumsum(count)]),
        bucket_vertex=np.argsort(key, kind="stable"),
    )
