"""New tours on the way: the routing problem as it stands at a vertex of the tree."""

from __future__ import annotations

import numpy as np

from mrmg.compilation import kernel
from mrmg.planning.routing._nrpa_kernels import RoutingArrays
from mrmg.planning.routing._routes_kernels import add_absent, new_routes
from mrmg.planning.routing._routing_kernels import improve_routes, solve_routing
from mrmg.planning.tree._mission_kernels import leg_energy, look_ahead

AGAIN_SHARE = 0.2
"""Share of the rounds that searching on from the tours so far takes."""


@kernel
def elapsed(tree, v, dt):
    """Return the time from the root of the tree to a vertex [s]."""
    steps = 0
    while tree.parent[v] >= 0:
        steps += tree.steps[v]
        v = tree.parent[v]
    return steps * dt


@kernel
def read_rest(tree, tours, v, routes):
    """Write what is left of a vertex's tours into empty routes, without stations."""
    row = tree.tour[v]
    seen = tree.visited[v].copy()
    for r in range(tree.position.shape[1]):
        for p in range(tree.position[v, r], tours.length[row, r]):
            goal = tours.target[row, r, p]
            if goal < len(seen) and not seen[goal]:
                routes.goal[r, routes.length[r]] = goal
                routes.length[r] += 1
                seen[goal] = True
    add_absent(~tree.visited[v], seen, routes)


@kernel
def route_from(mission, tree, tours, v, random, tour, length):
    """Solve the routing problem from a vertex; return the cost [J].

    The search goes on from the rest of the vertex's tours. Without rounds of search,
    NRPA draws new ones.
    """
    problem, params = mission.routing, mission.params
    robots, _, n_targets = problem.cost.shape
    cost = problem.cost.copy()
    ending = problem.finish.copy()
    time = problem.time.copy()
    ending_time = problem.finish_time.copy()
    waypoint = np.empty(2)
    timed = problem.makespan_weight > 0.0
    for r in range(robots):
        timed |= problem.limit[r] < np.inf
    for r in range(robots):
        pace = (1.0 + params.route_margin) / mission.fleet[r].limit[1]
        for t in range(n_targets):
            way = look_ahead(mission, r, t, tree.state[v, r], 0.0, waypoint)
            leg = leg_energy(mission, r, t, tree.state[v, r], way)
            cost[r, n_targets, t] = leg * (1.0 + params.route_margin)
            if timed:
                time[r, n_targets, t] = way * pace + mission.targets.dwell[t]
        finish = mission.targets.finish[r]
        if finish >= 0:
            way = look_ahead(mission, r, finish, tree.state[v, r], 0.0, waypoint)
            leg = leg_energy(mission, r, finish, tree.state[v, r], way)
            ending[r, n_targets] = leg * (1.0 + params.route_margin)
            if timed:
                ending_time[r, n_targets] = way * pace
    now = RoutingArrays(
        problem.goals,
        cost,
        tree.energy[v],
        problem.capacity,
        problem.reserve,
        problem.escape,
        ~tree.visited[v],
        ending,
        time,
        ending_time,
        problem.limit - elapsed(tree, v, params.dt),
        problem.charge_power,
        problem.energy_weight,
        problem.makespan_weight,
    )
    if params.rounds > 0:
        routes = new_routes(robots, problem.goals)
        read_rest(tree, tours, v, routes)
        rounds = int(AGAIN_SHARE * params.rounds)
        return improve_routes(now, routes, rounds, random, tour, length)
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
