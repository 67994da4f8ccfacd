"""Compiled motion tree in the composite state space of all robots (Algorithms 1-3)."""

from __future__ import annotations

from math import atan2, floor, hypot
from typing import NamedTuple

import numpy as np

from mrmg.compilation import kernel
from mrmg.energy import battery_power
from mrmg.motion._kernels import UNICYCLE, tan_steer
from mrmg.planning._maneuver_kernels import best_maneuver, way_left
from mrmg.planning._random_kernels import random_below, random_unit
from mrmg.planning._roadmap_kernels import find_waypoint
from mrmg.planning._routing_kernels import IMPOSSIBLE, RoutingArrays, solve_routing
from mrmg.planning._safety_kernels import (
    braking_control,
    follow_braking,
    new_commitment,
    present_state,
    space_of,
    stands,
    try_control,
    write_braking,
)
from mrmg.planning._steering_kernels import (
    BACK_OFF,
    RANDOM,
    STEER,
    WAIT,
    control_towards,
    pursue,
    sidestep,
    wrap,
)
from mrmg.world._kernels import multiplier_in, point_in_convex

import numba

_battery_power = numba.njit(battery_power)

SOLVED, OUT_OF_VERTICES, NO_TOUR = range(3)
"""How growing a tree can end."""

VIEW_M = 25.0
"""How far along its way a robot looks for the farthest point in sight."""

AGAIN = 0.005
"""Share of the first tours' energy that each expansion a vertex has had counts as."""

STEER_EVERY = 5
"""Steps between two looks."""

MANEUVER_STEPS = 20
"""Length of each motion a maneuver is made of, in steps."""

AHEAD = 0.9
"""Bearing up to which a waypoint counts as ahead [rad]."""

BEHIND = 2.4
"""Bearing from which a waypoint counts as behind [rad]."""

ATTEMPTS = 5
"""Controls tried before a robot brakes as committed."""


class Targets(NamedTuple):
    """Goals and stations: convex regions; T targets, goals first.

    Attributes:
        goals: number of goals.
        center: shape (T, 2).
        reach: radius of the circle about the centre that holds the region, shape (T,).
        corner: padded corners of polygons, shape (T, M, 2).
        corners: number of corners; 0 for a circle, shape (T,).
    """

    goals: int
    center: np.ndarray
    reach: np.ndarray
    corner: np.ndarray
    corners: np.ndarray


class TreeParams(NamedTuple):
    """Numbers the tree is grown by; see `parameters.PlannerParams`."""

    dt: float
    steps: int
    max_vertices: int
    group_alpha: float
    group_beta: float
    group_lambda: float
    group_bias: float
    steer_start: float
    steer_decay: float
    steer_least: float
    region: float
    route_margin: float
    reroute_always: bool
    hold_control: bool
    levels: int
    iterations: int
    alpha: float
    kicks: int


class Tree(NamedTuple):
    """The motion tree; N vertices at most, R robots.

    Attributes:
        state: composite states, shape (N, R, 5).
        energy: battery contents [J], shape (N, R).
        parent: shape (N,); -1 for the root.
        control: controls from the parent, shape (N, k, R, 2).
        steps: number of steps from the parent, shape (N,).
        visited: goals visited, shape (N, G).
        tour: which row of the tour table a vertex follows, shape (N,).
        position: place in its tour each robot has reached, shape (N, R).
        gear: shape (N, R).
        stalled: how often in a row a robot has not got on, shape (N, R).
        expanded: how often a vertex has been expanded, shape (N,).
        remaining: energy estimate of the rest of the tours [J], shape (N,).
        group: shape (N,).
        sibling: next vertex of the same group, -1 at the end, shape (N,).
    """

    state: np.ndarray
    energy: np.ndarray
    parent: np.ndarray
    control: np.ndarray
    steps: np.ndarray
    visited: np.ndarray
    tour: np.ndarray
    position: np.ndarray
    gear: np.ndarray
    stalled: np.ndarray
    expanded: np.ndarray
    remaining: np.ndarray
    group: np.ndarray
    sibling: np.ndarray


class Groups(NamedTuple):
    """Vertex groups: same region of every robot and same visited goals (Algorithm 2)."""

    key: np.ndarray
    slot: np.ndarray
    first: np.ndarray
    size: np.ndarray
    visits: np.ndarray
    unvisited: np.ndarray
    remaining: np.ndarray


