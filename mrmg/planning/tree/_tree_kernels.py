"""Growing the motion tree in the composite state space of all robots ."""

from __future__ import annotations

from math import hypot
from typing import NamedTuple

import numpy as np

from mrmg.compilation import by_reference, kernel, now_ns
from mrmg.motion._kernels import copy_numbers
from mrmg.planning.problem._safety_kernels import (
    braking_control,
    new_commitment,
    write_braking,
)
from mrmg.planning.problem._target_kernels import in_target
from mrmg.planning.routing._random_kernels import random_below, random_unit
from mrmg.planning.routing._routes_kernels import IMPOSSIBLE
from mrmg.planning.tree._expansion_kernels import choose_modes, expand
from mrmg.planning.tree._finish_kernels import all_finished, at_finish
from mrmg.planning.tree._groups_kernels import add_to_group, new_groups, select_vertex
from mrmg.planning.tree._maneuver_kernels import way_left
from mrmg.planning.tree._mission_kernels import leg_energy
from mrmg.planning.tree._rerouting_kernels import route_from
from mrmg.planning.tree._staying_kernels import (
    has_visited_station,
    is_queuing,
    must_stay,
    staying_worth,
)

EXPANSIONS_PER_VERTEX = 8
"""A tree is given up after this many expansions for each vertex it may have."""

SHUFFLED = 0.3
"""How often the right of way is drawn anew instead of following the scene's order."""

STALLED_M = 0.3
"""Way per expansion below which a robot that then stands has not got on."""

FAILED_ROUTES = 60
"""A tree is given up after this many vertices from which no tours are feasible."""

VERTICES, GROUPS, ROUTER_CALLS, EXPANSIONS, ROUTER_FAILURES, ROUTING_NS = range(6)
"""Places in the array of counts; the last is the time that router calls took."""


@by_reference
class Tours(NamedTuple):
    """The tours the vertices of a tree follow.

    Attributes:
        target: targets in order, shape (rows, R, L).
        length: number of targets, shape (rows, R).
    """

    target: np.ndarray
    length: np.ndarray


@kernel
def next_targets(mission, tree, tours, v, target):
    """Write each robot's next target at a vertex, -1 for none."""
    row = tree.tour[v]
    for r in range(len(target)):
        p = tree.position[v, r]
        target[r] = mission.targets.finish[r]
        if p < tours.length[row, r]:
            target[r] = tours.target[row, r, p]
        elif target[r] >= 0 and at_finish(mission, r, target[r], tree.state[v, r]):
            target[r] = -1


@kernel
def skip_visited(mission, tree, tours, v):
    """Advance a vertex's places in its tours past goals somebody has visited."""
    row = tree.tour[v]
    for r in range(tree.position.shape[1]):
        while tree.position[v, r] < tours.length[row, r]:
            t = tours.target[row, r, tree.position[v, r]]
            if t >= mission.targets.goals or not tree.visited[v, t]:
                break
            tree.position[v, r] += 1


@kernel
def goals_left(tree, v):
    """Return the number of goals not visited at a vertex."""
    left = 0
    for g in range(tree.visited.shape[1]):
        left += not tree.visited[v, g]
    return left


@kernel
def is_over(mission, tree, v):
    """Tell whether the mission may end at a vertex, all robots braking from there."""
    return goals_left(tree, v) == 0 and all_finished(mission, tree.state[v])


@kernel
def rest_of_tours(mission, tree, tours, v, otherwise):
    """Return (energy the rest of the tours takes [J], whether the batteries allow it).

    The route margin is left out: it is there to be used up by driving.

    Args:
        mission, tree, tours, v: the vertex.
        otherwise: energy taken for a first leg whose way is not known [J].
    """
    fleet = mission.fleet
    row = tree.tour[v]
    waypoint = np.empty(2)
    surcharge = 1.0 + mission.params.route_margin
    total = 0.0
    enough = True
    for r in range(len(fleet)):
        left = tree.energy[v, r] - fleet[r].reserve
        place = -1
        for p in range(tree.position[v, r], tours.length[row, r]):
            t = tours.target[row, r, p]
            if t < mission.targets.goals and tree.visited[v, t]:
                continue
            staying = place < 0 and tree.serving[v, r] == t
            if place >= 0:
                leg = mission.routing.cost[r, place, t] / surcharge
            elif staying:
                leg = 0.0
            else:
                to_go, turning = way_left(mission, r, t, tree.state[v, r], waypoint)
                leg = otherwise
                if to_go < np.inf:
                    leg = leg_energy(mission, r, t, tree.state[v, r], to_go)
                # Turning ranks vertices; it takes less energy than it is counted as.
                total += turning * fleet[r].plain if to_go < np.inf else 0.0
            total += leg
            if must_stay(mission, r, t):
                spent = tree.spent[v, r] if staying else 0.0
                content = tree.energy[v, r] if staying else 0.0
                total += staying_worth(mission, r, t, spent, content)
            left -= leg
            enough &= left >= 0.0
            if t >= mission.targets.goals:
                left = fleet[r].capacity - fleet[r].reserve
            place = t
        finish = mission.targets.finish[r]
        if finish >= 0:
            leg = mission.last_leg[r, place]
            if place < 0:
                to_go, turning = way_left(
                    mission, r, finish, tree.state[v, r], waypoint
                )
                leg = otherwise
                if to_go < np.inf:
                    leg = leg_energy(mission, r, finish, tree.state[v, r], to_go)
            total += leg
            enough &= left >= leg
    return total, enough


