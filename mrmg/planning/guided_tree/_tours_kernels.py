"""Tours that vertices carry: whether they are feasible, and CreateNewTour by NRPA."""

from __future__ import annotations

import numpy as np

from mrmg.compilation import kernel, now_ns
from mrmg.planning.guided_tree._regions_kernels import path_energy
from mrmg.planning.guided_tree._tree_kernels import (
    ROUTER_CALLS,
    ROUTER_FAILURES,
    ROUTING_NS,
    TOURS,
    VERTICES,
)
from mrmg.planning.problem._target_kernels import in_target
from mrmg.planning.routing._nrpa_kernels import UNVISITED, RoutingArrays, nrpa


@kernel
def feasible(setting, tours, row, state, energy, region):
    """Return whether every battery lasts for a tour from a composite state.

    Args:
        setting: the mission.
        tours, row: the tour.
        state: shape (R, 5).
        energy: battery contents [J], shape (R,).
        region: of every robot, shape (R,).
    """
    for r in range(len(region)):
        left = energy[r] - setting.fleet[r].reserve
        if tours.length[row, r] > 0:
            t = tours.target[row, r, 0]
            left -= path_energy(setting, r, t, state[r, 0], state[r, 1], region[r])
            left -= tours.need[row, r]
        if left < 0.0:
            return False
    return True


@kernel
def write_tours(setting, sequence, moves, margin, tours, row):
    """Write the tours of a playout's moves, and what they need on the way."""
    problem = setting.routing
    targets = problem.cost.shape[2]
    for r in range(len(problem.energy)):
        tours.length[row, r] = 0
        tours.need[row, r] = 0.0
        refuelled = False
        for i in range(moves):
            if sequence[i] // targets != r:
                continue
            t = sequence[i] % targets
            n = tours.length[row, r]
            if n > 0 and not refuelled:
                leg = problem.cost[r, tours.target[row, r, n - 1], t]
                tours.need[row, r] += leg / (1.0 + margin)
            refuelled |= t >= problem.goals
            tours.target[row, r, n] = t
            tours.length[row, r] = n + 1


@kernel
def _routing_from(setting, rules, tree, state, energy, region, visited):
    """Return the routing problem as it stands at a composite state.

    No robot sets out for the station that it is in, but at the root.

    Args:
        setting, rules, tree, state, energy, region, visited: as of `create_new_tour`.
    """
    problem = setting.routing
    robots, _, targets = problem.cost.shape
    cost = problem.cost.copy()
    for r in range(robots):
        for t in range(targets):
            inside = in_target(setting.targets, t, state[r, 0], state[r, 1])
            if t >= problem.goals and inside and tree.counts[VERTICES] > 0:
                cost[r, targets, t] = np.inf
                continue
            leg = path_energy(setting, r, t, state[r, 0], state[r, 1], region[r])
            cost[r, targets, t] = leg * (1.0 + rules.route_margin)
    return RoutingArrays(
        problem.goals,
        cost,
        energy,
        problem.capacity,
        problem.reserve,
        problem.escape,
        ~visited,
        problem.finish,
        problem.time,
        problem.finish_time,
        problem.limit,
        problem.charge_power,
        problem.energy_weight,
        problem.makespan_weight,
        problem.table,
        problem.home,
    )


@kernel
def create_new_tour(setting, rules, tree, state, energy, region, visited):
    """Write tours from a composite state as a new row; return it (CreateNewTour).

    Args:
        setting: the mission.
        rules: `Rules`.
        tree: receives the row.
        state: shape (R, 5).
        energy: battery contents [J], shape (R,).
        region: of every robot, shape (R,).
        visited: goals that need no visit any more, shape (G,).

    Returns:
        The row, or -1 if NRPA found no feasible tours.
    """
    began = now_ns()
    tours, counts = tree.tours, tree.counts
    now = _routing_from(setting, rules, tree, state, energy, region, visited)
    sequence = np.zeros(tours.target.shape[2], np.int64)
    value, moves = nrpa(
        now,
        rules.levels,
        rules.nrpa_iterations,
        rules.nrpa_alpha,
        tree.random,
        sequence,
    )
    counts[ROUTER_CALLS] += 1
    counts[ROUTING_NS] += now_ns() - began
    if value >= UNVISITED:
        counts[ROUTER_FAILURES] += 1
        return -1
    row = counts[TOURS]
    counts[TOURS] += 1
    write_tours(setting, sequence, moves, rules.route_margin, tours, row)
    return row
