"""Growing the paper's motion tree in a mission, and ExtractPaths."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from dataclasses import asdict, dataclass

import numpy as np

from mrmg.errors import UsageError
from mrmg.planning.guided_tree._expansion_kernels import BRAKING_STEPS
from mrmg.planning.guided_tree._growth_kernels import grow
from mrmg.planning.guided_tree._setting_kernels import Rules, Setting
from mrmg.planning.guided_tree._tree_kernels import (
    BETA_SHARE,
    ITERATIONS,
    N_COUNTS,
    ROUTER_CALLS,
    ROUTING_NS,
    VERTICES,
    Groups,
    MotionTree,
    Tours,
    Trace,
    Vertices,
)
from mrmg.planning.guided_tree._tree_kernels import GROUPS as N_GROUPS
from mrmg.planning.parameters import GuidedTreeParams, PlannerParams
from mrmg.planning.problem._target_kernels import in_target
from mrmg.planning.problem.problem import Problem
from mrmg.planning.routing._nrpa_kernels import with_own_tables
from mrmg.plans import Trajectory
from mrmg.scene.types import Scene


@dataclass(frozen=True, slots=True)
class Growth:
    """What growing a tree gave, with the record of every iteration.

    Attributes:
        trajectories: of all robots, the stop at their end included; empty without a
            solution.
        tours: targets each robot visited, in order.
        counts: vertices, groups, router_calls, iterations and their cap.
        routing_s: time the router calls took.
        stop_steps: steps at the end of the trajectories that are the stop, which is
            appended outside Algorithms 1-3.
        tree: what the kernels filled, its trace included; only the first vertices,
            groups, tours and iterations count.
        solution: vertex at which the mission is solved, or -1.
    """

    trajectories: tuple[Trajectory, ...]
    tours: Mapping[str, tuple[str, ...]]
    counts: Mapping[str, int]
    routing_s: float
    stop_steps: int
    tree: MotionTree
    solution: int

    @property
    def solved(self) -> bool:
        """Whether all goals are visited and a collision-free stop exists."""
        return self.solution >= 0


def grow_guided_tree(
    problem: Problem, params: PlannerParams, seed: int, halt: np.ndarray
) -> Growth:
    """Grow one motion tree by Algorithms 1-3.

    Args:
        problem: the mission, with the roadmap that ConstructPRM returned.
        params: parameters; `params.guided_tree` and `params.router` are the method's.
        seed: of all random choices.
        halt: shape (1,); growing ends, without a solution, once it has turned true.

    Raises:
        UsageError: if so large a tree as it may become has no room in memory.
    """
    try:
        tree = new_tree(problem.scene, params.guided_tree, seed)
    except MemoryError as error:
        raise UsageError(
            f"{problem.scene.name}: a guided tree of up to "
            f"{params.guided_tree.iterations} iterations has no room in memory for so "
            "large a mission; plan it with --planner path_following (profile default)"
        ) from error
    solution, stop_steps = grow(
        setting_of(problem),
        rules_of(problem, params),
        problem.start.copy(),
        problem.start_energy.copy(),
        tree,
        halt,
    )
    counts, groups = tree.counts, tree.groups
    highest = BETA_SHARE * params.guided_tree.alpha / max(len(problem.scene.goals), 1)
    beta_dist = highest / groups.scale[0] * groups.dist[: counts[N_GROUPS]]
    assert (beta_dist <= highest).all(), "eq. (5): beta is too large"
    branch = [int(solution)] if solution >= 0 else []
    while branch and tree.vertices.parent[branch[-1]] >= 0:
        branch.append(int(tree.vertices.parent[branch[-1]]))
    branch.reverse()
    return Growth(
        trajectories=_paths(problem, tree, branch, int(stop_steps)),
        tours=_visited(problem, tree, branch),
        counts={
            "vertices": int(counts[VERTICES]),
            "groups": int(counts[N_GROUPS]),
            "router_calls": int(counts[ROUTER_CALLS]),
            "expansions": int(counts[ITERATIONS]),
            "iterations": int(counts[ITERATIONS]),
            "iteration_cap": params.guided_tree.iterations,
        },
        routing_s=1e-9 * int(counts[ROUTING_NS]),
        stop_steps=int(stop_steps),
        tree=tree,
        solution=int(solution),
    )


def setting_of(problem: Problem) -> Setting:
    """Return a mission for the kernels."""
    mission, roadmap = problem.mission, problem.roadmap.arrays
    paths = np.isfinite(roadmap.cost_to_go)
    return Setting(
        fleet=mission.fleet,
        spaces=mission.spaces,
        terrain=mission.terrain,
        targets=mission.targets,
        roadmap=roadmap,
        joined=paths.any(axis=1) | (paths.shape[1] == 0),  # without targets, all
        routing=copy.deepcopy(with_own_tables(mission.routing)),  # kernels write
    )


def rules_of(problem: Problem, params: PlannerParams) -> Rules:
    """Return the parameters for the kernels."""
    return Rules(
        dt_s=params.dt_s,
        route_margin=problem.route_margin,
        levels=params.router.levels,
        nrpa_iterations=params.router.iterations,
        nrpa_alpha=params.router.alpha,
        **asdict(params.guided_tree),
    )


def new_tree(scene: Scene, params: GuidedTreeParams, seed: int) -> MotionTree:
    """Return an empty tree (InitMotionTree), with room for all iterations."""
    robots, goals = len(scene.robots), len(scene.goals)
    n, i = params.iterations * params.k + 1, params.iterations
    leaves = 1 << n.bit_length()
    room = 3 * goals + 4 * robots + len(scene.stations)
    vertices = Vertices(
        state=np.empty((n, robots, 5)),
        energy=np.empty((n, robots)),
        parent=np.empty(n, np.int64),
        iteration=np.empty(n, np.int64),
        depth=np.empty(n, np.int64),
        tour=np.empty(n, np.int64),
        group=np.empty(n, np.int64),
        next=np.empty(n, np.int64),
        to_target_m=np.empty(n),
    )
    groups = Groups(
        region=np.empty((n, robots), np.int64),
        visited=np.empty((n, goals), np.bool_),
        unvisited=np.empty(n, np.int64),
        dist=np.empty(n, np.int64),
        visits=np.empty(n, np.int64),
        first=np.empty(n, np.int64),
        slot=np.zeros(2 * leaves, np.int64),
        total=np.zeros(2 * leaves),
        heaviest=np.zeros(2 * leaves),
        scale=np.ones(1, np.int64),
    )
    tours = Tours(
        move=np.empty((n, room, 2), np.int16),
        first=np.empty((n, robots), np.int16),
        need=np.empty((n, robots)),
    )
    trace = Trace(
        group=np.empty(i, np.int64),
        vertex=np.empty(i, np.int64),
        group_draw=np.empty((i, 2)),
        vertex_draw=np.empty(i),
        scale=np.empty(i, np.int64),
        target=np.empty((i, robots, 2)),
        steer_draw=np.empty((i, robots)),
        control=np.empty((i, robots, 2)),
        ended=np.empty(i, np.int64),
    )
    return MotionTree(
        vertices=vertices,
        groups=groups,
        tours=tours,
        trace=trace,
        counts=np.zeros(N_COUNTS, np.int64),
        random=np.array([seed], np.uint64),
        stop=np.zeros((BRAKING_STEPS, robots, 2)),
    )


def _paths(
    problem: Problem,
    tree: MotionTree,
    branch: list[int],
    stop_steps: int,
) -> tuple[Trajectory, ...]:
    """Return the trajectories along a branch and the stop after it (ExtractPaths).

    A mission that is over before it begins still has one step, of standing.
    """
    if not branch:
        return ()
    held = tree.trace.control[tree.vertices.iteration[branch[1:]]]
    control = np.concatenate([held, tree.stop[:stop_steps]])
    if not len(control):
        control = np.zeros((1, len(problem.start), 2))
    return tuple(problem.trajectory(r, u) for r, u in enumerate(control.swapaxes(0, 1)))


def _visited(
    problem: Problem, tree: MotionTree, branch: list[int]
) -> dict[str, tuple[str, ...]]:
    """Return the goals each robot was first at and the stations it recharged at."""
    targets, robots = problem.mission.targets, problem.scene.robots
    vertices, groups, tours = tree.vertices, tree.groups, tree.tours
    found: list[list[int]] = [[] for _ in robots]
    seen = np.zeros(len(problem.scene.goals), bool)
    row = -1
    for v in branch:
        for r in range(len(robots)):
            x, y = vertices.state[v, r, :2]
            for g in np.flatnonzero(groups.visited[vertices.group[v]] & ~seen):
                if in_target(targets, g, x, y):
                    found[r].append(int(g))
                    seen[g] = True
            t = int(tours.first[row, r]) if row >= 0 else -1
            if t >= len(seen) and in_target(targets, t, x, y):
                found[r].append(t)
        row = int(vertices.tour[v])
    return problem.visits(found)