@kernel
def plant(mission, tree, tours, start, energy):
    """Write the root of the tree; return the energy of the first tours [J]."""
    for r in range(len(start)):
        copy_numbers(start[r], tree.state[0, r])
    copy_numbers(energy, tree.energy[0])
    for g in range(mission.targets.goals):
        for r in range(len(start)):
            passing = mission.targets.dwell[g] == 0.0
            if passing and in_target(mission.targets, g, start[r, 0], start[r, 1]):
                tree.visited[0, g] = True
    skip_visited(mission, tree, tours, np.int64(0))
    initial = 1e-9
    for r in range(len(start)):
        place = mission.routing.cost.shape[2]
        for p in range(tours.length[0, r]):
            initial += mission.routing.cost[r, place, tours.target[0, r, p]]
            place = tours.target[0, r, p]
            if must_stay(mission, r, place):
                initial += staying_worth(mission, r, place, 0.0, 0.0)
        initial += mission.last_leg[r, place]
    tree.remaining[0] = initial
    return initial


@kernel
def extend(mission, tree, v, n, target, steer, random):
    """Expand vertex v into the unused vertex n.

    Returns:
        (whether anybody moved, whether a target was reached, whether all stayed above
        their reserve).
    """
    robots = len(target)
    mode = np.zeros(robots, np.int64)
    stuck = np.zeros(robots, np.int64)
    choose_modes(tree, v, target, mission.params, steer, random, stuck, mode)
    order = np.arange(robots)
    if random_unit(random) < SHUFFLED:
        for r in range(robots - 1, 0, -1):
            other = random_below(random, r + 1)
            order[r], order[other] = order[other], order[r]
    tree.parent[n] = v
    tree.tour[n] = tree.tour[v]
    for r in range(robots):
        copy_numbers(tree.state[v, r], tree.state[n, r])
    copy_numbers(tree.energy[v], tree.energy[n])
    copy_numbers(tree.visited[v], tree.visited[n])
    copy_numbers(tree.serving[v], tree.serving[n])
    copy_numbers(tree.spent[v], tree.spent[n])
    copy_numbers(tree.position[v], tree.position[n])
    copy_numbers(tree.gear[v], tree.gear[n])
    tree.steps[n], event, alive = expand(
        mission,
        tree.state[n],
        tree.energy[n],
        tree.visited[n],
        tree.serving[n],
        tree.spent[n],
        target,
        mode,
        tree.gear[n],
        stuck,
        order,
        random,
        tree.control[n],
    )
    moved = False
    for r in range(robots):
        far = hypot(
            tree.state[n, r, 0] - tree.state[v, r, 0],
            tree.state[n, r, 1] - tree.state[v, r, 1],
        )
        moved |= far > 0.02 or tree.spent[n, r] > tree.spent[v, r]
        stands = far < STALLED_M and abs(tree.state[n, r, 3]) < STALLED_M
        held = target[r] >= 0 and stands and not event
        held &= tree.serving[n, r] != target[r]
        held &= not is_queuing(mission, tree.serving[n], r, target[r])
        tree.stalled[n, r] = tree.stalled[v, r] + 1 if held else 0
    return moved, event, alive


