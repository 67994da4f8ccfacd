"""ConstructPRM: a probabilistic roadmap with energy-weighted edges.

Vertices are goals, stations, robot starts, points around obstacle corners and terrain
borders, free samples, and where robots that start beside walls have driven clear. An
edge's weight is the integral of the terrain multiplier along it, in metres of plain
ground (a robot's energy is that times its J/m on plain ground), and on slopes depends
on the direction (`slopes`); dynamics are neglected, obstacles and clearance are not.
One Dijkstra per target, against the edges, gives the cost-to-go fields the steering
descends and the distance matrix the router needs.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components, dijkstra

from mrmg.planning.halting import NEVER, check
from mrmg.planning.roadmap import _roadmap_kernels
from mrmg.planning.roadmap._bucket_kernels import Buckets, nearest_vertices
from mrmg.planning.roadmap._roadmap_kernels import RoadmapArrays
from mrmg.planning.roadmap.fleet import TravelClass, travel_classes
from mrmg.planning.roadmap.vertices import (
    ENTRY_DEPTH_M,
    departure,
    planned_regions,
    reach_m,
    roadmap_vertices,
)
from mrmg.scene.margins import Margins
from mrmg.scene.types import Scene
from mrmg.world.elevation import height_at
from mrmg.world.world import World

if TYPE_CHECKING:
    import networkx as nx

BUCKET_M = 4.0
"""Side of the squares in which vertices near a robot are looked up [m]."""

BUCKET_CROWD = 3
"""Vertices in a square of the search for neighbours, about."""


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
    margins: Margins,
    rng: np.random.Generator,
    halt: np.ndarray = NEVER,
) -> Roadmap:
    """Build the roadmap of a scene.

    Args:
        scene: the scene.
        world: its geometry.
        samples: number of free samples tried.
        neighbours: number of nearest vertices each vertex is joined to.
        margins: stated for all robots; each one's own count where they state none.
        rng: source of the samples.
        halt: shape (1,); raises Halted once it has turned true.
    """
    classes, class_of_robot = travel_classes(scene, world, margins)
    n_targets = len(planned_regions(scene))
    starts = n_targets + np.arange(len(scene.robots))
    vertex = roadmap_vertices(scene, world, classes, samples, rng)
    places = [
        _ways_begin_at(scene, world, r, classes[c], vertex[starts[r]])
        for r, c in enumerate(class_of_robot)
    ]
    vertex = np.concatenate([vertex, *places])
    left = np.repeat(starts, [*map(len, places)])
    leaving = left, len(vertex) - len(left) + np.arange(len(left))
    height_m = None if scene.elevation is None else height_at(scene, vertex)
    ends = _candidate_edges(vertex, neighbours)
    edges, cost, successor, energy, distance = zip(
        *(
            _cheapest_paths(scene, world, one, vertex, ends, leaving, height_m, halt)
            for one in classes
        ),
        strict=True,
    )
    return Roadmap(
        arrays=RoadmapArrays(
            vertex=vertex,
            cost_to_go=_stacked(cost),
            successor=_stacked(successor),
            slope_refund=np.array([one.slope.refund for one in classes]),
            buckets=_buckets(vertex, scene.bounds[:2], scene.bounds[2:], BUCKET_M),
        ),
        distance=np.array(distance).reshape(len(classes), n_targets, n_targets),
        start_distance=np.stack(
            [energy[c][:, v] for c, v in zip(class_of_robot, starts, strict=True)]
        ),
        edges=edges,
        targets=(
            *(target.id for target in scene.targets()),
            *(f"finish of {robot.id}" for robot in scene.robots if robot.finish),
        ),
        height_m=height_m,
    )


def _ways_begin_at(
    scene: Scene, world: World, r: int, travel_class: TravelClass, start: np.ndarray
) -> np.ndarray:
    """Return where robot r's ways begin if none can at its start, (0 or 1, 2)."""
    here = np.zeros(1, np.int64)
    if np.isfinite(edge_costs(world, travel_class, start[None], (here, here))).all():
        return np.zeros((0, 2))
    space, passage, _ = travel_class
    return departure(
        scene.robots[r], world.spaces[space], world.obstacles[space], passage
    )


