"""One attempt at a mission by a planner: tours, motions along them, a plan."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import product

import numpy as np

from mrmg import seeding
from mrmg.planning.assembly import make_plan
from mrmg.planning.drafting.drafting import LEAST_SPARE, draftable, drafts, path_cost_J
from mrmg.planning.drafting.refine import refine
from mrmg.planning.guided_tree.planner import grow_guided_tree
from mrmg.planning.parameters import GUIDED_TREE, PlannerParams
from mrmg.planning.problem.problem import Problem
from mrmg.planning.routers import route
from mrmg.planning.routing.routing import Routing
from mrmg.planning.tree.motion_tree import grow_tree
from mrmg.plans import Plan

MARGINS = (1.0, 0.0, 2.0)
"""Multiples of the route margin that successive trees are grown with."""


SPARES = ((1.0, 0.0), (1.0, 0.0), (0.0,))
"""Multiples of the spare charge that successive trees are grown with: the next one
where there are no tours that leave so much."""

DRAWS = 4
"""Tours drawn by each attempt after the first one."""

UNLIKE = (1, 3)
"""Draws that the first attempt goes on with where its first one fails."""

SPREADS = (0.0, 0.04, 0.08, 0.12, 0.06)
"""Spread of the random factors on the roadmap's energies for successive draws."""

SURCHARGES = (0.0, 0.0, -0.06)
"""Surcharge on the roadmap's energies for successive draws."""

TIMED_SURCHARGES = (0.06, 0.0, 0.12)
"""The same where the makespan counts: who brakes hard and turns round needs more."""

LIMITS = (1.0, 0.95, 0.85, 0.7)
"""Shares of the time limit that successive tours may take: driving takes longer than
the roadmap says where robots turn much or get in each other's way."""

LEAST_GAIN = 0.001
"""Share of the objective that a refinement must save to be followed by another."""


@dataclass(frozen=True, slots=True)
class Attempt:
    """What one attempt gave.

    Attributes:
        plans: those found, each better than the one before, with the time of
            `time.perf_counter()` when it was found; some may be late.
        routing_s: time the tours took.
        counts: drafts (fleets driven along tours), router calls, and those of the tree;
            empty if no tours were found for a tree.
        tours_found: whether the router found any.
        blocked: what stood in the way of a plan along them; "" if nothing did.
    """

    plans: Sequence[tuple[float, Plan]] = ()
    routing_s: float = 0.0
    counts: Mapping[str, int] = field(default_factory=dict)
    tours_found: bool = False
    blocked: str = ""


def router_problem(problem: Problem, params: PlannerParams) -> Problem:
    """Return the problem of the least energies that tours are drawn for.

    A plan may be found along tours that it has, though not with every draw of tours.
    """
    if params.drafts and draftable(problem):
        return problem.with_margin(0.0).with_soc_margin(LEAST_SPARE)
    return problem.with_margin(params.route_margin).with_soc_margin(0.0)


def attempt_plan(
    problem: Problem, seed: int, params: PlannerParams, number: int, halt: np.ndarray
) -> Attempt:
    """Find a plan; a function of seed and number alone.

    Planner guided_tree is the paper's method. Planner path_following follows paths
    along tours (`drafting`); where that is not possible or fails, an accelerated tree
    grows along tours of its own. Batteries keep `params.spare` if that can be.

    Args:
        problem: the mission.
        seed: of the whole search.
        params: parameters.
        number: of the attempt; each has its own random streams.
        halt: shape (1,); the attempt ends soon after it has turned true.
    """
    if params.planner == GUIDED_TREE:
        return guided_plans(problem, seed, params, number, halt)
    problem = problem.with_limit(LIMITS[number % len(LIMITS)])
    routing_s, tours_found, blocked = 0.0, False, ""
    counts: Counter[str] = Counter()
    drafted = Attempt()
    spares = sorted({max(params.spare, LEAST_SPARE), LEAST_SPARE}, reverse=True)
    drafting = params.drafts and draftable(problem)
    # The first attempt draws but once: where that fails, other tours may not.
    again = product((LEAST_SPARE,), UNLIKE if number == 0 else ())
    for spare, drawn in [*product(spares, (0,)), *again] if drafting else []:
        spared = problem.with_soc_margin(spare)
        drafted = draft_plans(spared, seed, params, number, halt, drawn=drawn)
        routing_s += drafted.routing_s
        counts.update(drafted.counts)
        tours_found |= drafted.tours_found
        blocked = drafted.blocked or blocked
        if drafted.plans or halt[0]:
            break
    found = drafted
    for spare in () if found.plans or halt[0] else SPARES[number % len(SPARES)]:
        spared = problem.with_soc_margin(spare * params.spare)
        found = tree_plans(spared, seed, params, number, halt)
        routing_s += found.routing_s
        counts.update(found.counts)
        tours_found |= found.tours_found
        if found.tours_found:
            break
    return Attempt(found.plans, routing_s, counts, tours_found, blocked)


