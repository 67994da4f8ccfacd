"""Compiled router: nested rollout policy adaptation, and local search with exact refuelling.

Numbering: targets 0..G-1 are goals, G..T-1 stations; place 0..T-1 is a target, place T a
robot's start. All costs are energies [J].
"""

from __future__ import annotations

from math import exp
from typing import NamedTuple

import numpy as np

from mrmg.compilation import kernel
from mrmg.planning._random_kernels import random_below, random_unit

IMPOSSIBLE = 1e12
"""Cost of a route that cannot be driven, beside its length."""

UNVISITED = 1e13
"""Cost of each goal that a playout left unvisited."""


class RoutingArrays(NamedTuple):
    """An energy-constrained multi-robot open route problem with recharging.

    Attributes:
        goals: number of goals G.
        cost: energy from place to target, shape (R, T + 1, T); row T is the start.
        energy: energy at the start, shape (R,).
        capacity, reserve: shape (R,).
        escape: energy from a target to the nearest station, 0 if there is none that
            matters, shape (R, T).
        open_goal: which goals are to be visited, shape (G,).
    """

    goals: int
    cost: np.ndarray
    energy: np.ndarray
    capacity: np.ndarray
    reserve: np.ndarray
    escape: np.ndarray
    open_goal: np.ndarray


@kernel
def legal_moves(problem, place, energy, unvisited, left, refuelled, moves):  # type: ignore[no-untyped-def]
    """Write the legal moves (robot * T + target) into `moves`; return their number.

    A move is legal if the energy suffices and, unless it ends the mission, a station
    remains in reach. A station may be visited when energy is missing, and at most twice
    in a row.
    """
    robots, _, targets = problem.cost.shape
    n = 0
    for r in range(robots):
        spare = energy[r] - problem.reserve[r]
        for t in range(targets):
            after = spare - problem.cost[r, place[r], t]
            if after < 0.0:
                continue
            if t < problem.goals:
                if not unvisited[t]:
                    continue
                if left > 1 and after < problem.escape[r, t]:
                    continue
            elif (
                t == place[r]
                or refuelled[r] >= 2
                or energy[r] > 0.95 * problem.capacity[r]
            ):
                continue
            moves[n] = r * targets + t
            n += 1
    return n


@kernel
def apply_move(problem, move, place, energy, unvisited, refuelled):  # type: ignore[no-untyped-def]
    """Carry out a move; return (cost, number of goals it visits)."""
    targets = problem.cost.shape[2]
    r = move // targets
    t = move % targets
    cost = problem.cost[r, place[r], t]
    energy[r] -= cost
    place[r] = t
    if t < problem.goals:
        unvisited[t] = False
        refuelled[r] = 0
        return cost, 1
    energy[r] = problem.capacity[r]
    refuelled[r] += 1
    return cost, 0


@kernel
def move_bias(problem, scale, r, place, t, energy):  # type: ignore[no-untyped-def]
    """Return the logit of a move before any learning: near targets first.

    Stations are unattractive while the battery is full and attractive when it is low.
    """
    bias = -problem.cost[r, place, t] / scale
    if t >= problem.goals:
        bias += 2.0 - 5.0 * energy / problem.capacity[r]
    return bias


@kernel
def playout(problem, policy, scale, random, sequence):  # type: ignore[no-untyped-def]
    """Draw a sequence of moves from the policy; return (cost, length)."""
    robots, places, targets = problem.cost.shape
    place = np.full(robots, targets, np.int64)
    energy = problem.energy.copy()
    unvisited = problem.open_goal.copy()
    refuelled = np.zeros(robots, np.int64)
    moves = np.empty(robots * targets, np.int64)
    weight = np.empty(robots * targets, np.float64)
    left = 0
    for g in range(problem.goals):
        left += unvisited[g]
    total = 0.0
    length = 0
    while left > 0 and length < len(sequence):
        n = legal_moves(problem, place, energy, unvisited, left, refuelled, moves)
        if n == 0:
            break
        top = -np.inf
        for i in range(n):
            r = moves[i] // targets
            t = moves[i] % targets
            weight[i] = policy[r, place[r], t] + move_bias(
                problem, scale, r, place[r], t, energy[r]
            )
            top = max(top, weight[i])
        mass = 0.0
        for i in range(n):
            weight[i] = exp(weight[i] - top)
            mass += weight[i]
        draw = random_unit(random) * mass
        chosen = 0
        while chosen < n - 1 and draw >= weight[chosen]:
            draw -= weight[chosen]
            chosen += 1
        cost, visited = apply_move(
            problem, moves[chosen], place, energy, unvisited, refuelled
        )
        total += cost
        left -= visited
        sequence[length] = moves[chosen]
        length += 1
    return total + UNVISITED * left, length


