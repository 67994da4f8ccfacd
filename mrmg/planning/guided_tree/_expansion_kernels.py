"""Steer, Decay and ExtendTowards (Algorithm 3), and Insert (Algorithm 2)."""

from __future__ import annotations

from math import atan, atan2, cos, hypot, isnan, pi, sin

import numba
import numpy as np

from mrmg.compilation import kernel
from mrmg.energy.model import battery_power
from mrmg.motion._kernels import CAR, copy_numbers, step, turn_speed
from mrmg.planning.guided_tree._regions_kernels import point_on_path, region_of
from mrmg.planning.guided_tree._setting_kernels import collision_free
from mrmg.planning.guided_tree._tours_kernels import create_new_tour, feasible
from mrmg.planning.guided_tree._tree_kernels import (
    COLLIDED,
    HELD,
    REJECTED,
    SOLVED,
    VERTICES,
    add_to_group,
    find_group,
    weigh,
)
from mrmg.planning.problem._control_kernels import (
    braking_control,
    control_towards,
    stands,
    wrap,
)
from mrmg.planning.problem._target_kernels import in_target
from mrmg.planning.routing._random_kernels import random_unit
from mrmg.world._kernels import multiplier_in, turning_multiplier_in

_battery_power = numba.njit(battery_power)

REVERSE_FROM_RAD = 2.2
"""Bearing of its target from which a car that stands or drives forwards reverses."""

SLOWEST_SHARE = 0.4
"""Share of the top speed at which a car drives whose steering is far from its aim."""

BRAKING_STEPS = 200
"""Steps within which every robot can brake; more is taken for none."""


@kernel
def decay(visits, rules):
    """Return the probability of steering after so many expansions of the group.

    Decay(n) = decay_least + (decay_start - decay_least) decay_rate^n.
    """
    fallen = rules.decay_rate**visits
    return rules.decay_least + (rules.decay_start - rules.decay_least) * fallen


@kernel
def steer(fleet, r, state, x, y, hold_s):
    """Return the control that, held, drives a robot at a point; NaN brakes (Steer).

    A car follows the circle through the point that its rear axle would roll along
    (pure pursuit: curvature 2 sin(bearing) / distance), backwards if the point is
    behind and it can. A differential drive turns towards the point, and drives the
    faster the better it faces it. Nothing else is looked at.

    Args:
        fleet, r: the robot.
        state: shape (5,).
        x, y: the point [m].
        hold_s: for how long the control will be held [s].
    """
    robot = fleet[r]
    w_max = robot.limit[2]
    v = w = 0.0
    if not isnan(x):
        distance = hypot(x - state[0], y - state[1])
        bearing = wrap(atan2(y - state[1], x - state[0]) - state[2])
        if robot.model == CAR:
            curvature = 2.0 * sin(bearing) / max(distance, 1e-3)
            # Beyond a quarter turn the circle leads there the long way round.
            if abs(bearing) > 0.5 * pi:
                curvature = np.copysign(1e3, bearing)
            reverse_from = 0.5 * pi if state[3] < -0.1 else REVERSE_FROM_RAD
            reverses = robot.limit[0] < 0.0 and abs(bearing) > reverse_from
            if reverses:
                curvature = 2.0 * sin(bearing) / max(distance, 1e-3)
            w = max(-w_max, min(w_max, atan(robot.wheelbase * curvature)))
            share = max(SLOWEST_SHARE, 1.0 - abs(w - state[4]) / w_max)
            v = share * (robot.limit[0] if reverses else robot.limit[1])
        else:
            w = max(-w_max, min(w_max, 1.5 * bearing))
            v = robot.limit[1] * max(0.0, cos(bearing)) ** 3
    elif robot.model == CAR:
        w = state[4]
    return control_towards(fleet, r, state, v, w, hold_s)