def _cheapest_paths(
    scene: Scene,
    world: World,
    travel_class: TravelClass,
    vertex: np.ndarray,
    ends: tuple[np.ndarray, np.ndarray],
    leaving: tuple[np.ndarray, np.ndarray],
    height_m: np.ndarray | None,
    halt: np.ndarray,
) -> tuple[
    tuple[np.ndarray, ...], np.ndarray, np.ndarray, np.ndarray, list[np.ndarray]
]:
    """Weigh candidate edges for a travel class, and find its cheapest paths.

    Returns:
        (edges, cost, successor, energy, distance): first and second vertex of edges
        and cost there and back; of each vertex's path to each target, shape (T, V), and
        what the paths really take, likewise; and that of the paths from target to
        target, shape (T, T).
    """
    weight = np.concatenate(
        [
            edge_costs(world, travel_class, vertex, ends),
            edge_costs(world, travel_class.leaving, vertex, leaving),
        ]
    )
    low, high = np.concatenate([ends, leaving], axis=1)
    usable = np.isfinite(weight[:, 0])
    low, high, weight = low[usable], high[usable], weight[usable]
    ends = np.concatenate([high, low]), np.concatenate([low, high])
    backwards = csr_array((weight.T.ravel(), ends), shape=(len(vertex), len(vertex)))
    entries = _entries(scene, vertex, connected_components(backwards, False)[1])
    cost = np.empty((len(entries), len(vertex)))
    successor = np.empty(cost.shape, np.int32)
    for t, own in enumerate(entries):
        check(halt)
        cost[t], before, _ = dijkstra(
            backwards, indices=own, min_only=True, return_predecessors=True
        )
        successor[t] = np.maximum(before, -1)
    energy = _with_potential(cost, height_m, travel_class.slope.refund)
    distance = [energy[:, sources].min(axis=1) for sources in entries]
    return (low, high, weight), cost, successor, energy, distance


def edge_costs(
    world: World,
    travel_class: TravelClass,
    vertex: np.ndarray,
    ends: tuple[np.ndarray, np.ndarray],
) -> np.ndarray:
    """Return the costs of edges there and back, inf where blocked, shape (n, 2).

    Args:
        world: with obstacles and terrain.
        travel_class: of the robots that drive along them.
        vertex: positions [m], shape (V, 2).
        ends: first and second vertices of the edges, shape (n,) each.
    """
    space, passage, slope = travel_class
    cost: np.ndarray = _roadmap_kernels.edge_costs(
        world.spaces[space],
        world.terrain,
        vertex,
        *ends,
        passage,
        slope.price,
        slope.floor,
    )
    return cost


def _stacked(arrays: tuple[np.ndarray, ...]) -> np.ndarray:
    """Return arrays as one; a single one is not copied, as it may be large."""
    return arrays[0][None] if len(arrays) == 1 else np.stack(arrays)


def _with_potential(
    cost: np.ndarray, height_m: np.ndarray | None, refund: float
) -> np.ndarray:
    """Return what the ways of reduced costs really take, at least 0, (T, V)."""
    if height_m is None or refund == 0.0:
        return cost
    rise = height_m[: len(cost), None] - height_m
    return np.asarray(np.maximum(cost + refund * rise, 0.0))


def _entries(scene: Scene, vertex: np.ndarray, part: np.ndarray) -> list[np.ndarray]:
    """Return the vertices at which each target may be entered.

    That is the target's own vertex, and where a region reaches across a wall, those of
    its vertices that are cut off from it, which is to say in another part.
    """
    entries = []
    for t, region in enumerate(planned_regions(scene)):
        near = np.hypot(*(vertex - region.center).T)
        inside = np.flatnonzero(near < reach_m(region))
        inside = inside[region.depth(vertex[inside]) >= ENTRY_DEPTH_M]
        others = inside[part[inside] != part[t]]
        entries.append(np.concatenate([[t], others[others != t]]))
    return entries


def _candidate_edges(
    vertex: np.ndarray, neighbours: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return the ends of edges that join each vertex to its nearest others."""
    count = min(neighbours, len(vertex) - 1)
    low, high = vertex.min(axis=0), vertex.max(axis=0)
    parts = np.ceil(np.sqrt(len(vertex) / BUCKET_CROWD))
    side_m = float((high - low).max() / parts) or 1.0
    second = first = np.zeros(0, np.int64)
    if count:
        buckets = _buckets(vertex, low, high, side_m)
        second = nearest_vertices(buckets, vertex, count).reshape(-1)
        first = np.repeat(np.arange(len(vertex)), count)
    pair = np.minimum(first, second) * len(vertex) + np.maximum(first, second)
    return np.divmod(np.unique(pair), len(vertex))


def _buckets(
    points: np.ndarray, low: ArrayLike, high: ArrayLike, side_m: float
) -> Buckets:
    """Sort points between two corners into squares."""
    x_min, y_min = low = np.asarray(low, float)
    columns, rows = 1 + ((high - low) / side_m).astype(int)
    at = np.clip(((points - low) / side_m).astype(int), 0, (columns - 1, rows - 1))
    key = at[:, 1] * columns + at[:, 0]
    counts = np.bincount(key, minlength=int(rows * columns))
    return Buckets(
        x_min=float(x_min),
        y_min=float(y_min),
        side=side_m,
        columns=int(columns),
        rows=int(rows),
        start=np.concatenate([[0], np.cumsum(counts)]),
        member=np.argsort(key, kind="stable"),
    )