@kernel
def in_target(targets, t, x, y):  # type: ignore[no-untyped-def]
    """Tell whether a point lies in a target's region."""
    far = hypot(x - targets.center[t, 0], y - targets.center[t, 1])
    if far > targets.reach[t]:
        return False
    n = targets.corners[t]
    return n == 0 or point_in_convex(x, y, targets.corner[t, :n])


@kernel
def new_tree(n, robots, goals, steps):  # type: ignore[no-untyped-def]
    """Return an empty tree."""
    return Tree(
        np.empty((n, robots, 5)),
        np.empty((n, robots)),
        np.full(n, -1, np.int64),
        np.empty((n, steps, robots, 2)),
        np.zeros(n, np.int64),
        np.zeros((n, goals), np.bool_),
        np.zeros(n, np.int64),
        np.zeros((n, robots), np.int64),
        np.ones((n, robots), np.int64),
        np.zeros((n, robots), np.int64),
        np.zeros(n, np.int64),
        np.zeros(n),
        np.zeros(n, np.int64),
        np.full(n, -1, np.int64),
    )


@kernel
def new_groups(n):  # type: ignore[no-untyped-def]
    """Return an empty set of groups over a hash table of 4 n slots."""
    return Groups(
        np.zeros(n, np.uint64),
        np.full(4 * n, -1, np.int64),
        np.full(n, -1, np.int64),
        np.zeros(n, np.int64),
        np.zeros(n, np.int64),
        np.zeros(n, np.int64),
        np.full(n, np.inf),
    )


@kernel
def group_key(state, visited, region):  # type: ignore[no-untyped-def]
    """Return the hash of the robots' regions and the visited goals."""
    key = np.uint64(0xCBF29CE484222325)
    prime = np.uint64(0x100000001B3)
    for r in range(len(state)):
        key = (key ^ np.uint64(int(floor(state[r, 0] / region)) + 32768)) * prime
        key = (key ^ np.uint64(int(floor(state[r, 1] / region)) + 32768)) * prime
    for g in range(len(visited)):
        key = (key ^ np.uint64(1 + visited[g])) * prime
    return key ^ (key >> np.uint64(29))


@kernel
def add_to_group(groups, tree, n_groups, v, region):  # type: ignore[no-untyped-def]
    """Put a vertex into its group, making the group if it is new; return their number."""
    key = group_key(tree.state[v], tree.visited[v], region)
    place = np.int64(key % np.uint64(len(groups.slot)))
    while groups.slot[place] >= 0 and groups.key[groups.slot[place]] != key:
        place = (place + 1) % len(groups.slot)
    g = groups.slot[place]
    if g < 0:
        g = n_groups
        n_groups += 1
        groups.slot[place] = g
        groups.key[g] = key
        left = 0
        for i in range(tree.visited.shape[1]):
            left += not tree.visited[v, i]
        groups.unvisited[g] = left
    tree.group[v] = g
    tree.sibling[v] = groups.first[g]
    groups.first[g] = v
    groups.size[g] += 1
    groups.remaining[g] = min(groups.remaining[g], tree.remaining[v])
    return n_groups


@kernel
def group_weight(groups, g, params, initial):  # type: ignore[no-untyped-def]
    """Return eq. (5): w = lambda^visits (alpha / |unvisited| + beta dist).

    dist is read as the share of the first tours' energy that is already behind the group,
    so that groups nearer to the end weigh more.
    """
    progress = 1.0 - groups.remaining[g] / initial
    return params.group_lambda ** groups.visits[g] * (
        params.group_alpha / max(1, groups.unvisited[g]) + params.group_beta * progress
    )


@kernel
def select_vertex(groups, tree, n_groups, params, initial, random):  # type: ignore[no-untyped-def]
    """Choose a group by weight, then a vertex in it by distance to its target."""
    chosen = 0
    if random_unit(random) < params.group_bias:
        best = -np.inf
        for g in range(n_groups):
            weight = group_weight(groups, g, params, initial)
            if weight > best:
                best = weight
                chosen = g
    else:
        mass = 0.0
        for g in range(n_groups):
            mass += max(0.0, group_weight(groups, g, params, initial))
        draw = random_unit(random) * mass
        for g in range(n_groups):
            chosen = g
            draw -= max(0.0, group_weight(groups, g, params, initial))
            if draw < 0.0:
                break
    groups.visits[chosen] += 1
    v = groups.first[chosen]
    if random_unit(random) < 0.7:
        # The nearest to its targets; each expansion it has had counts as some way.
        best = np.inf
        nearest = v
        while v >= 0:
            rating = tree.remaining[v] + AGAIN * initial * tree.expanded[v]
            if rating < best:
                best = rating
                nearest = v
            v = tree.sibling[v]
        v = nearest
    else:
        for _ in range(random_below(random, groups.size[chosen])):
            v = tree.sibling[v]
    tree.expanded[v] += 1
    return v


