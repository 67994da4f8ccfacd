"""Where to recharge along a given sequence of goals: exact."""

from __future__ import annotations

import numpy as np

from mrmg.compilation import kernel

IMPOSSIBLE = 1e12
"""Cost of a route that cannot be driven, beside its length."""


@kernel
def route_length(problem, r, route, length):
    """Return the energy of a goal sequence without stations [J]."""
    total = 0.0
    place = problem.cost.shape[2]
    for i in range(length):
        total += problem.cost[r, place, route[i]]
        place = route[i]
    return total


@kernel
def refuel_route(problem, r, route, length, out):
    """Insert stations into a robot's goal sequence at least cost: exact.

    Dynamic programme over (goal i, station s visited just before it): between two
    recharges the energy used is a sum of legs, so the last recharge alone decides what
    is left. One or two stations may stand between two goals.

    Args:
        problem: the problem.
        r: robot.
        route: its goals in order, shape (>= length,).
        length: number of goals.
        out: receives goals and stations in order, shape (>= 3 * length,).

    Returns:
        (cost [J], number of targets in `out`); cost is at least IMPOSSIBLE if no choice
        of stations makes the route drivable.
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
    reached = -1
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
            reached = max(reached, i)
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
        total = route_length(problem, r, route, length)
        # The farther it gets, the better: that gives local search a direction.
        missing = length - 1 - reached
        return IMPOSSIBLE * missing + min(total, IMPOSSIBLE), 0
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