@kernel
def adapt(problem, policy, scale, alpha, sequence, length):  # type: ignore[no-untyped-def]
    """Move the policy towards a sequence: alpha times the gradient of its log-likelihood."""
    robots, places, targets = problem.cost.shape
    before = policy.copy()
    place = np.full(robots, targets, np.int64)
    energy = problem.energy.copy()
    unvisited = problem.open_goal.copy()
    refuelled = np.zeros(robots, np.int64)
    moves = np.empty(robots * targets, np.int64)
    weight = np.empty(robots * targets, np.float64)
    left = 0
    for g in range(problem.goals):
        left += unvisited[g]
    for k in range(length):
        n = legal_moves(problem, place, energy, unvisited, left, refuelled, moves)
        top = -np.inf
        for i in range(n):
            r = moves[i] // targets
            t = moves[i] % targets
            weight[i] = before[r, place[r], t] + move_bias(
                problem, scale, r, place[r], t, energy[r]
            )
            top = max(top, weight[i])
        mass = 0.0
        for i in range(n):
            weight[i] = exp(weight[i] - top)
            mass += weight[i]
        for i in range(n):
            r = moves[i] // targets
            policy[r, place[r], moves[i] % targets] -= alpha * weight[i] / mass
        r = sequence[k] // targets
        policy[r, place[r], sequence[k] % targets] += alpha
        _, visited = apply_move(
            problem, sequence[k], place, energy, unvisited, refuelled
        )
        left -= visited


@kernel
def nrpa(problem, levels, iterations, alpha, random, sequence):  # type: ignore[no-untyped-def]
    """Nested rollout policy adaptation (Rosin 2011); return (cost, length).

    Level l runs `iterations` searches of level l - 1, each from a copy of its policy, and
    adapts its policy to the best sequence found so far; level 0 is a playout. The
    recursion is unrolled over a counter per level, so that it compiles.
    """
    robots, places, targets = problem.cost.shape
    size = len(sequence)
    scale = mean_cost(problem)
    policy = np.zeros((levels + 1, robots, places, targets))
    best = np.full(levels + 1, np.inf)
    best_length = np.zeros(levels + 1, np.int64)
    best_sequence = np.zeros((levels + 1, size), np.int64)
    done = np.zeros(levels + 1, np.int64)
    level = levels
    while True:
        if level == 0:
            cost, length = playout(problem, policy[1], scale, random, sequence)
            result, result_length = cost, length
            level = 1
        elif done[level] < iterations:
            if level > 1:
                policy[level - 1] = policy[level]
                best[level - 1] = np.inf
                done[level - 1] = 0
            level -= 1
            continue
        else:
            result, result_length = best[level], best_length[level]
            sequence[:] = best_sequence[level]
            if level == levels:
                return result, result_length
            level += 1
        if result <= best[level]:
            best[level] = result
            best_length[level] = result_length
            best_sequence[level, :result_length] = sequence[:result_length]
        done[level] += 1
        adapt(
            problem,
            policy[level],
            scale,
            alpha,
            best_sequence[level],
            best_length[level],
        )


@kernel
def mean_cost(problem):  # type: ignore[no-untyped-def]
    """Return the scale of the playouts' bias: a fraction of the mean finite cost."""
    total = 0.0
    n = 0
    robots, places, targets = problem.cost.shape
    for r in range(robots):
        for p in range(places - 1):
            for t in range(targets):
                if problem.cost[r, p, t] < np.inf and p != t:
                    total += problem.cost[r, p, t]
                    n += 1
    return 0.15 * total / max(n, 1) + 1e-9


@kernel
def _length(problem, r, route, length):  # type: ignore[no-untyped-def]
    """Return the energy of a goal sequence without stations [J]."""
    total = 0.0
    place = problem.cost.shape[2]
    for i in range(length):
        total += problem.cost[r, place, route[i]]
        place = route[i]
    return total