@kernel
def skip_visited(targets, tours, lengths, row, visited, position):  # type: ignore[no-untyped-def]
    """Advance the robots' places in their tours past goals somebody has visited."""
    for r in range(len(position)):
        while position[r] < lengths[row, r]:
            t = tours[row, r, position[r]]
            if t < targets.goals and visited[t]:
                position[r] += 1
            else:
                break


@kernel
def tours_energy(  # type: ignore[no-untyped-def]
    fleet, problem, targets, tours, lengths, row, visited, position, energy, to_first
):
    """Return (energy the rest of the tours takes [J], whether the batteries allow it).

    Args:
        fleet, problem, targets: the problem; `problem.cost` includes the route margin.
        tours, lengths, row: the tours followed.
        visited, position, energy: of the vertex.
        to_first: weighted length to each robot's next target [m], shape (R,).
    """
    total = 0.0
    enough = True
    for r in range(len(position)):
        left = energy[r] - fleet.reserve[r]
        place = -1
        for p in range(position[r], lengths[row, r]):
            t = tours[row, r, p]
            if t < targets.goals and visited[t]:
                continue
            leg = (
                to_first[r] * fleet.plain[r] if place < 0 else problem.cost[r, place, t]
            )
            total += leg
            left -= leg
            if left < 0.0:
                enough = False
            if t >= targets.goals:
                left = fleet.capacity[r] - fleet.reserve[r]
            place = t
    return total, enough


@kernel
def route_from(  # type: ignore[no-untyped-def]
    fleet,
    spaces,
    terrain,
    roadmap,
    problem,
    targets,
    params,
    state,
    energy,
    visited,
    random,
    tour,
    length,
):
    """Solve the routing problem from a composite state; return the cost [J]."""
    robots, places, n_targets = problem.cost.shape
    cost = problem.cost.copy()
    waypoint = np.empty(2)
    for r in range(robots):
        space = space_of(spaces, fleet.space[r])
        for t in range(n_targets):
            cost[r, n_targets, t] = (
                find_waypoint(
                    space, terrain, roadmap, fleet.field[r], t,
                    state[r, 0], state[r, 1], fleet.passage[r], 0.0, waypoint,
                )
                * fleet.plain[r]
                * (1.0 + params.route_margin)
            )  # fmt: skip
    now = RoutingArrays(
        problem.goals, cost, energy, problem.capacity, problem.reserve,
        problem.escape, ~visited,
    )  # fmt: skip
    return solve_routing(
        now, params.levels, params.iterations, params.alpha, params.kicks, random,
        tour, length,
    )  # fmt: skip


@kernel
def _attempt(fleet, r, state, v, w, attempt, dt):  # type: ignore[no-untyped-def]
    """Return the control of the n-th attempt to get on: ever slower and wider.

    The wanted motion; slower; slower and straighter; slower and swinging out; and last
    braking while steering.
    """
    if attempt == 1:
        v *= 0.5
    elif attempt == 2:
        v *= 0.4
        w *= 0.4
    elif attempt == 3:
        v *= 0.4
        w *= -0.5
    elif attempt == 4:
        v = 0.0
    return control_towards(fleet, r, state, v, w, dt)


@kernel
def choose_motion(  # type: ignore[no-untyped-def]
    fleet,
    r,
    space,
    terrain,
    roadmap,
    target,
    state,
    waypoint,
    stalled,
    params,
    gear,
    random,
    motion,
):
    """Decide how a robot sets out for its waypoint; return whether to hold `motion`.

    Ahead and not stuck, it pursues the waypoint. Else it looks for a maneuver; one that
    leaves backwards with the way behind becomes pursuit in reverse gear.
    """
    off = abs(wrap(atan2(waypoint[1] - state[1], waypoint[0] - state[0]) - state[2]))
    if fleet.model[r] == UNICYCLE or params.hold_control:
        gear[r] = 1
        return False
    if off < AHEAD and stalled == 0:
        gear[r] = 1
        return False
    found = best_maneuver(
        fleet, r, space, terrain, roadmap, target, state, params.dt,
        MANEUVER_STEPS, stalled, random, motion,
    )  # fmt: skip
    if not found:
        return False
    gear[r] = 1 if motion[0] > 0.0 else -1
    return not (motion[0] < 0.0 and off > BEHIND and stalled < 2)


