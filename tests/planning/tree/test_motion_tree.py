"""Grown trees: every edge replayed, every energy metered again, every tour walked."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numba
import numpy as np
import pytest
import shapely

from mrmg.energy.metering import LoggedMotion, battery_profile, find_visits
from mrmg.energy.metering import step_energy_parts as energy_parts
from mrmg.motion._kernels import step
from mrmg.planning.parameters import PlannerParams
from mrmg.planning.problem._target_kernels import in_target
from mrmg.planning.problem.problem import Problem
from mrmg.planning.problem.targets import TARGET_MARGIN_M
from mrmg.planning.routing.routing import Routing, solve_routing
from mrmg.planning.tree import _groups_kernels, _tree_kernels
from mrmg.planning.tree._groups_kernels import Tree
from mrmg.planning.tree._tree_kernels import Tours
from mrmg.planning.tree.motion_tree import grow_tree, tree_mission
from mrmg.scene.types import Scene

MakeScene = Callable[..., Scene]
MakeProblem = Callable[..., Problem]


def circle(name: str, x: float, y: float, radius: float = 1.2) -> dict[str, Any]:
    return {"id": name, "circle": {"center": [x, y], "radius": radius}}


TERRAIN = [
    {"id": "mud", "box": {"center": [15, 12], "size": [6, 9]}, "multiplier": 3},
    {"id": "road", "box": {"center": [15, 4], "size": [20, 2]}, "multiplier": 0.7},
]
MISSIONS: dict[str, dict[str, Any]] = {
    "one": {},
    "swap": {
        "goals": [circle("a", 26, 9), circle("b", 4, 11)],
        "robots": [
            {"id": "r1", "model": "car", "pose": [4, 10, 0]},
            {"id": "r2", "model": "car", "pose": [26, 10.5, 3.1]},
        ],
    },
    "recharge": {
        "goals": [circle("a", 26, 16), circle("b", 26, 4), circle("c", 5, 3)],
        "stations": [
            {"id": "s", "polygon": [[14, 14], [17, 14], [17, 17], [14, 17]]},
            circle("t", 15, 5),
        ],
        "battery": {"capacity_m": 32, "reserve": 0.05},
        "terrain": TERRAIN,
        "robots": [
            {"id": "r1", "model": "car", "pose": [4, 12, 0.5]},
            {"id": "r2", "model": "car", "pose": [4, 7, -0.5]},
        ],
        "obstacles": [
            {"id": "o", "box": {"center": [20, 10], "size": [2, 3]}, "height": 1}
        ],
    },
}


HALT = np.zeros(1, np.bool_)
"""Never turned true."""


@dataclass(frozen=True)
class Grown:
    """A tree with all that it was grown from."""

    problem: Problem
    params: PlannerParams
    routing: Routing
    tree: Tree
    tours: Tours
    leaf: int
    vertices: int
    counts: np.ndarray

    def targets(self, v: int) -> np.ndarray:
        """Return each robot's next target at a vertex."""
        target = np.zeros(len(self.problem.start), np.int64)
        _tree_kernels.next_targets(
            tree_mission(self.problem, self.params),
            self.tree,
            self.tours,
            np.int64(v),
            target,
        )
        return target


def grow(problem: Problem, params: PlannerParams, seed: int = 1) -> Grown:
    """Grow a tree by hand, as `grow_tree` does, to look inside."""
    robots, goals = len(problem.start), problem.mission.targets.goals
    routing = solve_routing(problem.mission.routing, params.router, seed)
    assert routing.feasible
    tree = _groups_kernels.new_tree(params.max_vertices, robots, goals, params.steps)
    tours = Tours(
        np.zeros((500, robots, 3 * goals + 3), np.int64),
        np.zeros((500, robots), np.int64),
    )
    for r, tour in enumerate(routing.tours):
        tours.target[0, r, : len(tour)] = tour
        tours.length[0, r] = len(tour)
    counts = np.zeros(6, np.int64)
    leaf = _tree_kernels.grow(
        tree_mission(problem, params),
        problem.start,
        problem.start_energy,
        np.array([seed], np.uint64),
        tree,
        tours,
        counts,
        HALT,
    )
    # The vertex that ends the search is counted, too.
    vertices = int(counts[_tree_kernels.VERTICES])
    return Grown(problem, params, routing, tree, tours, leaf, vertices, counts)


@pytest.fixture(params=list(MISSIONS))
def grown(request: pytest.FixtureRequest, yard: MakeScene, state: MakeProblem) -> Grown:
    params = PlannerParams(max_vertices=3000)
    return grow(state(yard(**MISSIONS[request.param])), params)


