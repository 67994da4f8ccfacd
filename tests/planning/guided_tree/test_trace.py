"""A recorded run, checked in plain Python against the statements of the paper.

Nothing here calls a kernel of the planner: weights, regions, distances, controls,
states, collisions and energies are computed anew, the geometry with shapely.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import shapely

from mrmg.planning.guided_tree._tree_kernels import ENDS
from mrmg.scene.loading import scene_from_document

BETA_SHARE = 0.01
COLLISION, REJECTED = ENDS.index("collision"), ENDS.index("rejected by Insert")


def steer(replay: Any, r: int, state: np.ndarray, goal: np.ndarray) -> tuple:
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
        reverse = abs(bearing) > (0.5 * math.pi if v < -0.1 else 2.2) and v_min < 0.0
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


def test_the_trace_shows_all_that_can_happen(replay: Any) -> None:
    """What is checked below must have happened at least once."""
    ended = replay.trace.ended[: replay.iterations]
    assert {0, COLLISION, REJECTED} <= set(ended.tolist())
    assert replay.growth.solved
    assert replay.growth.counts["router_calls"] > 5
    assert any(len(made) == replay.method.k for made in replay.made)
    assert any(0 < len(made) < replay.method.k for made in replay.made)


def test_groups_have_one_region_of_every_robot_and_one_set_of_goals(
    replay: Any,
) -> None:
    keys = {}
    for v in range(replay.n):
        regions = tuple(replay.region(v, r) for r in range(replay.robots))
        key = (regions, replay.visited(v))
        assert (
            keys.setdefault(key, replay.vertices.group[v]) == replay.vertices.group[v]
        )
    assert len(set(keys.values())) == len(keys) == replay.growth.counts["groups"]


def test_goals_are_visited_when_a_robot_is_in_them(replay: Any) -> None:
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


def test_weights_selections_and_visits_are_those_of_the_paper(replay: Any) -> None:
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


def test_vertices_are_drawn_by_their_distance_to_their_target(replay: Any) -> None:
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


def ahead(replay: Any, v: int, r: int, length: float) -> np.ndarray:
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
    replay: Any,
) -> None:
    middle = 0.5 * (replay.method.ahead_least_m + replay.method.ahead_most_m)
    for v in range(0, replay.n, 7):
        expected = sum(
            math.dist(ahead(replay, v, r, middle), replay.vertices.state[v, r, :2])
            for r in range(replay.robots)
            if replay.tour(v)[r]
        )
        assert replay.vertices.to_target_m[v] == pytest.approx(expected, abs=1e-9)


def test_targets_are_sampled_near_the_path_of_the_vertexs_tour(replay: Any) -> None:
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


def test_each_step_of_held_controls_is_a_vertex_of_its_own(replay: Any) -> None:
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


def test_vertices_are_free_and_a_collision_ends_the_expansion(replay: Any) -> None:
    for v in range(1, replay.n, 5):
        assert replay.collision_free(replay.vertices.state[v], slack=1e-6)
    collided = np.flatnonzero(replay.trace.ended[: replay.iterations] == COLLISION)
    assert len(collided)
    for i in collided:
        made = replay.made[i]
        last = made[-1] if made else int(replay.trace.vertex[i])
        rejected = replay.advanced(last, replay.trace.control[i])
        assert not replay.collision_free(rejected, slack=-1e-6)


def test_nothing_is_met_between_steps_where_margins_are_small(
    recorded: Any, mission: dict[str, Any]
) -> None:
    """Thin walls, and cars that are further in a step than they are long."""
    walls = [
        {"box": {"center": [16, 6], "size": [0.05, 9]}},
        {"box": {"center": [24, 17], "size": [9, 0.05]}},
    ]
    margins = {"obstacle": 0.0, "robot": 0.0}
    robots = [{**robot, "margins": margins} for robot in mission["robots"]]
    document = {**mission, "obstacles": walls, "robots": robots}
    scene = scene_from_document(document, source="court")
    model = scene.robots[0].model
    limits = replace(model.limits, v_min_m_s=-28.0, v_max_m_s=28.0, u1_max_m_s2=60.0)
    quick = replace(model, limits=limits)
    robots = [replace(robot, model=quick) for robot in scene.robots]
    run = recorded(3, replace(scene, robots=tuple(robots)), iterations=1500)
    vertices = run.growth.tree.vertices
    child = np.arange(1, run.growth.counts["vertices"])
    assert len(child) > 500
    before, after = vertices.state[np.stack([vertices.parent[child], child])][..., :3]
    solid = shapely.union_all([item.shape for item in run.scene.obstacles])
    met = np.zeros(2, int)
    for share in np.linspace(0.0, 1.0, 21):
        poses = before + share * (after - before)
        bodies = [
            shapely.polygons(robot.model.footprint_at(poses[:, r]))
            for r, robot in enumerate(run.scene.robots)
        ]
        met[0] += sum(shapely.intersects(each, solid).sum() for each in bodies)
        met[1] += shapely.intersects(*bodies).sum()
    assert met.tolist() == [0, 0]


def test_energy_is_used_by_distance_terrain_and_turning(replay: Any) -> None:
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


def test_no_tour_begins_with_the_station_that_a_robot_is_in(replay: Any) -> None:
    inside = 0
    for v in range(1, replay.n):
        for r, tour in enumerate(replay.tour(v)):
            here = replay.vertices.state[v, r, :2]
            for t in range(replay.goals, replay.goals + len(replay.scene.stations)):
                if replay.scene.targets()[t].region.depth(here)[0] >= 0.13:
                    inside += 1
                    assert tour[:1] != [t]
    assert inside


def test_tours_are_kept_renewed_and_feasible(replay: Any) -> None:
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


def test_the_solution_ends_with_a_stop_of_ours(replay: Any) -> None:
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