@kernel
def expand(  # type: ignore[no-untyped-def]
    fleet,
    spaces,
    terrain,
    roadmap,
    targets,
    params,
    state,
    energy,
    visited,
    target,
    mode,
    gear,
    stalled,
    order,
    random,
    control,
):
    """Drive all robots for up to k steps; ends early when a target is reached.

    Args:
        fleet, spaces, terrain, roadmap, targets, params: the problem.
        state, energy, visited: of the vertex; changed in place to those at the end.
        target: each robot's next target, -1 for none, shape (R,).
        mode: what each robot does, shape (R,).
        gear: each robot's gear; changed in place, shape (R,).
        stalled: how often in a row each robot has not got on, shape (R,).
        order: robots in order of right of way, shape (R,).
        random: state of the generator.
        control: receives the controls, shape (k, R, 2).

    Returns:
        (steps made, mask-free event flag, whether all energies stayed above reserve).
    """
    robots = len(target)
    dt = params.dt
    commitment = new_commitment(fleet, dt)
    for r in range(robots):
        write_braking(fleet, r, state[r], dt, commitment, 0)
    wanted_v = np.zeros(robots)
    wanted_w = np.zeros(robots)
    for r in range(robots):
        if mode[r] == RANDOM:
            low, high = fleet.limit[r, 0], fleet.limit[r, 1]
            wanted_v[r] = low + random_unit(random) * (high - low)
            wanted_w[r] = (2.0 * random_unit(random) - 1.0) * fleet.limit[r, 2]
        elif mode[r] == BACK_OFF:
            backward = fleet.limit[r, 0] if gear[r] > 0 else fleet.limit[r, 1]
            wanted_v[r] = (0.4 + 0.6 * random_unit(random)) * backward
            wanted_w[r] = (2.0 * random_unit(random) - 1.0) * 0.6 * fleet.limit[r, 2]
    goal_point = np.zeros((robots, 2))
    aside = np.zeros((robots, 2))
    to_go = np.zeros(robots)
    decided = np.zeros(robots, np.bool_)
    held = np.zeros(robots, np.bool_)
    motion = np.zeros(2)
    event = False
    n = 0
    while n < params.steps and not event:
        decided[:] = False
        for i in range(robots):
            r = order[i]
            space = space_of(spaces, fleet.space[r])
            now = present_state(commitment, r)
            driving = target[r] >= 0 and mode[r] == STEER
            drawn = mode[r] == RANDOM or mode[r] == BACK_OFF or held[r]
            if driving and n % STEER_EVERY == 0:
                to_go[r] = find_waypoint(
                    space, terrain, roadmap, fleet.field[r], target[r], now[0], now[1],
                    fleet.passage[r], VIEW_M, goal_point[r],
                )  # fmt: skip
                if to_go[r] == np.inf:
                    goal_point[r] = targets.center[target[r]]
                sidestep(
                    fleet, r, now, space, state, goal_point[r, 0], goal_point[r, 1],
                    aside[r],
                )  # fmt: skip
                if n == 0:
                    held[r] = choose_motion(
                        fleet, r, space, terrain, roadmap, target[r], now, aside[r],
                        stalled[r], params, gear, random, motion,
                    )  # fmt: skip
                    if held[r]:
                        wanted_v[r], wanted_w[r] = motion[0], motion[1]
            if driving and not held[r] and not (params.hold_control and n > 0):
                wanted_v[r], wanted_w[r] = pursue(
                    fleet, r, now, aside[r, 0], aside[r, 1], gear[r]
                )
            before = now.copy()
            u1, u2 = braking_control(fleet, r, before, dt)
            if driving or drawn:
                refused = 1
                for attempt in range(ATTEMPTS if driving and not held[r] else 2):
                    a1, a2 = _attempt(
                        fleet, r, before, wanted_v[r], wanted_w[r], attempt, dt
                    )
                    refused = try_control(
                        fleet, spaces, commitment, decided, r, a1, a2, dt
                    )
                    if refused == 0:
                        u1, u2 = a1, a2
                        break
                if refused != 0:
                    follow_braking(commitment, r)
            else:
                follow_braking(commitment, r)
            decided[r] = True
            after = present_state(commitment, r)
            k = multiplier_in(
                terrain, 0.5 * (before[0] + after[0]), 0.5 * (before[1] + after[1])
            )
            energy[r] -= dt * _battery_power(
                0.5 * (before[3] + after[3]),
                u1,
                tan_steer(fleet.model[r], 0.5 * (before[4] + after[4])),
                k,
                fleet.energy[r],
            )
            control[n, r, 0] = u1
            control[n, r, 1] = u2
        n += 1
        for r in range(robots):
            state[r] = present_state(commitment, r)
            if energy[r] < fleet.reserve[r]:
                return n, event, False
            for g in range(targets.goals):
                if not visited[g] and in_target(targets, g, state[r, 0], state[r, 1]):
                    visited[g] = True
                    event = True
            t = target[r]
            if t >= targets.goals and in_target(targets, t, state[r, 0], state[r, 1]):
                energy[r] = fleet.capacity[r]
                event = True
    return n, event, True