@kernel
def choose_controls(setting, rules, state, visits, target, random, draw, control):
    """Write each robot's control (Algorithm 3, lines 2-5).

    Args:
        setting: the mission.
        rules: `Rules`.
        state: composite state of the vertex, shape (R, 5).
        visits: expansions of its group.
        target: what each robot drives at, shape (R, 2).
        random: state of the generator.
        draw: receives what was compared with Decay, shape (R,).
        control: receives the controls, shape (R, 2).
    """
    hold_s = rules.k * rules.dt_s
    for r in range(len(target)):
        robot = setting.fleet[r]
        control[r, 0] = (2.0 * random_unit(random) - 1.0) * robot.limit[3]
        control[r, 1] = (2.0 * random_unit(random) - 1.0) * robot.limit[4]
        draw[r] = random_unit(random)
        if draw[r] < decay(visits, rules):
            control[r, 0], control[r, 1] = steer(
                setting.fleet, r, state[r], target[r, 0], target[r, 1], hold_s
            )


@kernel
def step_energy(setting, r, before, after, u1, dt):
    """Return the battery energy of one step on flat ground [J], by its midpoint."""
    robot = setting.fleet[r]
    v = 0.5 * (before[3] + after[3])
    x = 0.5 * (before[0] + after[0])
    y = 0.5 * (before[1] + after[1])
    k = multiplier_in(setting.terrain, x, y)
    turn = turn_speed(robot.model, v, 0.5 * (before[4] + after[4]), robot.track)
    turn *= turning_multiplier_in(setting.terrain, x, y)
    return dt * _battery_power(v, u1, turn, k, 0.0, robot.energy)


@kernel
def arrive(setting, tree, v, state, energy, visited):
    """Enter goals and stations; return whether one of the tour is reached.

    Any robot visits a goal by entering it. A robot recharges on entering a station that
    its tour leads to next.

    Args:
        setting: the mission.
        tree, v: the parent; -1 for none.
        state: shape (R, 5).
        energy: battery contents [J], changed in place, shape (R,).
        visited: goals, changed in place, shape (G,).
    """
    reached = False
    vertices, tours = tree.vertices, tree.tours
    row = vertices.tour[v]
    for r in range(len(energy)):
        x, y = state[r, 0], state[r, 1]
        for goal in range(len(visited)):
            if not visited[goal] and in_target(setting.targets, goal, x, y):
                visited[goal] = True
                reached = True
        if v < 0:
            continue
        t = tours.first[row, r]
        if t >= len(visited) and in_target(setting.targets, t, x, y):
            energy[r] = setting.fleet[r].capacity
            reached = True
    return reached


@kernel
def distance_to_target(setting, rules, tours, row, state, region):
    """Return the summed distance of the robots from points on their paths [m].

    The points lie in the middle of where SampleTarget draws the target, which is drawn
    only after the vertex.
    """
    total, ahead_m = 0.0, 0.5 * (rules.ahead_least_m + rules.ahead_most_m)
    point = np.zeros(2)
    for r in range(len(region)):
        t = tours.first[row, r]
        if t >= 0:
            point_on_path(setting, r, t, region[r], ahead_m, point)
            total += hypot(point[0] - state[r, 0], point[1] - state[r, 1])
    return total


@kernel
def insert(setting, rules, tree, v, iteration, state, energy):
    """Add a vertex to the tree; return it, or -1 if it is rejected (Algorithm 2).

    Args:
        setting: the mission.
        rules: `Rules`.
        tree: `MotionTree`.
        v: the parent; -1 for the root.
        iteration: the expansion; -1 for the root.
        state: of the new vertex, shape (R, 5).
        energy: battery contents, filled in place at stations [J], shape (R,).
    """
    vertices, groups, tours = tree.vertices, tree.groups, tree.tours
    region = np.empty(len(state), np.int64)
    visited = np.zeros(groups.visited.shape[1], np.bool_)
    for r in range(len(state)):
        joined = setting.joined[setting.fleet[r].field]
        region[r] = region_of(setting.roadmap, joined, state[r, 0], state[r, 1])
        if energy[r] < setting.fleet[r].reserve or region[r] < 0:
            return -1
    # 1: the parent's tour
    row = np.int64(-1)
    if v >= 0:
        row = vertices.tour[v]
        copy_numbers(groups.visited[vertices.group[v]], visited)
    # 2-4: a new one if it is reached or infeasible; without one, no vertex is added.
    reached = arrive(setting, tree, v, state, energy, visited)
    if row < 0 or reached or not feasible(setting, tours, row, state, energy, region):
        row = create_new_tour(setting, rules, tree, state, energy, region, visited)
        if row < 0:
            return -1
    # 5-6: the vertex carries its tour,
    n = tree.counts[VERTICES]
    tree.counts[VERTICES] += 1
    for r in range(len(state)):
        copy_numbers(state[r], vertices.state[n, r])
    copy_numbers(energy, vertices.energy[n])
    vertices.parent[n] = v
    vertices.iteration[n] = iteration
    vertices.depth[n] = vertices.depth[v] + 1 if v >= 0 else 0
    vertices.tour[n] = row
    vertices.to_target_m[n] = distance_to_target(
        setting, rules, tours, row, state, region
    )
    # 7-8: and joins its group.
    add_to_group(tree, rules, find_group(tree, region, visited), n)
    return n