def replay(grown: Grown, v: int) -> np.ndarray:
    """Return the states along the edge to a vertex, shape (n + 1, R, 5)."""
    fleet, tree = grown.problem.mission.fleet, grown.tree
    n = int(tree.steps[v])
    states = np.zeros((n + 1, len(fleet), 5))
    states[0] = tree.state[tree.parent[v]]
    for k in range(n):
        for r, one in enumerate(fleet):
            u1, u2 = tree.control[v, k, r]
            step(
                one,
                states[k, r],
                u1,
                u2,
                grown.params.dt_s,
                states[k + 1, r],
            )
    return states


def test_the_tree_reaches_all_goals(grown: Grown) -> None:
    assert grown.leaf == grown.vertices - 1
    assert grown.tree.visited[grown.leaf].all()
    assert not grown.tree.visited[: grown.leaf].all(axis=1).any()


def test_parents_come_before_their_children(grown: Grown) -> None:
    parent = grown.tree.parent[: grown.vertices]
    assert parent[0] == -1
    assert (parent[1:] >= 0).all()
    assert (parent[1:] < np.arange(1, grown.vertices)).all()
    steps = grown.tree.steps[1 : grown.vertices]
    assert ((steps >= 1) & (steps <= grown.params.steps)).all()


def test_replaying_an_edge_gives_its_vertex_bit_for_bit(grown: Grown) -> None:
    for v in range(1, grown.vertices):
        assert np.array_equal(replay(grown, v)[-1], grown.tree.state[v])


def test_controls_and_states_are_within_the_planners_limits(grown: Grown) -> None:
    limit = grown.problem.mission.fleet["limit"]
    for v in range(1, grown.vertices):
        control = np.abs(grown.tree.control[v, : grown.tree.steps[v]])
        assert (control <= limit[:, 3:] + 1e-12).all()
    speed = grown.tree.state[: grown.vertices, :, 3]
    assert (speed >= limit[:, 0] - 1e-9).all()
    assert (speed <= limit[:, 1] + 1e-9).all()
    steering = np.abs(grown.tree.state[: grown.vertices, :, 4])
    assert (steering <= limit[:, 2] + 1e-9).all()


def test_energies_follow_the_account_but_for_the_terrain_grid(grown: Grown) -> None:
    """A step whose middle lies in a cell that a border cuts may be charged wrongly."""
    scene, tree = grown.problem.scene, grown.tree
    targets = grown.problem.mission.targets
    strongest = max([1.0, *(area.multiplier for area in scene.terrain)])
    border = [area.shape.exterior for area in scene.terrain]
    cut = 0
    for v in range(1, grown.vertices):
        states = replay(grown, v)
        time_s = np.arange(len(states)) * grown.params.dt_s
        target = grown.targets(int(tree.parent[v]))
        for r, robot in enumerate(scene.robots):
            own = np.ascontiguousarray(states[:, r])
            motion = LoggedMotion(robot=robot.id, time_s=time_s, state=own)
            drawn = energy_parts(scene, motion).sum(axis=1)
            expected = tree.energy[tree.parent[v], r] - drawn.sum()
            x, y = own[-1, :2]
            if target[r] >= targets.goals and in_target(targets, target[r], x, y):
                expected = robot.battery.capacity_J
            middle = 0.5 * (own[:-1, :2] + own[1:, :2])
            doubtful = np.zeros(len(middle), bool)
            for line in border:
                near = [_distance(line, point) < 0.36 for point in middle]
                doubtful |= near
            allowed = strongest / 0.7 * np.abs(drawn[doubtful]).sum() + 1e-6
            cut += doubtful.sum()
            assert abs(tree.energy[v, r] - expected) <= allowed
    assert bool(cut) is bool(border)


def _distance(line: Any, point: np.ndarray) -> float:
    return float(shapely.distance(line, shapely.Point(point)))


def test_no_vertex_is_below_its_reserve(grown: Grown) -> None:
    reserve = np.array(
        [robot.battery.reserve_J for robot in grown.problem.scene.robots]
    )
    assert (grown.tree.energy[: grown.vertices] >= reserve).all()


def test_goals_once_visited_stay_so_and_are_entered_when_they_become_so(
    grown: Grown,
) -> None:
    tree, scene = grown.tree, grown.problem.scene
    for v in range(1, grown.vertices):
        parent = tree.parent[v]
        assert (tree.visited[v] >= tree.visited[parent]).all()
        for g in np.flatnonzero(tree.visited[v] & ~tree.visited[parent]):
            region = scene.goals[g].region
            assert region.depth(tree.state[v, :, :2]).max() >= TARGET_MARGIN_M - 1e-9


def test_every_goal_still_open_is_on_exactly_one_tour_ahead(grown: Grown) -> None:
    tree, tours = grown.tree, grown.tours
    goals = grown.problem.mission.targets.goals
    for v in range(grown.vertices):
        row = tree.tour[v]
        ahead = [
            t
            for r in range(len(grown.problem.start))
            for t in tours.target[row, r, tree.position[v, r] : tours.length[row, r]]
            if t < goals and not tree.visited[v, t]
        ]
        assert sorted(ahead) == np.flatnonzero(~tree.visited[v]).tolist()


