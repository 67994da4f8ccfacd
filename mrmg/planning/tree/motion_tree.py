"""Growing one motion tree, and reading the mission it found.

The work is done in `_tree_kernels`; this module turns scenes into its arrays and a
solved tree back into trajectories and tours.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from mrmg import seeding
from mrmg.energy.model import CONSUMERS_W
from mrmg.motion._kernels import step as motion_step
from mrmg.planning.parameters import PlannerParams
from mrmg.planning.preference import Preference
from mrmg.planning.roadmap.fleet import fleet_array, stack_spaces
from mrmg.planning.roadmap.roadmap import Roadmap
from mrmg.planning.routing.routing import Routing, routing_arrays, tour_room
from mrmg.planning.tree import _groups_kernels, _tree_kernels
from mrmg.planning.tree._groups_kernels import Tree
from mrmg.planning.tree._mission_kernels import Mission, TreeParams, in_target
from mrmg.planning.tree._staying_kernels import has_visited_station
from mrmg.planning.tree._tree_kernels import Tours
from mrmg.planning.tree.targets import (
    finish_of,
    gate_arrays,
    has_options,
    target_arrays,
)
from mrmg.planning.tree.timing import routing_times
from mrmg.plans import Trajectory
from mrmg.scene.types import Scene
from mrmg.world.world import World

TOUR_ROWS = 2000
"""Most tours one tree may hold."""


@dataclass(frozen=True, slots=True)
class Problem:
    """A scene and its arrays.

    Attributes:
        scene: the scene.
        roadmap: its roadmap.
        mission: what the kernels work on.
        start: composite state at the start, shape (R, 5).
        start_energy: battery contents at the start [J], shape (R,).
        hurried: whether plans must be sooner over at any cost.
        spare: share of every battery's capacity that plans leave above the reserve.
    """

    scene: Scene
    roadmap: Roadmap
    mission: Mission
    start: np.ndarray
    start_energy: np.ndarray
    hurried: bool = False
    spare: float = 0.0

    @property
    def preference(self) -> Preference:
        """What plans are compared by."""
        return Preference.of(self.scene)

    def with_margin(self, margin: float) -> Problem:
        """Return the problem with another surcharge on the roadmap's energies."""
        routing = self.mission.routing
        share = (1.0 + margin) / (1.0 + self.mission.params.route_margin)
        return replace(
            self,
            mission=self.mission._replace(
                routing=routing._replace(
                    cost=routing.cost * share,
                    escape=routing.escape * share,
                    finish=routing.finish * share,
                    time=routing.time * share,
                    finish_time=routing.finish_time * share,
                ),
                params=self.mission.params._replace(route_margin=margin),
            ),
        )

    def with_spare(self, share: float) -> Problem:
        """Return the problem whose plans leave more in batteries than the reserve.

        Args:
            share: of their capacities, for all of them.
        """
        fleet = self.mission.fleet.copy()
        fleet["reserve"] += (share - self.spare) * fleet["capacity"]
        routing = self.mission.routing._replace(reserve=fleet["reserve"].copy())
        mission = self.mission._replace(fleet=fleet, routing=routing)
        return replace(self, mission=mission, spare=share)

    def with_limit(self, share: float) -> Problem:
        """Return the problem with routes that take a share of the time limit."""
        routing = self.mission.routing
        shorter = routing._replace(limit=share * routing.limit)
        return replace(self, mission=self.mission._replace(routing=shorter))


def state_problem(
    scene: Scene, world: World, roadmap: Roadmap, params: PlannerParams
) -> Problem:
    """Return the scene's problem; routing costs include the route margin."""
    fleet = fleet_array(
        scene,
        world,
        obstacle_margin_m=params.obstacle_margin_m,
        robot_margin_m=params.robot_margin_m,
    )
    places = len(scene.targets())
    targets = target_arrays(scene)
    # What robots draw while they stay counts as way.
    idle_m = fleet["energy"][:, CONSUMERS_W] / fleet["plain"]
    stay_m = idle_m[:, None] * targets.dwell[:places]
    last_leg = _last_legs(scene, roadmap, fleet)
    energy = np.array([robot.battery.start_J for robot in scene.robots])
    times = routing_times(scene, roadmap, fleet, targets.dwell, params.route_margin)
    start = np.zeros((len(scene.robots), 5))
    start[:, :3] = [robot.pose for robot in scene.robots]
    mission = Mission(
        fleet=fleet,
        spaces=stack_spaces(world),
        terrain=world.terrain,
        roadmap=roadmap.arrays,
        targets=targets,
        routing=routing_arrays(
            goals=len(scene.goals),
            distance=roadmap.distance[fleet["field"], :places, :places]
            + stay_m[:, None],
            start_distance=roadmap.start_distance[:, :places] + stay_m,
            plain=fleet["plain"] * (1.0 + params.route_margin),
            energy=energy,
            capacity=fleet["capacity"],
            reserve=fleet["reserve"],
            finish_distance=last_leg / fleet["plain"][:, None],
            **({} if times is None else times._asdict()),
        ),
        last_leg=last_leg,
        params=tree_params(params)._replace(optioned=has_options(scene)),
        gates=gate_arrays(scene),
    )
    return Problem(scene, roadmap, mission, start, energy)


def _last_legs(scene: Scene, roadmap: Roadmap, fleet: np.ndarray) -> np.ndarray:
    """Return the energy from each place to each robot's finish [J], (R, G + S + 1)."""
    places = len(scene.targets())
    legs = np.zeros((len(fleet), places + 1))
    for r, finish in enumerate(finish_of(scene)):
        if finish >= 0:
            legs[r, :places] = roadmap.distance[fleet[r]["field"], :places, finish]
            legs[r, places] = roadmap.start_distance[r, finish]
            legs[r] *= fleet[r]["plain"]
    return legs


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
    mission = problem.mission
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
        _replay(problem, params, control),
        _visited_tours(problem, tree, tours, branch),
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


def _replay(
    problem: Problem, params: PlannerParams, control: np.ndarray
) -> tuple[Trajectory, ...]:
    trajectories = []
    fleet = problem.mission.fleet
    for r, robot in enumerate(problem.scene.robots):
        state = np.zeros((len(control) + 1, 5))
        state[0] = problem.start[r]
        for k, (u1, u2) in enumerate(control[:, r]):
            motion_step(fleet[r], state[k], u1, u2, params.dt_s, state[k + 1])
        trajectories.append(
            Trajectory(
                robot=robot.id,
                dt_s=params.dt_s,
                state=state,
                control=np.ascontiguousarray(control[:, r]),
            )
        )
    return tuple(trajectories)


def _visited_tours(
    problem: Problem, tree: Tree, tours: Tours, branch: list[int]
) -> dict[str, tuple[str, ...]]:
    """Return what each robot visited: goals it was first at, stations it drove to."""
    mission, targets = problem.mission, problem.mission.targets
    robots = problem.scene.robots
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
    names = [target.id for target in problem.scene.targets()]
    return {
        robot.id: tuple(names[t] for t in found[r]) for r, robot in enumerate(robots)
    }


def _target_at(tree: Tree, tours: Tours, v: int, r: int) -> int:
    """Return robot r's next target at vertex v, -1 for none."""
    row, place = tree.tour[v], tree.position[v, r]
    return int(tours.target[row, r, place]) if place < tours.length[row, r] else -1
