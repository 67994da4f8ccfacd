"""Nested rollout policy adaptation (Rosin 2011) for the routing problem.

Numbering: targets 0..G-1 are goals, G..T-1 stations; place 0..T-1 is a target, place T
a robot's start. All costs are energies [J].
"""

from __future__ import annotations

from math import exp
from typing import NamedTuple

import numpy as np

from mrmg.compilation import kernel
from mrmg.motion._kernels import copy_numbers
from mrmg.planning.routing._random_kernels import random_unit

UNVISITED = 1e13
"""Cost of each goal that a playout left unvisited."""


class RoutingArrays(NamedTuple):
    """An energy-constrained multi-robot route problem with recharging.

    Attributes:
        goals: number of goals G.
        cost: energy from place to target, shape (C, T + H, T); the last H rows are
            homes.
        energy: energy at the start, shape (R,).
        capacity, reserve: shape (R,).
        escape: energy from a target to where a robot is safe: the nearest station, or
            its finish if that is nearer; 0 if there is none that matters, shape (R, T).
        open_goal: which goals are to be visited, shape (G,).
        finish: energy from place to a robot's finish, 0 where routes are open, inf
            where there is no way, shape (R, T + 1).
        time: from place to target, with the dwell there [s], shape (C, T + H, T).
        finish_time: from place to finish [s], shape (R, T + 1).
        limit: longest time of a route [s], shape (R,).
        charge_power: at which batteries are filled [W], inf for at once, shape (R,).
        consumers: what is drawn at all times [W], in the energies as long as robots
            drive, shape (R,).
        energy_weight: of the summed energy in the objective, without consumers.
        makespan_weight: of the longest time of a route in the objective [J/s], in it
            what all consumers draw.
        table: of each robot, among C tables of legs; NRPA wants one for each, shape
            (R,).
        home: each robot's start among the places of its table, shape (R,).
    """

    goals: int
    cost: np.ndarray
    energy: np.ndarray
    capacity: np.ndarray
    reserve: np.ndarray
    escape: np.ndarray
    open_goal: np.ndarray
    finish: np.ndarray
    time: np.ndarray
    finish_time: np.ndarray
    limit: np.ndarray
    charge_power: np.ndarray
    consumers: np.ndarray
    energy_weight: float
    makespan_weight: float
    table: np.ndarray
    home: np.ndarray


class Fleet(NamedTuple):
    """Where the robots of a playout have got to.

    Attributes:
        place: shape (R,).
        energy: shape (R,).
        clock: time since the start [s], shape (R,).
        refuelled: stations visited in a row, shape (R,).
        unvisited: shape (G,).
    """

    place: np.ndarray
    energy: np.ndarray
    clock: np.ndarray
    refuelled: np.ndarray
    unvisited: np.ndarray


def with_own_tables(problem: RoutingArrays) -> RoutingArrays:
    """Return the same problem with a table of legs for each robot."""
    robots, targets = len(problem.energy), problem.cost.shape[2]
    if np.array_equal(problem.table, np.arange(robots)):
        return problem
    rows = [np.r_[:targets, home] for home in problem.home]
    pairs = list(zip(problem.table, rows, strict=True))
    return problem._replace(
        table=np.arange(robots),
        home=np.full(robots, targets),
        cost=np.stack([problem.cost[k, own] for k, own in pairs]),
        time=np.stack([problem.time[k, own] for k, own in pairs]),
    )


@kernel
def new_fleet(problem):
    """Return the fleet at the start."""
    robots, _, targets = problem.cost.shape
    return Fleet(
        np.full(robots, targets, np.int64),
        problem.energy.copy(),
        np.zeros(robots),
        np.zeros(robots, np.int64),
        problem.open_goal.copy(),
    )


@kernel
def legal_moves(problem, fleet, left, moves):
    """Write the legal moves (robot * T + target) into `moves`; return their number.

    A move is legal if energy and time suffice and, unless it ends the mission, a
    station or the finish remains in reach. A station may be visited when energy is
    missing, and at most as many in a row as there are.
    """
    robots, _, targets = problem.cost.shape
    n = 0
    for r in range(robots):
        place = fleet.place[r]
        spare = fleet.energy[r] - problem.reserve[r]
        hurry = problem.limit[r] - fleet.clock[r]
        full = fleet.energy[r] - 0.95 * problem.capacity[r]
        for t in range(targets):
            leg = problem.cost[r, place, t]
            after = spare - leg
            if after < 0.0:
                continue
            if t < problem.goals:
                if not fleet.unvisited[t]:
                    continue
                needed = problem.escape[r, t]
                if left == 1:
                    needed = min(needed, problem.finish[r, t])
                if after < needed:
                    continue
            elif (
                t == place
                or fleet.refuelled[r] >= targets - problem.goals
                or leg < full
                or problem.finish[r, t] == np.inf
            ):
                continue
            if problem.time[r, place, t] + problem.finish_time[r, t] > hurry:
                continue
            moves[n] = r * targets + t
            n += 1
    return n


