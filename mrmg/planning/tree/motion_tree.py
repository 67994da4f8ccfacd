"""Growing one motion tree, and reading the mission it found.

The work is done in `_tree_kernels`; this module turns scenes into its arrays and a
solved tree back into trajectories and tours.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from mrmg import seeding
from mrmg.planning.parameters import PlannerParams
from mrmg.planning.problem._target_kernels import in_target
from mrmg.planning.problem.problem import Problem
from mrmg.planning.problem.targets import has_options
from mrmg.planning.routing.routing import Routing, tour_room
from mrmg.planning.tree import _groups_kernels, _tree_kernels
from mrmg.planning.tree._groups_kernels import Tree
from mrmg.planning.tree._mission_kernels import TreeMission, TreeParams
from mrmg.planning.tree._staying_kernels import has_visited_station
from mrmg.planning.tree._tree_kernels import Tours
from mrmg.plans import Trajectory

TOUR_ROWS = 2000
"""Most tours one tree may hold."""


def tree_mission(problem: Problem, params: PlannerParams) -> TreeMission:
    """Return a planning problem for the tree's kernels."""
    numbers = tree_params(params)._replace(
        route_margin=problem.route_margin, optioned=has_options(problem.scene)
    )
    return TreeMission(**problem.mission._asdict(), params=numbers)


def tree_params(params: PlannerParams) -> TreeParams:
    """Return the numbers the kernels need."""
    router = params.router
    return TreeParams(
        dt=params.dt_s,
        steps=params.steps,
        max_vertices=params.max_vertices,
        group_alpha=params.group_alpha,
        group_beta=params.group_beta,
        group_lambda=params.group_lambda,
        group_bias=params.group_bias,
        steer_start=params.steer_start,
        steer_decay=params.steer_decay,
        steer_least=params.steer_least,
        region=params.region_m,
        route_margin=params.route_margin,
        optioned=False,
        levels=router.levels,
        iterations=router.iterations,
        alpha=router.alpha,
        rounds=router.rounds,
    )


@dataclass(frozen=True, slots=True)
class Growth:
    """What growing a tree gave.

    Attributes:
        trajectories: of all robots, or empty if the tree found no solution.
        tours: targets each robot visited, in order.
        counts: vertices, groups, router_calls, expansions.
        routing_s: time the router calls took.
        place: where the robots are at each vertex of the tree [m], shape (V, R, 2).
        parent: of each vertex; -1 for the root, shape (V,).
    """

    trajectories: tuple[Trajectory, ...]
    tours: Mapping[str, tuple[str, ...]]
    counts: Mapping[str, int]
    routing_s: float
    place: np.ndarray
    parent: np.ndarray

    @property
    def solved(self) -> bool:
        """Whether the tree reached all goals."""
        return bool(self.trajectories)


def grow_tree(
    problem: Problem,
    params: PlannerParams,
    routing: Routing,
    seed: int,
    halt: np.ndarray,
) -> Growth:
    """Grow one motion tree along given tours.

    Args:
        problem: the mission.
        params: parameters.
        routing: the tours to begin with.
        seed: of the tree's random choices.
        halt: shape (1,); growing ends, without a solution, once it has turned true.
    """
    mission = tree_mission(problem, params)
    robots = len(problem.scene.robots)
    width = tour_room(mission.targets.goals, mission.targets.places)
    tree = _groups_kernels.new_tree(
        params.max_vertices, robots, mission.targets.goals, params.steps
    )
    tours = Tours(
        target=np.zeros((TOUR_ROWS, robots, width), np.int64),
        length=np.zeros((TOUR_ROWS, robots), np.int64),
    )
    for r, tour in enumerate(routing.tours):
        tours.target[0, r, : len(tour)] = tour
        tours.length[0, r] = len(tour)
    counts = np.zeros(6, np.int64)
    leaf = _tree_kernels.grow(
        mission,
        problem.start,
        problem.start_energy,
        np.array([seeding.stream_seed(seed, "tree")], np.uint64),
        tree,
        tours,
        counts,
        halt,
    )
    names = ("vertices", "groups", "router_calls", "expansions", "dead_ends")
    statistics = {name: int(n) for name, n in zip(names, counts, strict=False)}
    routing_s = 1e-9 * int(counts[_tree_kernels.ROUTING_NS])
    size = statistics["vertices"]
    place, parent = tree.state[:size, :, :2].copy(), tree.parent[:size].copy()
    if leaf < 0:
        return Growth((), {}, statistics, routing_s, place, parent)
    branch = _branch(tree, leaf)
    control = _controls(problem, params, tree, branch)
    return Growth(
        tuple(problem.trajectory(r, u) for r, u in enumerate(control.swapaxes(0, 1))),
        _visited_tours(problem, mission, tree, tours, branch),
        statistics,
        routing_s,
        place,
        parent,
    )


def _branch(tree: Tree, leaf: int) -> list[int]:
    """Return the vertices from the root to a leaf."""
    branch = [leaf]
    while tree.parent[branch[-1]] >= 0:
        branch.append(int(tree.parent[branch[-1]]))
    return branch[::-1]


def _controls(
    problem: Problem, params: PlannerParams, tree: Tree, branch: list[int]
) -> np.ndarray:
    """Return the controls along a branch and the braking after it, shape (n, R, 2).

    A mission that is over before it begins still has one step, of standing.
    """
    mission = problem.mission
    stop = _tree_kernels.stop_all(
        mission.fleet, mission.gates, tree.state[branch[-1]], params.dt_s
    )
    pieces = [tree.control[v, : tree.steps[v]] for v in branch[1:]]
    control = np.concatenate([*pieces, stop])
    return control if len(control) else np.zeros((1, len(problem.start), 2))


def _visited_tours(
    problem: Problem, mission: TreeMission, tree: Tree, tours: Tours, branch: list[int]
) -> dict[str, tuple[str, ...]]:
    """Return what each robot visited: goals it was first at, stations it drove to."""
    robots, targets = problem.scene.robots, mission.targets
    found: list[list[int]] = [[] for _ in robots]
    seen = np.zeros(targets.goals, bool)
    for v in branch:
        parent = int(tree.parent[v])
        for r in range(len(robots)):
            x, y = tree.state[v, r, :2]
            t = _target_at(tree, tours, parent, r) if parent >= 0 else -1
            for g in np.flatnonzero(tree.visited[v] & ~seen):
                if in_target(targets, g, x, y) and (targets.dwell[g] == 0.0 or g == t):
                    found[r].append(int(g))
                    seen[g] = True
            if t >= 0 and has_visited_station(
                mission,
                r,
                t,
                tree.state[v, r],
                tree.serving[v, r],
                tree.spent[v, r],
                tree.energy[v, r],
            ):
                found[r].append(t)
    return problem.visits(found)


def _target_at(tree: Tree, tours: Tours, v: int, r: int) -> int:
    """Return robot r's next target at vertex v, -1 for none."""
    row, place = tree.tour[v], tree.position[v, r]
    return int(tours.target[row, r, place]) if place < tours.length[row, r] else -1
