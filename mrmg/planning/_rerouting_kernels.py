"""New tours on the way: the routing problem as it stands at a vertex of the tree."""

from __future__ import annotations

import numpy as np

from mrmg.compilation import kernel
from mrmg.planning._mission_kernels import leg_energy, look_ahead
from mrmg.planning._nrpa_kernels import RoutingArrays
from mrmg.planning._routing_kernels import solve_routing


@kernel
def route_from(mission, tree, v, random, tour, length):
    """Solve the routing problem from a vertex; return the cost [J]."""
    problem, params = mission.routing, mission.params
    robots, _, n_targets = problem.cost.shape
    cost = problem.cost.copy()
    ending = problem.finish.copy()
    waypoint = np.empty(2)
    for r in range(robots):
        for t in range(n_targets):
            way = look_ahead(mission, r, t, tree.state[v, r], 0.0, waypoint)
            leg = leg_energy(mission, r, t, tree.state[v, r], way)
            cost[r, n_targets, t] = leg * (1.0 + params.route_margin)
        finish = mission.targets.finish[r]
        if finish >= 0:
            way = look_ahead(mission, r, finish, tree.state[v, r], 0.0, waypoint)
            leg = leg_energy(mission, r, finish, tree.state[v, r], way)
            ending[r, n_targets] = leg * (1.0 + params.route_margin)
    now = RoutingArrays(
        problem.goals,
        cost,
        tree.energy[v],
        problem.capacity,
        problem.reserve,
        problem.escape,
        ~tree.visited[v],
        ending,
        problem.time,
        problem.finish_time,
        problem.limit,
        problem.charge_power,
        problem.energy_weight,
        problem.makespan_weight,
    )
    return solve_routing(
        now,
        params.levels,
        params.iterations,
        params.alpha,
        params.rounds,
        random,
        tour,
        length,
    )