@kernel
def apply_move(problem, move, fleet):
    """Carry out a move; return (cost, number of goals it visits)."""
    targets = problem.cost.shape[2]
    r = move // targets
    t = move % targets
    cost = problem.cost[r, fleet.place[r], t]
    fleet.energy[r] -= cost
    fleet.clock[r] += problem.time[r, fleet.place[r], t]
    fleet.place[r] = t
    if t < problem.goals:
        fleet.unvisited[t] = False
        fleet.refuelled[r] = 0
        return cost, 1
    fleet.clock[r] += (problem.capacity[r] - fleet.energy[r]) / problem.charge_power[r]
    fleet.energy[r] = problem.capacity[r]
    fleet.refuelled[r] += 1
    return cost, 0


@kernel
def ending_cost(problem, fleet, spent):
    """Return the objective of a fleet that now drives to its finish.

    Recharging on the way there is left to the placing of the stations.
    """
    longest = 0.0
    for r in range(len(fleet.place)):
        spent += problem.finish[r, fleet.place[r]]
        longest = max(longest, fleet.clock[r] + problem.finish_time[r, fleet.place[r]])
    return problem.energy_weight * spent + problem.makespan_weight * longest


@kernel
def move_weights(problem, policy, scale, fleet, moves, n, weight):
    """Write the moves' unnormalised probabilities into `weight`; return their sum.

    Before any learning near targets come first. Stations are unattractive while the
    battery is full and attractive when it is low.
    """
    targets = problem.cost.shape[2]
    top = -np.inf
    for i in range(n):
        r = moves[i] // targets
        t = moves[i] % targets
        place = fleet.place[r]
        bias = -problem.cost[r, place, t] / scale
        if t >= problem.goals:
            bias += 2.0 - 5.0 * fleet.energy[r] / problem.capacity[r]
        weight[i] = policy[r, place, t] + bias
        top = max(top, weight[i])
    mass = 0.0
    for i in range(n):
        weight[i] = exp(weight[i] - top)
        mass += weight[i]
    return mass


@kernel
def playout(problem, policy, scale, random, sequence):
    """Draw a sequence of moves from the policy; return (cost, length)."""
    robots, places, targets = problem.cost.shape
    fleet = new_fleet(problem)
    moves = np.empty(robots * targets, np.int64)
    weight = np.empty(robots * targets, np.float64)
    left = problem.open_goal.sum()
    total = 0.0
    length = 0
    while left > 0 and length < len(sequence):
        n = legal_moves(problem, fleet, left, moves)
        if n == 0:
            break
        mass = move_weights(problem, policy, scale, fleet, moves, n, weight)
        draw = random_unit(random) * mass
        chosen = 0
        while chosen < n - 1 and draw >= weight[chosen]:
            draw -= weight[chosen]
            chosen += 1
        cost, visited = apply_move(problem, moves[chosen], fleet)
        total += cost
        left -= visited
        sequence[length] = moves[chosen]
        length += 1
    return ending_cost(problem, fleet, total) + UNVISITED * left, length


@kernel
def adapt(problem, policy, scale, alpha, sequence, length):
    """Move the policy towards a sequence by alpha times its likelihood's gradient."""
    robots, places, targets = problem.cost.shape
    before = policy.copy()
    fleet = new_fleet(problem)
    moves = np.empty(robots * targets, np.int64)
    weight = np.empty(robots * targets, np.float64)
    left = problem.open_goal.sum()
    for k in range(length):
        n = legal_moves(problem, fleet, left, moves)
        mass = move_weights(problem, before, scale, fleet, moves, n, weight)
        for i in range(n):
            r = moves[i] // targets
            policy[r, fleet.place[r], moves[i] % targets] -= alpha * weight[i] / mass
        r = sequence[k] // targets
        policy[r, fleet.place[r], sequence[k] % targets] += alpha
        _, visited = apply_move(problem, sequence[k], fleet)
        left -= visited


@kernel
def nrpa(problem, levels, iterations, alpha, random, sequence):
    """Nested rollout policy adaptation (Rosin 2011); return (cost, length).

    Level l runs `iterations` searches of level l - 1, each from a copy of its policy,
    and adapts its policy to the best sequence found so far; level 0 is a playout. The
    recursion is unrolled over a counter per level, so that it compiles.
    """
    robots, places, targets = problem.cost.shape
    scale = mean_cost(problem)
    policy = np.zeros((levels + 1, robots, places, targets))
    best = np.full(levels + 1, np.inf)
    best_length = np.zeros(levels + 1, np.int64)
    best_sequence = np.zeros((levels + 1, len(sequence)), np.int64)
    done = np.zeros(levels + 1, np.int64)
    level = levels
    while True:
        if level == 0:
            cost, length = playout(problem, policy[1], scale, random, sequence)
            result, result_length = cost, length
            level = 1
        elif done[level] < iterations:
            if level > 1:
                copy_numbers(policy[level].ravel(), policy[level - 1].ravel())
                best[level - 1] = np.inf
                done[level - 1] = 0
            level -= 1
            continue
        else:
            result, result_length = best[level], best_length[level]
            copy_numbers(best_sequence[level], sequence)
            if level == levels:
                return result, result_length
            level += 1
        if result <= best[level]:
            best[level] = result
            best_length[level] = result_length
            copy_numbers(sequence[:result_length], best_sequence[level])
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
def mean_cost(problem):
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