def guided_plans(
    problem: Problem, seed: int, params: PlannerParams, number: int, halt: np.ndarray
) -> Attempt:
    """Grow the paper's motion tree, and return the plan that it leads to."""
    problem = problem.with_soc_margin(params.spare)
    draw = seeding.stream_seed(seed, "guided tree", number)
    growth = grow_guided_tree(problem, params, draw, halt)
    plan = None
    if growth.solved:
        plan = make_plan(problem, seed, params, growth.trajectories, growth.tours)
    plans = [] if plan is None else [(time.perf_counter(), plan)]
    done, cap = growth.counts["iterations"], growth.counts["iteration_cap"]
    return Attempt(
        plans,
        growth.routing_s,
        growth.counts,
        tours_found=growth.counts["vertices"] > 0,
        blocked=f"the guided tree did not solve it in {done} of at most {cap} "
        "iterations",
    )


def tree_plans(
    problem: Problem, seed: int, params: PlannerParams, number: int, halt: np.ndarray
) -> Attempt:
    """Grow a tree along tours, and refine its plan.

    The surcharge on the roadmap's energies changes from draw to draw: batteries may
    leave no room for it, or driving may take more than it allows for.
    """
    began = time.perf_counter()
    margin = MARGINS[number % len(MARGINS)] * params.route_margin
    problem = problem.with_margin(margin)
    draw = seeding.stream_seed(seed, "tours", number)
    routing = route(problem.mission.routing, params.router, draw)
    routing_s = time.perf_counter() - began
    if not routing.feasible or halt[0]:
        return Attempt(routing_s=routing_s, tours_found=routing.feasible)
    growth = grow_tree(
        problem, params, routing, seeding.stream_seed(seed, "tree", number), halt
    )
    plans = []
    plan = None
    if growth.solved:
        plan = make_plan(problem, seed, params, growth.trajectories, growth.tours)
    left = params.refinements
    while plan is not None:
        plans.append((time.perf_counter(), plan))
        hurried = replace(problem, minimum_time=problem.preference.late_s(plan) > 0.0)
        better = refine(hurried, params, plan, halt) if left > 0 else plan
        enough = not problem.preference.gains(better, plan, LEAST_GAIN)
        plan = better if better is not plan else None
        left = 0 if enough else left - 1
    counts = {**growth.counts, "trees": 1}
    return Attempt(plans, routing_s + growth.routing_s, counts, tours_found=True)


def draft_plans(
    problem: Problem,
    seed: int,
    params: PlannerParams,
    number: int,
    halt: np.ndarray,
    *,
    drawn: int = 0,
) -> Attempt:
    """Drive straight along tours.

    The first attempt takes the router's tours as they are; others the best of several
    draws.

    Args:
        problem: the mission.
        seed: of the whole search.
        params: parameters.
        number: of the attempt.
        halt: shape (1,); drafting ends soon after it has turned true.
        drawn: draws of this attempt that are left out.
    """
    began = time.perf_counter()
    draws = _draws(problem, number, drawn)
    choice = _drawn_tours(problem, seed, params, draws)
    routing_s = time.perf_counter() - began
    problem = problem.with_margin(0.0)
    preference = problem.preference
    plans: list[tuple[float, Plan]] = []
    failures = [""]
    driven = 0
    for tours, hurried in product(choice, (False, True)):
        if halt[0] or (plans and not preference.late_s(plans[-1][1])):
            break
        if hurried and not plans:
            continue
        driven += 1
        pressed = replace(problem, minimum_time=hurried)
        made = drafts(
            pressed,
            params,
            tours,
            seed,
            halt,
            hasty=number == 0,
            on_failure=failures.append,
        )
        for plan in made:
            if not plans or preference.rank(plan) < preference.rank(plans[-1][1]):
                plans.append((time.perf_counter(), plan))
    counts = {"path_following_plans": driven, "router_calls": len(draws)}
    return Attempt(plans, routing_s, counts, bool(choice), failures[-1])


def _draws(problem: Problem, number: int, drawn: int) -> range:
    """Return the numbers of an attempt's draws of tours, without those left out."""
    draws = range(number * DRAWS + drawn, (number + 1) * DRAWS)
    return draws[:1] if number == 0 or problem.preference.timed else draws


def _drawn_tours(
    problem: Problem, seed: int, params: PlannerParams, draws: range
) -> list[Routing]:
    """Return tours for energies that differ by chance, those that look best first.

    The roadmap's energies are not quite what driving takes: it leads through the middle
    of targets.
    """
    timed = problem.preference.objective.makespan_weight > 0.0
    surcharges = TIMED_SURCHARGES if timed else SURCHARGES
    found: dict[tuple[tuple[int, ...], ...], Routing] = {}
    for draw in draws:
        surcharged = problem.with_margin(surcharges[draw % len(surcharges)])
        routing = surcharged.mission.routing
        noise = seeding.stream(seed, "costs", draw).standard_normal(
            routing.cost.shape[1:]
        )
        factor = np.exp(SPREADS[draw % len(SPREADS)] * noise)
        tours = route(
            routing._replace(cost=routing.cost * factor, time=routing.time * factor),
            params.router,
            seeding.stream_seed(seed, "draft", draw),
        )
        if tours.feasible:
            found.setdefault(tours.tours, tours)
    if len(found) < 2:
        return list(found.values())
    return sorted(found.values(), key=partial(path_cost_J, problem))