@kernel
def insert(mission, tree, tours, n, n_tours, target, random, counts):
    """Complete vertex n: visits, the feasibility of its tours, new tours.

    A child follows the rest of its parent's tours as long as the batteries allow it;
    else, the router is called.

    Returns:
        (whether the vertex is worth keeping, number of tours).
    """
    v = tree.parent[n]
    for r in range(len(target)):
        if has_visited_station(
            mission, r, target[r], tree.state[n, r], tree.serving[n, r],
            tree.spent[n, r], tree.energy[n, r],
        ):  # fmt: skip
            tree.position[n, r] += 1
    skip_visited(mission, tree, tours, n)
    if is_over(mission, tree, n):
        tree.remaining[n] = 0.0
        return True, n_tours
    tree.remaining[n], enough = rest_of_tours(
        mission, tree, tours, n, tree.remaining[v]
    )
    if enough:
        return True, n_tours
    if n_tours == len(tours.target) or goals_left(tree, n) == 0:
        return enough, n_tours
    began = now_ns()
    cost = route_from(
        mission, tree, tours, n, random,
        tours.target[n_tours], tours.length[n_tours],
    )  # fmt: skip
    counts[ROUTING_NS] += now_ns() - began
    counts[ROUTER_CALLS] += 1
    if cost >= IMPOSSIBLE:
        counts[ROUTER_FAILURES] += not enough
        return enough, n_tours
    tree.tour[n] = n_tours
    for r in range(len(target)):
        tree.position[n, r] = 0
    tree.remaining[n] = cost
    if mission.params.optioned:
        # What the router minimises is then not what vertices are rated by.
        tree.remaining[n], _ = rest_of_tours(mission, tree, tours, n, tree.remaining[v])
    return True, n_tours + 1


@kernel
def grow(mission, start, energy, random, tree, tours, counts, halt):
    """Grow a motion tree until all goals are visited .

    Args:
        mission: the problem.
        start: composite state at the start, shape (R, 5).
        energy: battery contents at the start [J], shape (R,).
        random: state of the generator; changed in place.
        tree: `new_tree`; filled.
        tours: table of tours; row 0 holds the first ones, the others are filled.
        counts: receives the numbers of vertices, groups, router calls and expansions.
        halt: shape (1,); another thread may turn it true to end the search.

    Returns:
        The vertex at which all goals are visited, or -1.
    """
    params = mission.params
    groups = new_groups(params.max_vertices)
    target = np.zeros(len(start), np.int64)
    initial = plant(mission, tree, tours, start, energy)
    if is_over(mission, tree, np.int64(0)):
        return 0
    n_groups = add_to_group(groups, tree, np.int64(0), np.int64(0), params.region)
    n_tours = n = np.int64(1)  # typed: a literal would be compiled for on its own
    counts[ROUTER_CALLS] = 1
    steer = params.steer_start
    most = EXPANSIONS_PER_VERTEX * params.max_vertices
    while (
        not halt[0]
        and n < params.max_vertices
        and counts[EXPANSIONS] < most
        and counts[ROUTER_FAILURES] < FAILED_ROUTES
    ):
        counts[EXPANSIONS] += 1
        v = select_vertex(groups, tree, n_groups, params, initial, random)
        next_targets(mission, tree, tours, v, target)
        moved, event, alive = extend(mission, tree, v, n, target, steer, random)
        steer = max(params.steer_least, steer * params.steer_decay)
        if not alive:
            continue
        if not moved and not event:
            # Nobody got on: remember it, so that the vertex tries something else.
            for r in range(len(target)):
                tree.stalled[v, r] += target[r] >= 0
            continue
        kept, n_tours = insert(mission, tree, tours, n, n_tours, target, random, counts)
        if not kept:
            continue
        if is_over(mission, tree, n):
            counts[VERTICES] = n + 1
            counts[GROUPS] = n_groups
            return n
        n_groups = add_to_group(groups, tree, n_groups, n, params.region)
        n += 1
    counts[VERTICES] = n
    counts[GROUPS] = n_groups
    return -1


@kernel
def stop_all(fleet, gates, state, dt):
    """Return the controls that brake all robots to rest from a vertex, shape (n, R, 2).

    The commitments of the vertex are what is carried out, so this is always safe.
    """
    robots = len(state)
    commitment = new_commitment(fleet, gates, dt)
    longest = 0
    for r in range(robots):
        write_braking(fleet, r, state[r], dt, commitment, 0)
        longest = max(longest, commitment.length[r, 0] - 1)
    control = np.zeros((longest, robots, 2))
    for k in range(longest):
        for r in range(robots):
            i = min(k, commitment.length[r, 0] - 1)
            u1, u2 = braking_control(fleet, r, commitment.state[r, 0, i], dt)
            control[k, r, 0], control[k, r, 1] = u1, u2
    return control