@kernel
def stop_freely(setting, rules, state, energy, control):
    """Write the controls by which all robots brake at once; not part of Algorithms 1-3.

    Args:
        setting: the mission.
        rules: `Rules`.
        state: to brake from, shape (R, 5).
        energy: battery contents [J], shape (R,).
        control: receives the controls, shape (S, R, 2).

    Returns:
        The number of steps, or -1 if one would collide or run out of energy.
    """
    fleet, dt = setting.fleet, rules.dt_s
    robots = len(state)
    here, after, left = state.copy(), state.copy(), energy.copy()
    for n in range(len(control)):
        at_rest = True
        for r in range(robots):
            at_rest &= stands(fleet, r, here[r])
        if at_rest:
            return n
        for r in range(robots):
            u1, u2 = braking_control(fleet, r, here[r], dt)
            step(fleet[r], here[r], u1, u2, dt, after[r])
            left[r] -= step_energy(setting, r, here[r], after[r], u1, dt)
            control[n, r, 0], control[n, r, 1] = u1, u2
            if left[r] < fleet[r].reserve:
                return -1
        if not collision_free(setting, here, after):
            return -1
        for r in range(robots):
            copy_numbers(after[r], here[r])
    return -1


@kernel
def extend_towards(setting, rules, tree, v, iteration):
    """Expand a vertex: ExtendTowards (Algorithm 3).

    Args:
        setting: the mission.
        rules: `Rules`.
        tree: `MotionTree`; its trace holds the targets of the iteration.
        v: the vertex.
        iteration: number of the expansion.

    Returns:
        (The vertex at which all goals are visited and a collision-free stop exists, or
        -1, and the steps of that stop).
    """
    vertices, groups, trace = tree.vertices, tree.groups, tree.trace
    robots, dt = vertices.state.shape[1], rules.dt_s
    control = trace.control[iteration]
    # 1: the expansions of the vertex's group, read once.
    g = vertices.group[v]
    visits = groups.visits[g]
    groups.visits[g] += 1
    weigh(groups, g, rules)
    # 2-5: a random control for each robot, replaced by Steer with chance Decay(visits).
    choose_controls(
        setting, rules, vertices.state[v], visits, trace.target[iteration],
        tree.random, trace.steer_draw[iteration], control,
    )  # fmt: skip
    state, energy = np.empty((robots, 5)), np.empty(robots)
    trace.ended[iteration] = HELD
    # 6: for up to k steps
    for _ in range(rules.k):
        # 7-8: Simulate the held controls for dt.
        for r in range(robots):
            before, u1, u2 = vertices.state[v, r], control[r, 0], control[r, 1]
            step(setting.fleet[r], before, u1, u2, dt, state[r])
            used = step_energy(setting, r, before, state[r], u1, dt)
            energy[r] = vertices.energy[v, r] - used
        # 9-10: a collision ends the loop.
        if not collision_free(setting, vertices.state[v], state):
            trace.ended[iteration] = COLLIDED
            break
        # 11-12: Insert, and go on from the new vertex.
        v = insert(setting, rules, tree, v, iteration, state, energy)
        if v < 0:
            trace.ended[iteration] = REJECTED
            break
        if groups.unvisited[vertices.group[v]] == 0:
            steps = stop_freely(setting, rules, state, energy, tree.stop)
            if steps >= 0:
                trace.ended[iteration] = SOLVED
                return v, steps
    return np.int64(-1), np.int64(-1)
