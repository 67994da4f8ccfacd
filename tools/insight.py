"""What planning makes on its way, as lines: the roadmap, the tours on it, the tree."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from mrmg import seeding
from mrmg.errors import UsageError
from mrmg.planning.guided_tree.planner import Growth, grow_guided_tree
from mrmg.planning.parameters import GUIDED_TREE, PlannerParams, profile_params
from mrmg.planning.problem.problem import state_problem
from mrmg.planning.roadmap.roadmap import build_roadmap
from mrmg.plans import Trajectory
from mrmg.scene.types import Scene
from mrmg.world.world import World


@dataclass(frozen=True, slots=True, kw_only=True)
class Insight:
    """The paths of one attempt at a mission [m].

    Attributes:
        roadmap: edges of the first robot's roadmap, shape (E, 2, 2).
        multiplier: energy of each edge over that of plain ground, shape (E,).
        tours: each robot's tour along the roadmap, shape (n, 2), by robot.
        tree: each robot's edges of the motion tree, shape (V - 1, 2, 2), by robot.
        trajectories: the motions found.
    """

    roadmap: np.ndarray
    multiplier: np.ndarray
    tours: Mapping[str, np.ndarray]
    tree: Mapping[str, np.ndarray]
    trajectories: tuple[Trajectory, ...]


def look_inside(scene: Scene, *, seed: int, params: PlannerParams) -> Insight:
    """Plan a mission by the guided tree, and keep what leads to its first plan.

    Args:
        scene: the mission.
        seed: of all random streams.
        params: parameters; at most `trees` attempts are made.

    Raises:
        UsageError: if no attempt finds a plan.
    """
    if params.planner != GUIDED_TREE:
        params = profile_params("paper")
    world = World.from_scene(scene)
    roadmap = build_roadmap(
        scene,
        world,
        samples=params.samples,
        neighbours=params.neighbours,
        margins=params.margins,
        rng=seeding.stream(seed, "roadmap", 0),
    )
    problem = state_problem(scene, world, roadmap, params)
    for number in range(params.trees):
        draw = seeding.stream_seed(seed, "insight", number)
        growth = grow_guided_tree(problem, params, draw, np.zeros(1, np.bool_))
        if growth.solved:
            first, second, weight = roadmap.edges[0]
            edges = roadmap.arrays.vertex[np.stack([first, second], axis=1)]
            length_m = np.hypot(*(edges[:, 1] - edges[:, 0]).T)
            long = length_m > 0.0  # vertices may lie on one another
            vertices = growth.tree.vertices
            child = np.arange(1, growth.counts["vertices"])
            pieces = vertices.state[np.stack([vertices.parent[child], child], axis=1)]
            ids = [robot.id for robot in scene.robots]
            return Insight(
                roadmap=edges[long],
                multiplier=weight[long].mean(axis=1) / length_m[long],  # there and back
                tours={
                    name: problem.path(at, _first_tour(growth, at))
                    for at, name in enumerate(ids)
                },
                tree={name: pieces[:, :, at, :2] for at, name in enumerate(ids)},
                trajectories=growth.trajectories,
            )
    raise UsageError(f"{scene.name}: no plan was found in {params.trees} attempts")


def _first_tour(growth: Growth, robot: int) -> tuple[int, ...]:
    """Return the tour of a robot at the root of a tree that solved its mission."""
    moves = growth.tree.tours.move[0]
    return tuple(moves[moves[:, 0] == robot, 1].tolist())
