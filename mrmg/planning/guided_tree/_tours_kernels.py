"""Tours that vertices carry: whether they are feasible, and CreateNewTour by NRPA."""

from __future__ import annotations

import numpy as np

from mrmg.compilation import kernel, now_ns
from mrmg.motion._kernels import copy_numbers
from mrmg.planning.guided_tree._regions_kernels import path_energy
from mrmg.planning.guided_tree._tree_kernels import (
    ROUTER_CALLS,
    ROUTING_NS,
    TOURS,
    VERTICES,
)
from mrmg.planning.problem._target_kernels import in_target
from mrmg.planning.routing._nrpa_kernels import UNVISITED, nrpa


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
        t = tours.first[row, r]
        if t >= 0:
            left -= path_energy(setting, r, t, state[r, 0], state[r, 1], region[r])
            left -= tours.need[row, r]
        if left < 0.0:
            return False
    return True


@kernel
def write_tours(setting, sequence, moves, margin, tours, row):
    """Write the tours of a playout's moves, and what they need on the way."""
    problem = setting.routing
    robots, _, targets = problem.cost.shape
    place, refuelled = np.full(robots, -1), np.zeros(robots, np.bool_)
    for r in range(robots):
        tours.first[row, r], tours.need[row, r] = -1, 0.0
    for i in range(len(sequence)):
        if i >= moves:
            tours.move[row, i, 0] = -1
            continue
        r, t = sequence[i] // targets, sequence[i] % targets
        tours.move[row, i, 0], tours.move[row, i, 1] = r, t
        if place[r] < 0:
            tours.first[row, r] = t
        elif not refuelled[r]:
            tours.need[row, r] += problem.cost[r, place[r], t] / (1.0 + margin)
        place[r], refuelled[r] = t, refuelled[r] or t >= problem.goals


@kernel
def _state_routing(setting, rules, tree, state, energy, region, visited):
    """Write the routing problem as it stands at a composite state.

    No robot sets out for the station that it is in, but at the root.

    Args:
        setting, rules, tree, state, energy, region, visited: as of `create_new_tour`.
    """
    problem = setting.routing
    robots, _, targets = problem.cost.shape
    copy_numbers(energy, problem.energy)
    for goal in range(len(visited)):
        problem.open_goal[goal] = not visited[goal]
    for r in range(robots):
        for t in range(targets):
            leg = path_energy(setting, r, t, state[r, 0], state[r, 1], region[r])
            inside = in_target(setting.targets, t, state[r, 0], state[r, 1])
            if t >= problem.goals and inside and tree.counts[VERTICES] > 0:
                leg = np.inf
            problem.cost[r, targets, t] = leg * (1.0 + rules.route_margin)


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
    _state_routing(setting, rules, tree, state, energy, region, visited)
    sequence = np.zeros(tours.move.shape[1], np.int64)
    value, moves = nrpa(
        setting.routing,
        rules.levels,
        rules.nrpa_iterations,
        rules.nrpa_alpha,
        tree.random,
        sequence,
    )
    counts[ROUTER_CALLS] += 1
    counts[ROUTING_NS] += now_ns() - began
    if value >= UNVISITED:
        return -1
    row = counts[TOURS]
    counts[TOURS] += 1
    write_tours(setting, sequence, moves, rules.route_margin, tours, row)
    return row
