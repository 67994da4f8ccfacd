"""A proven lower bound of a fleet's energy.

Whoever solves a mission visits the goals and recharges at stations in some order. The
energy of that is at least the rolling resistance on the shortest ways (`geodesic`), as
a robot that starts and ends at rest gets no inertia for nothing, and turning, idling
and other robots only cost more. Who must end somewhere drives on to there. The least
over all orders is the bound (`relaxation` says what a leg costs).

Orders are distinguished by where each region is touched first (`touring`), as the way
through a region is no more for nothing than any other. Legs of the cheapest orders are
those of visibility graphs (`visibility`), all others those of fields. Where goals are
many, not all visits are remembered (`counted_visits`); where there are more still,
trees with prices span them (`relaxed_routing_J`).

With more obstacles no cell that none can enter is cheaper, and no tours are cheaper
where no leg is. Yet an obstacle or a goal more may lower the bound; the greater of both
holds. What a field certifies of a leg may be less, by less than half a percent in all
that was tried: fields are solved and then divided by how much too steep they are, which
depends on where fronts meet. And where obstacles are joined to terrain by another one,
or a goal is next to them, less is known of how far ways keep from them (`clearance`),
which is worth 0.1 to 3 %.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mrmg.planning.bound import _bound_kernels
from mrmg.planning.bound.completions import over_stations
from mrmg.planning.bound.counted_visits import counted_visits
from mrmg.planning.bound.exact_tours import are_few, exact_routing
from mrmg.planning.bound.relaxation import CELLS, FINER, Relaxation
from mrmg.planning.bound.touring import touring_bound_J
from mrmg.planning.halting import NEVER
from mrmg.planning.routing._nrpa_kernels import RoutingArrays
from mrmg.planning.routing.routing import RouterParams, solve_routing
from mrmg.scene.types import Scene

SPANNING_ROUNDS = 400
"""Changes of the prices in the bound of missions with more goals."""

ROUNDS = 60
"""Times that the ways of the cheapest tours are tightened at most."""

MOST_TARGETS = 64
"""Goals and stations up to which tours are told apart by arcs, by the memory for legs
from arc to arc (134 MB) ..."""

MOST_LEGS = 20_000
"""... and legs of all robots between them, by the time that their arcs take."""

ROUNDING_SHARE = 1e-9
"""What rounding may add to a bound; taken off."""


def lower_bound_J(
    scene: Scene,
    *,
    step_s: float = 0.1,
    cells: int = CELLS,
    rounds: int = ROUNDS,
    finer: int = FINER,
    halt: np.ndarray = NEVER,
) -> float:
    """Return an energy [J] that no plan of a mission undercuts.

    None is known of robots with a custom motion model: a step is charged by the speeds
    at its ends, and such a model need not drive that way in it.

    Args:
        scene: the mission.
        step_s: time step of the plans.
        cells: cells of the grid on which ways are bounded; more bring the bound nearer
            to the truth.
        rounds: how often the ways of the cheapest tours are tightened; as `cells`.
        finer: parts into which cells are cut for that; as `cells`.
        halt: shape (1,); once it has turned true, what is proven is returned.

    Returns:
        The bound, at least 0; inf if the mission is proven to have no solution.

    Raises:
        Halted: if nothing is proven by then.
    """
    if not scene.has_destinations or scene.has_custom_motion:
        return 0.0
    few = are_few(len(scene.goals), len(scene.robots))
    targets = len(scene.targets())
    legs = len(scene.robots) * targets**2
    by_arcs = few or (targets <= MOST_TARGETS and legs <= MOST_LEGS)
    relaxed = Relaxation.of(
        scene, step_s=step_s, cells=cells, shared=not by_arcs, halt=halt
    )
    problem = relaxed.with_end_climbs()
    routing = exact_routing(problem) if few else None
    bound = routing.cost_J if routing else relaxed_routing_J(problem)
    if scene.goals and by_arcs and rounds and not halt[0]:
        routing = routing or solve_routing(problem, RouterParams(), 0)
        if routing.feasible:
            bound = touring_bound_J(
                problem,
                replace(routing, cost_J=bound),
                relaxed.arc_ways(finer),
                relaxed.price,
                visits=None if few else counted_visits(problem),
                rounds=rounds,
                halt=halt,
            )
    return max(0.0, bound) * (1.0 - ROUNDING_SHARE)


def relaxed_routing_J(problem: RoutingArrays) -> float:
    """Return a lower bound of the cost of all tours of a mission of any size.

    Robots are exchangeable but for their starts, and batteries only limit single legs;
    the bound is that of spanning trees with prices (`_bound_kernels.spanning_bound`).
    Each robot ends where that costs least.
    """
    goals, start = problem.goals, problem.cost.shape[2]
    goal_list = np.flatnonzero(problem.open_goal)
    usable = np.array([problem.capacity, problem.energy]) - problem.reserve
    owner = np.unique(problem.table, return_index=True)[1]
    most = np.broadcast_to(usable[0, owner, None, None], problem.cost.shape).copy()
    most[problem.table, problem.home] = usable[1, :, None]
    legs = np.where(problem.cost <= most, problem.cost, np.inf)
    legs = over_stations(legs, range(goals, start))[..., goal_list]
    between = np.min(legs[:, goal_list], axis=0)
    symmetric = np.ascontiguousarray(np.minimum(between, between.T))
    first = np.ascontiguousarray(legs[problem.table, problem.home])
    tree_J = _bound_kernels.spanning_bound(symmetric, first, SPANNING_ROUNDS)
    return float(tree_J + problem.finish.min(axis=1).sum())