@kernel
def choose_modes(tree, v, target, params, steer, random, stuck, mode):  # type: ignore[no-untyped-def]
    """Draw what each robot does next: steer, or random controls when that has failed.

    Writes what each robot does into `mode`, and how stuck it is into `stuck`.
    """
    again = tree.expanded[v] > 1
    for r in range(len(target)):
        draw = random_unit(random)
        # Expanded before, a vertex would only give the same child again.
        stuck[r] = tree.stalled[v, r]
        if again and random_unit(random) < 0.6:
            stuck[r] = max(stuck[r], min(tree.expanded[v], 4))
        if target[r] < 0:
            # A robot without a target gives way only when the others are stuck.
            blocked = False
            for other in range(len(target)):
                blocked |= target[other] >= 0 and tree.stalled[v, other] > 1
            mode[r] = RANDOM if blocked and draw < 0.5 else WAIT
        elif draw >= steer:
            mode[r] = RANDOM
        elif stuck[r] < 2 or params.hold_control:
            mode[r] = STEER
        else:
            pick = random_unit(random)
            if pick < 0.5:
                mode[r] = STEER
            elif pick < 0.7:
                mode[r] = BACK_OFF
            elif pick < 0.95 or len(target) == 1:
                mode[r] = RANDOM
            else:
                mode[r] = WAIT