@kernel
def refuel_route(problem, r, route, length, out):  # type: ignore[no-untyped-def]
    """Insert stations into a robot's goal sequence at least cost: exact.

    Dynamic programme over (goal i, station s visited just before it): between two
    recharges the energy used is a sum of legs, so the last recharge alone decides what is
    left. One or two stations may stand between two goals.

    Args:
        problem: the problem.
        r: robot.
        route: its goals in order, shape (>= length,).
        length: number of goals.
        out: receives goals and stations in order, shape (>= 3 * length,).

    Returns:
        (cost [J], number of targets in `out`); cost is at least IMPOSSIBLE if no choice of
        stations makes the route drivable.
    """
    targets = problem.cost.shape[2]
    goals = problem.goals
    stations = targets - goals
    cost = problem.cost[r]
    if length == 0:
        return 0.0, 0
    usable = problem.capacity[r] - problem.reserve[r]
    # State k = i * stations + s: at goal i, having come from station s; state n: start.
    states = length * stations
    value = np.full(states + 1, np.inf)
    back = np.full(states + 1, -1, np.int64)
    first = np.full(states + 1, -1, np.int64)  # first of two stations, or -1
    value[states] = 0.0
    best = np.inf
    best_state = -1
    for order in range(states + 1):
        k = states if order == 0 else order - 1
        if value[k] == np.inf:
            continue
        if k == states:
            i = -1
            place = targets
            left = problem.energy[r] - problem.reserve[r]
            spent = value[k]
        else:
            i = k // stations
            place = route[i]
            leg = cost[goals + k % stations, route[i]]
            left = usable - leg
            spent = value[k]
        while left >= 0.0:
            if i == length - 1:
                if spent < best:
                    best = spent
                    best_state = k
                break
            follower = route[i + 1]
            for s1 in range(stations):
                to_station = cost[place, goals + s1]
                if to_station > left:
                    continue
                for s2 in range(stations):
                    hop = 0.0 if s1 == s2 else cost[goals + s1, goals + s2]
                    leg = cost[goals + s2, follower]
                    if hop > usable or leg > usable:
                        continue
                    new = spent + to_station + hop + leg
                    state = (i + 1) * stations + s2
                    if new < value[state]:
                        value[state] = new
                        back[state] = k
                        first[state] = s1 if s1 != s2 else -1
            leg = cost[place, follower]
            left -= leg
            spent += leg
            place = follower
            i += 1
    if best_state < 0:
        total = _length(problem, r, route, length)
        return IMPOSSIBLE + min(total, IMPOSSIBLE), 0
    # Write the tour from the end.
    n = 0
    i = length - 1
    k = best_state
    while True:
        entry = -1 if k == states else k // stations
        while i > entry or (i == entry and k != states):
            out[n] = route[i]
            n += 1
            i -= 1
            if i + 1 == entry:
                break
        if k == states:
            break
        out[n] = goals + k % stations
        n += 1
        if first[k] >= 0:
            out[n] = goals + first[k]
            n += 1
        k = back[k]
    for j in range(n // 2):
        out[j], out[n - 1 - j] = out[n - 1 - j], out[j]
    return best, n


@kernel
def _route_cost(problem, r, route, length, scratch):  # type: ignore[no-untyped-def]
    cost, _ = refuel_route(problem, r, route, length, scratch)
    return cost


@kernel
def _without(route, length, position, out):  # type: ignore[no-untyped-def]
    for i in range(length - 1):
        out[i] = route[i] if i < position else route[i + 1]


@kernel
def _with(route, length, position, goal, out):  # type: ignore[no-untyped-def]
    for i in range(length + 1):
        if i < position:
            out[i] = route[i]
        elif i == position:
            out[i] = goal
        else:
            out[i] = route[i - 1]


@kernel
def improve_routes(problem, route, length, cost, scratch):  # type: ignore[no-untyped-def]
    """Local search: relocate a goal, or reverse a piece of a route, while it pays.

    Args:
        problem: the problem.
        route: goals of each robot, shape (R, G); changed in place.
        length: number of goals of each robot, shape (R,); changed in place.
        cost: cost of each route with its stations, shape (R,); changed in place.
        scratch: for `refuel_route`.
    """
    robots = len(length)
    size = route.shape[1]
    shorter = np.empty(size + 1, np.int64)
    longer = np.empty(size + 1, np.int64)
    improved = True
    while improved:
        improved = False
        for a in range(robots):
            i = 0
            while i < length[a]:
                goal = route[a, i]
                _without(route[a], length[a], i, shorter)
                cost_a = _route_cost(problem, a, shorter, length[a] - 1, scratch)
                best_gain = 1e-6
                best_b = -1
                best_j = -1
                for b in range(robots):
                    base = shorter if a == b else route[b]
                    n = length[a] - 1 if a == b else length[b]
                    saved = cost[a] - cost_a + (0.0 if a == b else cost[b])
                    if a == b:
                        saved = cost[a]
                    for j in range(n + 1):
                        if a == b and j == i:
                            continue
                        _with(base, n, j, goal, longer)
                        # Stations only add to the length, so that bounds the gain.
                        if saved - _length(problem, b, longer, n + 1) <= best_gain:
                            continue
                        gain = saved - _route_cost(problem, b, longer, n + 1, scratch)
                        if gain > best_gain:
                            best_gain = gain
                            best_b = b
                            best_j = j
                if best_b >= 0:
                    improved = True
                    route[a, : length[a] - 1] = shorter[: length[a] - 1]
                    length[a] -= 1
                    b = best_b
                    _with(route[b], length[b], best_j, goal, longer)
                    length[b] += 1
                    route[b, : length[b]] = longer[: length[b]]
                    cost[a] = _route_cost(problem, a, route[a], length[a], scratch)
                    cost[b] = _route_cost(problem, b, route[b], length[b], scratch)
                else:
                    i += 1
            for i in range(length[a] - 1):
                for j in range(i + 1, length[a]):
                    for k in range(length[a]):
                        inside = i <= k <= j
                        longer[k] = route[a, i + j - k] if inside else route[a, k]
                    if _length(problem, a, longer, length[a]) >= cost[a]:
                        continue
                    new = _route_cost(problem, a, longer, length[a], scratch)
                    if new < cost[a] - 1e-6:
                        cost[a] = new
                        route[a, : length[a]] = longer[: length[a]]
                        improved = True


@kernel
def solve_routing(  # type: ignore[no-untyped-def]
    problem, levels, iterations, alpha, kicks, random, tour, tour_length
):
    """Solve a routing problem: NRPA, then iterated local search around its answer.

    Args:
        problem: `RoutingArrays`.
        levels, iterations, alpha: of NRPA.
        kicks: number of times local search is restarted from a disturbed best.
        random: state of the generator.
        tour: receives goals and stations of each robot in order, shape (R, >= 3 G).
        tour_length: receives their number, shape (R,).

    Returns:
        Cost [J] of the tours; at least IMPOSSIBLE if none was found.
    """
    robots, places, targets = problem.cost.shape
    goals = problem.goals
    left = 0
    for g in range(goals):
        left += problem.open_goal[g]
    tour_length[:] = 0
    if left == 0:
        return 0.0
    sequence = np.zeros(3 * goals + 4 * robots, np.int64)
    _, moves = nrpa(problem, levels, iterations, alpha, random, sequence)
    route = np.zeros((robots, goals + 1), np.int64)
    length = np.zeros(robots, np.int64)
    seen = np.zeros(goals, np.bool_)
    for k in range(moves):
        r = sequence[k] // targets
        t = sequence[k] % targets
        if t < goals:
            route[r, length[r]] = t
            length[r] += 1
            seen[t] = True
    for g in range(goals):
        if problem.open_goal[g] and not seen[g]:
            r = np.argmin(problem.cost[:, targets, g])
            route[r, length[r]] = g
            length[r] += 1
    scratch = np.empty(3 * goals + 3, np.int64)
    cost = np.empty(robots)
    for r in range(robots):
        cost[r] = _route_cost(problem, r, route[r], length[r], scratch)
    if kicks > 0:
        improve_routes(problem, route, length, cost, scratch)
    trial = route.copy()
    trial_length = length.copy()
    trial_cost = cost.copy()
    for _ in range(kicks):
        trial[:] = route
        trial_length[:] = length
        trial_cost[:] = cost
        _kick(problem, trial, trial_length, trial_cost, random, scratch)
        improve_routes(problem, trial, trial_length, trial_cost, scratch)
        if trial_cost.sum() < cost.sum() - 1e-6:
            route[:] = trial
            length[:] = trial_length
            cost[:] = trial_cost
    total = 0.0
    for r in range(robots):
        part, n = refuel_route(problem, r, route[r], length[r], scratch)
        total += part
        tour[r, :n] = scratch[:n]
        tour_length[r] = n
    return total


@kernel
def _kick(problem, route, length, cost, random, scratch):  # type: ignore[no-untyped-def]
    """Move three random goals to random places of random routes."""
    robots = len(length)
    buffer = np.empty(route.shape[1] + 1, np.int64)
    for _ in range(3):
        a = random_below(random, robots)
        if length[a] == 0:
            continue
        i = random_below(random, length[a])
        goal = route[a, i]
        _without(route[a], length[a], i, buffer)
        length[a] -= 1
        route[a, : length[a]] = buffer[: length[a]]
        b = random_below(random, robots)
        j = random_below(random, length[b] + 1)
        _with(route[b], length[b], j, goal, buffer)
        length[b] += 1
        route[b, : length[b]] = buffer[: length[b]]
    for r in range(robots):
        cost[r] = _route_cost(problem, r, route[r], length[r], scratch)