def test_next_targets_are_never_visited_goals(grown: Grown) -> None:
    goals = grown.problem.mission.targets.goals
    for v in range(grown.vertices):
        for t in grown.targets(v):
            assert t < 0 or t >= goals or not grown.tree.visited[v, t]


# --- what `grow_tree` makes of it ---------------------------------------------------


@pytest.mark.parametrize("name", list(MISSIONS))
def test_a_growth_ends_at_rest_with_every_goal_on_one_tour(
    name: str, yard: MakeScene, state: MakeProblem
) -> None:
    scene = yard(**MISSIONS[name])
    problem, params = state(scene), PlannerParams()
    routing = solve_routing(problem.mission.routing, params.router, 2)
    growth = grow_tree(problem, params, routing, 2, HALT)
    assert growth.solved
    visited = [t for tour in growth.tours.values() for t in tour]
    goals = [goal.id for goal in scene.goals]
    assert sorted(t for t in visited if t in goals) == sorted(goals)
    assert len({len(item.state) for item in growth.trajectories}) == 1
    for r, item in enumerate(growth.trajectories):
        assert np.array_equal(item.state[0], problem.start[r])
        assert abs(item.state[-1, 3]) < 1e-9
        visits = find_visits(scene, item, growth.tours[item.robot])
        assert [visit.target for visit in visits] == list(growth.tours[item.robot])
        charge = battery_profile(scene, item, visits)
        assert charge.min() >= scene.robots[r].battery.reserve_J
    if name == "recharge":
        assert {"s", "t"} & set(visited)


def test_growing_is_a_function_of_the_seed(yard: MakeScene, state: MakeProblem) -> None:
    problem, params = state(yard(**MISSIONS["swap"])), PlannerParams()
    routing = solve_routing(problem.mission.routing, params.router, 2)
    first, again, other = (
        grow_tree(problem, params, routing, s, HALT) for s in (3, 3, 4)
    )
    assert first.counts == again.counts
    assert first.tours == again.tours
    for one, two in zip(first.trajectories, again.trajectories, strict=True):
        assert np.array_equal(one.state, two.state)
        assert np.array_equal(one.control, two.control)
    assert not all(
        np.array_equal(one.control, two.control)
        for one, two in zip(first.trajectories, other.trajectories, strict=True)
    )


def test_a_tree_that_is_too_small_gives_nothing(
    yard: MakeScene, state: MakeProblem
) -> None:
    params = PlannerParams(max_vertices=4)
    problem = state(yard(), max_vertices=4)
    routing = solve_routing(problem.mission.routing, params.router, 2)
    growth = grow_tree(problem, params, routing, 2, HALT)
    assert not growth.solved
    assert growth.tours == {}
    assert growth.counts["vertices"] == 4


def test_the_margin_scales_the_roadmaps_energies_alone(
    yard: MakeScene, state: MakeProblem
) -> None:
    problem = state(yard(**MISSIONS["recharge"]))
    plain = problem.with_margin(0.0).mission
    double = problem.with_margin(0.16).mission
    assert double.routing.cost == pytest.approx(1.16 * plain.routing.cost)
    assert double.routing.escape == pytest.approx(1.16 * plain.routing.escape)
    assert problem.with_margin(0.16).route_margin == 0.16
    field = problem.mission.fleet["field"]
    joules = problem.mission.fleet["plain"][:, None, None]
    assert plain.routing.cost[:, :-1] == pytest.approx(
        problem.roadmap.distance[field] * joules
    )
    back = problem.with_margin(0.5).with_margin(problem.route_margin)
    assert back.mission.routing.cost == pytest.approx(problem.mission.routing.cost)


@pytest.mark.skipif(numba.config.DISABLE_JIT, reason="about compiled kernels")
def test_variants_of_a_problem_need_no_other_kernels(
    yard: MakeScene, state: MakeProblem
) -> None:
    problem, params = state(yard()), PlannerParams()
    own = numba.typeof(tree_mission(problem, params))
    for variant in (
        problem.with_soc_margin(0.1),
        problem.with_limit(0.5),
        problem.with_margin(0.2),
    ):
        assert numba.typeof(tree_mission(variant, params)) == own


def test_a_halted_tree_ends_without_a_solution(
    yard: MakeScene, state: MakeProblem
) -> None:
    params = PlannerParams(max_vertices=3000)
    problem = state(yard(**next(iter(MISSIONS.values()))))
    routing = solve_routing(problem.mission.routing, params.router, 2)
    growth = grow_tree(problem, params, routing, 2, np.ones(1, np.bool_))
    assert not growth.solved
    assert growth.counts["expansions"] == 0