@kernel
def grow(  # type: ignore[no-untyped-def]
    fleet,
    spaces,
    terrain,
    roadmap,
    targets,
    problem,
    params,
    start,
    start_energy,
    random,
    tree,
    tours,
    lengths,
    counts,
    first_tour,
    first_length,
):
    """Grow a motion tree until all goals are visited (Algorithm 1).

    Args:
        fleet, spaces, terrain, roadmap, targets, params: the problem.
        problem: `RoutingArrays` at the start, costs including the route margin.
        start, start_energy: composite state and batteries at the start.
        random: state of the generator; changed in place.
        tree: `new_tree`; filled.
        tours, lengths: table of tours, shape (rows, R, L) and (rows, R); filled.
        counts: receives vertices, groups, router calls, expansions.
        first_tour, first_length: tours at the start, shape (R, L) and (R,).

    Returns:
        (how it ended, vertex at which all goals are visited and the robots stand).
    """
    robots = len(fleet.model)
    n_tours = 1
    tours[0] = first_tour
    lengths[0] = first_length
    groups = new_groups(params.max_vertices)
    waypoint = np.empty(2)
    to_first = np.zeros(robots)
    target = np.zeros(robots, np.int64)
    mode = np.zeros(robots, np.int64)
    stuck = np.zeros(robots, np.int64)
    order = np.arange(robots)
    n = 1
    tree.state[0] = start
    tree.energy[0] = start_energy
    left = 0
    for g in range(targets.goals):
        for r in range(robots):
            if in_target(targets, g, start[r, 0], start[r, 1]):
                tree.visited[0, g] = True
        left += not tree.visited[0, g]
    if left == 0:
        return SOLVED, 0
    skip_visited(targets, tours, lengths, 0, tree.visited[0], tree.position[0])
    initial = 1e-9
    for r in range(robots):
        place = problem.cost.shape[2]
        for p in range(lengths[0, r]):
            initial += problem.cost[r, place, tours[0, r, p]]
            place = tours[0, r, p]
    tree.remaining[0] = initial
    n_groups = add_to_group(groups, tree, 0, 0, params.region)
    steer = params.steer_start
    counts[2] = 1
    while n < params.max_vertices and counts[3] < 8 * params.max_vertices:
        counts[3] += 1
        v = select_vertex(groups, tree, n_groups, params, initial, random)
        row = tree.tour[v]
        for r in range(robots):
            done = tree.position[v, r] >= lengths[row, r]
            target[r] = -1 if done else tours[row, r, tree.position[v, r]]
        choose_modes(tree, v, target, params, steer, random, stuck, mode)
        steer = max(params.steer_least, steer * params.steer_decay)
        for r in range(robots):
            order[r] = r
        if counts[3] > 1 and random_unit(random) < 0.3:
            for r in range(robots - 1, 0, -1):
                other = random_below(random, r + 1)
                order[r], order[other] = order[other], order[r]
        # The new vertex is written in place and kept only if Insert accepts it.
        tree.state[n] = tree.state[v]
        tree.energy[n] = tree.energy[v]
        tree.visited[n] = tree.visited[v]
        tree.position[n] = tree.position[v]
        tree.gear[n] = tree.gear[v]
        tree.tour[n] = row
        made, event, alive = expand(
            fleet, spaces, terrain, roadmap, targets, params, tree.state[n],
            tree.energy[n], tree.visited[n], target, mode, tree.gear[n],
            stuck, order, random, tree.control[n],
        )  # fmt: skip
        if not alive:
            continue
        moved = False
        for r in range(robots):
            far = hypot(
                tree.state[n, r, 0] - tree.state[v, r, 0],
                tree.state[n, r, 1] - tree.state[v, r, 1],
            )
            moved |= far > 0.02
            slow = far < 0.3 and abs(tree.state[n, r, 3]) < 0.3
            held = target[r] >= 0 and slow and not event
            tree.stalled[n, r] = tree.stalled[v, r] + 1 if held else 0
        if not moved and not event:
            # Nobody got on: remember it at the parent, so that it tries something else.
            for r in range(robots):
                tree.stalled[v, r] += target[r] >= 0
            continue
        # Insert (Algorithm 3): bookkeeping of targets, feasibility, new tours.
        left = 0
        for g in range(targets.goals):
            left += not tree.visited[n, g]
        tree.parent[n] = v
        tree.steps[n] = made
        for r in range(robots):
            t = target[r]
            if t >= targets.goals and in_target(
                targets, t, tree.state[n, r, 0], tree.state[n, r, 1]
            ):
                tree.position[n, r] += 1
        skip_visited(targets, tours, lengths, row, tree.visited[n], tree.position[n])
        if left == 0:
            counts[0] = n + 1
            counts[1] = n_groups
            return SOLVED, n
        for r in range(robots):
            if tree.position[n, r] < lengths[row, r]:
                to_first[r] = way_left(
                    fleet, r, space_of(spaces, fleet.space[r]), terrain, roadmap,
                    tours[row, r, tree.position[n, r]], tree.state[n, r], waypoint,
                )  # fmt: skip
                if to_first[r] == np.inf:
                    to_first[r] = tree.remaining[v] / fleet.plain[r]
        tree.remaining[n], enough = tours_energy(
            fleet, problem, targets, tours, lengths, row, tree.visited[n],
            tree.position[n], tree.energy[n], to_first,
        )  # fmt: skip
        if (not enough or (params.reroute_always and event)) and n_tours < len(tours):
            cost = route_from(
                fleet, spaces, terrain, roadmap, problem, targets, params,
                tree.state[n], tree.energy[n], tree.visited[n], random,
                tours[n_tours], lengths[n_tours],
            )  # fmt: skip
            counts[2] += 1
            if cost >= IMPOSSIBLE:
                if not enough:
                    continue
            else:
                tree.tour[n] = n_tours
                tree.position[n] = 0
                tree.remaining[n] = cost
                n_tours += 1
        elif not enough:
            continue
        n_groups = add_to_group(groups, tree, n_groups, n, params.region)
        n += 1
    counts[0] = n
    counts[1] = n_groups
    return OUT_OF_VERTICES, -1


@kernel
def stop_all(fleet, state, dt, control):  # type: ignore[no-untyped-def]
    """Brake all robots to rest from a vertex; return the number of steps it takes.

    The commitments of the vertex are what is carried out, so this is always safe.
    """
    robots = len(state)
    commitment = new_commitment(fleet, dt)
    longest = 0
    for r in range(robots):
        write_braking(fleet, r, state[r], dt, commitment, 0)
        longest = max(longest, commitment.count[r, 0] - 1)
    for k in range(longest):
        for r in range(robots):
            i = min(k, commitment.count[r, 0] - 1)
            u1, u2 = braking_control(fleet, r, commitment.state[r, 0, i], dt)
            control[k, r, 0], control[k, r, 1] = u1, u2
    return longest
