"""A recorded run, checked in plain Python against the statements of the paper.

Nothing here calls a kernel of the planner: weights, regions, distances, controls,
states, collisions and energies are computed anew, the geometry with shapely.
"""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from shapely import affinity
from shapely.geometry import Point, Polygon

from mrmg.motion.dynamics import car_derivative, rk4_step
from mrmg.planning.guided_tree._tree_kernels import ENDS

STEP = rk4_step(car_derivative(math.sin, math.cos, math.tan))
BETA_SHARE = 0.01
COLLISION, REJECTED = ENDS.index("collision"), ENDS.index("rejected by Insert")


class Replay:
    """Vertices, groups and expansions of a recording, as plain lists."""

    def __init__(self, recording) -> None:
        self.scene, self.params = recording.scene, recording.params
        self.method = recording.params.guided_tree
        self.growth = recording.growth
        tree = recording.growth.tree
        self.n = recording.growth.counts["vertices"]
        self.iterations = recording.growth.counts["iterations"]
        self.vertices, self.tours, self.trace = tree.vertices, tree.tours, tree.trace
        self.groups = tree.groups
        self.roadmap = recording.problem.roadmap.arrays
        self.fleet = recording.problem.mission.fleet
        self.routing = recording.problem.mission.routing
        self.robots = len(self.scene.robots)
        self.goals = len(self.scene.goals)
        self.joined = np.isfinite(self.roadmap.cost_to_go[0]).any(axis=0)
        self.made: list[list[int]] = [[] for _ in range(self.iterations)]
        for v in range(1, self.n):
            self.made[self.vertices.iteration[v]].append(v)

    def visited(self, v: int) -> tuple[bool, ...]:
        return tuple(bool(x) for x in self.groups.visited[self.vertices.group[v]])

    def tour(self, v: int) -> list[list[int]]:
        row = self.vertices.tour[v]
        return [
            [int(t) for t in self.tours.target[row, r, : self.tours.length[row, r]]]
            for r in range(self.robots)
        ]

    def region(self, v: int, r: int) -> int:
        """Return the nearest vertex of the roadmap that has a path to a target."""
        apart = self.roadmap.vertex - self.vertices.state[v, r, :2]
        return int(np.where(self.joined, np.hypot(*apart.T), np.inf).argmin())

    def path(self, v: int, r: int, t: int) -> float:
        """Return the energy along the roadmap from a vertex to a target [J]."""
        w = self.region(v, r)
        x, y = self.vertices.state[v, r, :2]
        terrain = self.growth_terrain(x, y)
        straight = math.dist(self.roadmap.vertex[w], (x, y)) * terrain
        field = self.fleet[r]["field"]
        metres = straight + self.roadmap.cost_to_go[field, t, w]
        return metres * self.fleet[r]["plain"]

    def growth_terrain(self, x: float, y: float) -> float:
        for area in self.scene.terrain:
            # The planner's terrain is a raster of 0.25 m.
            cell = Point(0.25 * (x // 0.25 + 0.5), 0.25 * (y // 0.25 + 0.5))
            if area.shape.contains(cell):
                return area.multiplier
        return 1.0

    def feasible(self, v: int, row: int) -> bool:
        """Return whether the batteries of a vertex last for a tour."""
        margin = 1.0 + self.params.route_margin
        for r in range(self.robots):
            left = self.vertices.energy[v, r] - self.fleet[r]["reserve"]
            targets = self.tours.target[row, r, : self.tours.length[row, r]]
            if len(targets):
                left -= self.path(v, r, targets[0])
            for a, b in pairwise(targets):
                if a >= self.goals:
                    break
                left -= self.routing.cost[r, a, b] / margin
            if left < -1e-6:
                return False
        return True

    def outline(self, r: int, state: np.ndarray) -> Polygon:
        body = Polygon(self.scene.robots[r].model.footprint_m)
        turned = affinity.rotate(body, state[2], origin=(0, 0), use_radians=True)
        return affinity.translate(turned, state[0], state[1])

    def collision_free(self, state: np.ndarray, slack: float) -> bool:
        """Return whether all margins and limits hold, or nearly do (slack > 0)."""
        x0, y0, x1, y1 = self.scene.bounds
        frame = Polygon([(x0, y0), (x1, y0), (x1, y1), (x0, y1)])
        outlines = [self.outline(r, state[r]) for r in range(self.robots)]
        for r, outline in enumerate(outlines):
            low, high, psi = self.fleet[r]["limit"][:3]
            if not low - 1e-6 <= state[r, 3] <= high + 1e-6:
                return False
            if abs(state[r, 4]) > psi + 1e-6:
                return False
            need = self.params.obstacle_margin_m - slack
            walls = [item.shape for item in self.scene.obstacles]
            if any(outline.distance(item) < need for item in walls):
                return False
            if not frame.contains(outline):
                return False
            if outline.distance(frame.exterior) < need:
                return False
            for other in outlines[:r]:
                if outline.distance(other) < self.params.robot_margin_m - slack:
                    return False
        return True

    def advanced(self, v: int, control: np.ndarray) -> np.ndarray:
        """Return the composite state one step after a vertex."""
        after = np.empty((self.robots, 5))
        for r in range(self.robots):
            robot = self.fleet[r]
            after[r] = STEP(
                *self.vertices.state[v, r],
                *control[r],
                float(robot["wheelbase"]),
                self.params.dt_s,
            )
        return after


@pytest.fixture(scope="module")
def replay(recording) -> Replay:
    return Replay(recording)


def steer(replay: Replay, r: int, state: np.ndarray, goal: np.ndarray) -> tuple:
    """Return Steer(v, q), of a robot's state and its target alone."""
    v_min, v_max, psi_max, u1_max, u2_max = replay.fleet[r]["limit"]
    hold_s = replay.method.k * replay.params.dt_s
    x, y, theta, v, psi = state
    want_v, want_psi = 0.0, psi
    if not np.isnan(goal[0]):
        distance = math.dist((x, y), goal)
        bearing = math.remainder(
            math.atan2(goal[1] - y, goal[0] - x) - theta, 2 * math.pi
        )
        reverse = abs(bearing) > (0.5 * math.pi if v < -0.1 else 2.2)
        if reverse or abs(bearing) <= 0.5 * math.pi:
            curvature = 2.0 * math.sin(bearing) / distance
            length = float(replay.fleet[r]["wheelbase"])
            want_psi = np.clip(math.atan(length * curvature), -psi_max, psi_max)
        else:
            want_psi = math.copysign(psi_max, bearing)
        share = max(0.4, 1.0 - abs(want_psi - psi) / psi_max)
        want_v = share * (v_min if reverse else v_max)
    return (
        float(np.clip((want_v - v) / hold_s, -u1_max, u1_max)),
        float(np.clip((want_psi - psi) / hold_s, -u2_max, u2_max)),
    )


def test_the_trace_shows_all_that_can_happen(replay: Replay) -> None:
    """What is checked below must have happened at least once."""
    ended = replay.trace.ended[: replay.iterations]
    assert {0, COLLISION, REJECTED} <= set(ended.tolist())
    assert replay.growth.solved
    assert replay.growth.counts["router_calls"] > 5
    assert any(len(made) == replay.method.k for made in replay.made)
    assert any(0 < len(made) < replay.method.k for made in replay.made)


def test_groups_have_one_region_of_every_robot_and_one_set_of_goals(
    replay: Replay,
) -> None:
    keys = {}
    for v in range(replay.n):
        regions = tuple(replay.region(v, r) for r in range(replay.robots))
        key = (regions, replay.visited(v))
        assert (
            keys.setdefault(key, replay.vertices.group[v]) == replay.vertices.group[v]
        )
    assert len(set(keys.values())) == len(keys) == replay.growth.counts["groups"]


def test_goals_are_visited_when_a_robot_is_in_them(replay: Replay) -> None:
    for v in range(replay.n):
        parent = int(replay.vertices.parent[v])
        before = replay.visited(parent) if parent >= 0 else (False,) * replay.goals
        for g, goal in enumerate(replay.scene.goals):
            at = replay.vertices.state[v, :, :2]
            inside = goal.region.depth(at).max()
            if inside >= 0.13:  # planned targets are 0.12 m smaller
                assert replay.visited(v)[g]
            if replay.visited(v)[g] and not before[g]:
                assert inside >= 0.0
            assert replay.visited(v)[g] >= before[g]


def test_weights_selections_and_visits_are_those_of_the_paper(replay: Replay) -> None:
    """Eq. (5) and the draws, with groups as they were before each iteration."""
    method, m = replay.method, replay.goals
    depth, group = replay.vertices.depth, replay.vertices.group
    visits: dict[int, int] = {int(group[0]): 0}
    dist: dict[int, int] = {int(group[0]): 0}
    members: dict[int, list[int]] = {int(group[0]): [0]}
    for i in range(replay.iterations):
        known = sorted(members)
        beta = BETA_SHARE * method.alpha / (m * int(replay.trace.scale[i]))
        weights = []
        for g in known:
            unvisited = m - sum(replay.visited(members[g][0]))
            assert beta * dist[g] <= BETA_SHARE * method.alpha / m
            weights.append(
                method.decline ** visits[g]
                * (method.alpha / max(unvisited, 1) + beta * dist[g])
            )
        chosen = int(replay.trace.group[i])
        bias_draw, draw = replay.trace.group_draw[i]
        at = known.index(chosen)
        if bias_draw < method.bias:
            assert weights[at] >= max(weights) * (1.0 - 1e-12)
        else:
            mass = np.cumsum(weights)
            left = draw * mass[-1]
            assert mass[at] - weights[at] - 1e-9 <= left <= mass[at] + 1e-9
        v = int(replay.trace.vertex[i])
        assert v in members[chosen]
        # Decay of the visits of the vertex's group, with a draw for each robot.
        fallen = method.decay_rate ** visits[chosen]
        least = method.decay_least
        chance = least + (method.decay_start - least) * fallen
        for r in range(replay.robots):
            control = tuple(replay.trace.control[i, r])
            steered = steer(
                replay, r, replay.vertices.state[v, r], replay.trace.target[i, r]
            )
            if replay.trace.steer_draw[i, r] < chance:
                assert control == pytest.approx(steered, abs=1e-9)
            else:
                assert control != pytest.approx(steered, abs=1e-9)
                limits = replay.fleet[r]["limit"][3:]
                assert (np.abs(control) <= limits).all()
        visits[chosen] += 1
        for new in replay.made[i]:
            g, far = int(group[new]), int(depth[new])
            members.setdefault(g, []).append(new)
            visits.setdefault(g, 0)
            dist[g] = min(dist.get(g, far), far)
    assert visits == dict(enumerate(replay.groups.visits[: len(visits)]))


def test_vertices_are_drawn_by_their_distance_to_their_target(replay: Replay) -> None:
    members: list[list[int]] = [[] for _ in range(replay.growth.counts["groups"])]
    members[replay.vertices.group[0]].append(0)
    for i in range(replay.iterations):
        own = members[replay.trace.group[i]][::-1]
        far = [float(replay.vertices.to_target_m[v]) for v in own]
        mass = np.cumsum(np.exp(-np.array(far) / replay.method.vertex_spread_m))
        at = own.index(int(replay.trace.vertex[i]))
        share = np.concatenate([[0.0], mass / mass[-1]])
        draw = replay.trace.vertex_draw[i]
        assert share[at] - 1e-9 <= draw <= share[at + 1] + 1e-9
        for new in replay.made[i]:
            members[replay.vertices.group[new]].append(new)


def ahead(replay: Replay, v: int, r: int, length: float) -> np.ndarray:
    """Return the point so far along the roadmap's path of a robot."""
    t = replay.tour(v)[r][0]
    successor = replay.roadmap.successor[replay.fleet[r]["field"], t]
    at = replay.region(v, r)
    while successor[at] >= 0:
        here, there = replay.roadmap.vertex[[at, successor[at]]]
        step = float(np.hypot(*(there - here)))
        if step > length:
            return here + length / step * (there - here)
        length -= step
        at = successor[at]
    return replay.roadmap.vertex[at]


def test_the_distance_of_a_vertex_is_to_the_middle_of_its_sampled_targets(
    replay: Replay,
) -> None:
    middle = 0.5 * (replay.method.ahead_least_m + replay.method.ahead_most_m)
    for v in range(0, replay.n, 7):
        expected = sum(
            math.dist(ahead(replay, v, r, middle), replay.vertices.state[v, r, :2])
            for r in range(replay.robots)
            if replay.tour(v)[r]
        )
        assert replay.vertices.to_target_m[v] == pytest.approx(expected, abs=1e-9)


def test_targets_are_sampled_near_the_path_of_the_vertexs_tour(replay: Replay) -> None:
    method = replay.method
    lengths = np.linspace(method.ahead_least_m, method.ahead_most_m, 46)
    for i in range(0, replay.iterations, 5):
        v = int(replay.trace.vertex[i])
        for r in range(replay.robots):
            sampled = replay.trace.target[i, r]
            if not replay.tour(v)[r]:
                assert np.isnan(sampled).all()
                continue
            path = np.array([ahead(replay, v, r, length) for length in lengths])
            far = np.hypot(*(path - sampled).T).min()
            assert far <= method.target_spread_m + 0.06


def test_each_step_of_held_controls_is_a_vertex_of_its_own(replay: Replay) -> None:
    """Algorithm 3: one vertex a step, each the child of the one before it."""
    for i, made in enumerate(replay.made):
        assert len(made) <= replay.method.k
        last = int(replay.trace.vertex[i])
        for v in made:
            assert replay.vertices.parent[v] == last
            assert replay.vertices.depth[v] == replay.vertices.depth[last] + 1
            expected = replay.advanced(last, replay.trace.control[i])
            assert replay.vertices.state[v] == pytest.approx(expected, abs=1e-9)
            last = v
        ended = replay.trace.ended[i]
        if ended == 0:
            assert len(made) == replay.method.k


def test_vertices_are_free_and_a_collision_ends_the_expansion(replay: Replay) -> None:
    for v in range(1, replay.n, 5):
        assert replay.collision_free(replay.vertices.state[v], slack=1e-6)
    collided = np.flatnonzero(replay.trace.ended[: replay.iterations] == COLLISION)
    assert len(collided)
    for i in collided:
        made = replay.made[i]
        last = made[-1] if made else int(replay.trace.vertex[i])
        rejected = replay.advanced(last, replay.trace.control[i])
        assert not replay.collision_free(rejected, slack=-1e-6)


def test_energy_is_used_by_distance_terrain_and_turning(replay: Replay) -> None:
    """The preset `paper`, midpoint by midpoint; stations on the tour fill up."""
    for v in range(1, replay.n):
        parent = int(replay.vertices.parent[v])
        i = replay.vertices.iteration[v]
        for r, robot in enumerate(replay.scene.robots):
            before = replay.vertices.state[parent, r]
            after = replay.vertices.state[v, r]
            tour = replay.tour(parent)[r]
            if tour and tour[0] >= replay.goals:
                station = replay.scene.targets()[tour[0]].region
                depth = station.depth(after[:2])[0]
                if depth >= 0.0:
                    if depth >= 0.13:
                        full = robot.battery.capacity_J
                        assert replay.vertices.energy[v, r] == full
                    continue
            speed = 0.5 * (before[3] + after[3])
            turn = abs(speed * math.tan(0.5 * (before[4] + after[4])))
            x, y = 0.5 * (before[:2] + after[:2])
            c = robot.model.energy_model
            k = replay.growth_terrain(x, y)
            force = c.rolling_force_N * k * abs(speed) + c.turning_force_N * turn
            used = replay.params.dt_s * force / c.drive_efficiency
            left = replay.vertices.energy[parent, r] - used
            assert replay.vertices.energy[v, r] == pytest.approx(left, abs=1e-6), i


def test_tours_are_kept_renewed_and_feasible(replay: Replay) -> None:
    """Algorithm 2, with every vertex's tour."""
    renewed = 0
    for v in range(replay.n):
        row = int(replay.vertices.tour[v])
        goals = sorted(t for tour in replay.tour(v) for t in tour if t < replay.goals)
        unvisited = [g for g, done in enumerate(replay.visited(v)) if not done]
        assert goals == unvisited  # each once, by somebody
        for r in range(replay.robots):
            reserve = replay.fleet[r]["reserve"]
            assert replay.vertices.energy[v, r] >= reserve
        assert replay.feasible(v, row)
        parent = int(replay.vertices.parent[v])
        if parent < 0:
            continue
        reached = replay.visited(v) != replay.visited(parent)
        for r, tour in enumerate(replay.tour(parent)):
            if tour and tour[0] >= replay.goals:
                filled = (
                    replay.vertices.energy[v, r] > replay.vertices.energy[parent, r]
                )
                reached |= bool(filled)
        old = int(replay.vertices.tour[parent])
        if reached or not replay.feasible(v, old):
            renewed += 1
            assert row != old
        else:
            assert row == old
    assert renewed > 3
    assert len(set(replay.vertices.tour[: replay.n].tolist())) == renewed + 1


def test_the_solution_ends_with_a_stop_of_ours(replay: Replay) -> None:
    growth = replay.growth
    assert all(replay.visited(growth.solution))
    assert growth.solution == replay.n - 1
    branch = [growth.solution]
    while replay.vertices.parent[branch[-1]] >= 0:
        branch.append(int(replay.vertices.parent[branch[-1]]))
    branch.reverse()
    for r, item in enumerate(growth.trajectories):
        steps = len(item.control)
        assert steps == len(branch) - 1 + growth.stop_steps
        states = replay.vertices.state[branch, r]
        assert item.state[: len(branch)] == pytest.approx(states, abs=1e-9)
        assert abs(item.state[-1, 3]) < 1e-6
        stop = item.control[len(branch) - 1 :]
        assert (stop[:, 1] == 0.0).all()  # braking with the steering held
        assert np.all(np.diff(np.abs(item.state[len(branch) - 1 :, 3])) <= 1e-9)
    final = np.array([item.state for item in growth.trajectories])
    for k in range(len(branch), final.shape[1]):
        assert replay.collision_free(final[:, k], slack=1e-6)
