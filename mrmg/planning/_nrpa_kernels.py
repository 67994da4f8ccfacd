"""Nested rollout policy adaptation (Rosin 2011) for the routing problem.

Numbering: targets 0..G-1 are goals, G..T-1 stations; place 0..T-1 is a target, place T
a robot's start. All costs are energies [J].
"""

from __future__ import annotations

from math import exp
from typing import NamedTuple

import numpy as np

from mrmg.compilation import kernel
from mrmg.planning._random_kernels import random_unit

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
def legal_moves(problem, place, energy, unvisited, left, refuelled, moves):
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
                or energy[r] - problem.cost[r, place[r], t] > 0.95 * problem.capacity[r]
            ):
                continue
            moves[n] = r * targets + t
            n += 1
    return n


@kernel
def apply_move(problem, move, place, energy, unvisited, refuelled):
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
def move_bias(problem, scale, r, place, t, energy):
    """Return the logit of a move before any learning: near targets first.

    Stations are unattractive while the battery is full and attractive when it is low.
    """
    bias = -problem.cost[r, place, t] / scale
    if t >= problem.goals:
        bias += 2.0 - 5.0 * energy / problem.capacity[r]
    return bias


@kernel
def move_weights(problem, policy, scale, place, energy, moves, weight):
    """Write the moves' unnormalised probabilities into `weight`; return their sum."""
    targets = problem.cost.shape[2]
    top = -np.inf
    for i in range(len(moves)):
        r = moves[i] // targets
        t = moves[i] % targets
        weight[i] = policy[r, place[r], t] + move_bias(
            problem, scale, r, place[r], t, energy[r]
        )
        top = max(top, weight[i])
    mass = 0.0
    for i in range(len(moves)):
        weight[i] = exp(weight[i] - top)
        mass += weight[i]
    return mass


@kernel
def playout(problem, policy, scale, random, sequence):
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
        mass = move_weights(problem, policy, scale, place, energy, moves[:n], weight)
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
def adapt(problem, policy, scale, alpha, sequence, length):
    """Move the policy towards a sequence by alpha times its likelihood's gradient."""
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
        mass = move_weights(problem, before, scale, place, energy, moves[:n], weight)
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
def nrpa(problem, levels, iterations, alpha, random, sequence):
    """Nested rollout policy adaptation (Rosin 2011); return (cost, length).

    Level l runs `iterations` searches of level l - 1, each from a copy of its policy,
    and adapts its policy to the best sequence found so far; level 0 is a playout. The
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
