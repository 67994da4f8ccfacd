"""One attempt at a mission: tours, a draft or a motion tree along them, its plan."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from mrmg import seeding
from mrmg.mission import Plan
from mrmg.planning.assembly import make_plan
from mrmg.planning.drafting import draftable, drafts
from mrmg.planning.motion_tree import Problem, grow_tree
from mrmg.planning.parameters import PlannerParams
from mrmg.planning.refine import refine
from mrmg.planning.routers import route

MARGINS = (1.0, 0.0, 2.0)
"""Multiples of the route margin that successive trees are grown with."""


SPREADS = (0.0, 0.03, 0.08, 0.05)
"""Spread of the random factors on the roadmap's energies for successive drafts."""

LEAST_GAIN = 0.001
"""Share of the objective that a refinement must save to be followed by another."""


@dataclass(frozen=True, slots=True)
class Attempt:
    """What one attempt gave.

    Attributes:
        plans: those found, each better than the one before, with the time of
            `time.perf_counter()` when it was found; some may be late.
        routing_s: time the tours took.
        counts: of the tree; empty if there were no tours to grow it along.
    """

    plans: Sequence[tuple[float, Plan]] = ()
    routing_s: float = 0.0
    counts: Mapping[str, int] = field(default_factory=dict)


def attempt_plan(
    problem: Problem, seed: int, params: PlannerParams, number: int, halt: np.ndarray
) -> Attempt:
    """Draw tours and find a plan along them; a function of seed and number alone.

    Tours are drafted first (`drafting`); where that is not possible or fails, a tree
    grows along tours of its own.

    Args:
        problem: the mission.
        seed: of the whole search.
        params: parameters.
        number: of the attempt; each has its own random streams.
        halt: shape (1,); the attempt ends soon after it has turned true.
    """
    drafted = Attempt()
    if params.drafts and draftable(problem):
        drafted = draft_plans(problem, seed, params, number, halt)
        if drafted.plans or halt[0]:
            return drafted
    tree = tree_plans(problem, seed, params, number, halt)
    return replace(tree, routing_s=drafted.routing_s + tree.routing_s)


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
        return Attempt(routing_s=routing_s)
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
        hurried = replace(problem, hurried=problem.preference.late_s(plan) > 0.0)
        better = refine(hurried, params, plan, halt) if left > 0 else plan
        enough = not problem.preference.gains(better, plan, LEAST_GAIN)
        plan = better if better is not plan else None
        left = 0 if enough else left - 1
    return Attempt(plans, routing_s, growth.counts)


def draft_plans(
    problem: Problem, seed: int, params: PlannerParams, number: int, halt: np.ndarray
) -> Attempt:
    """Drive straight along tours for energies that differ by chance.

    Those of the roadmap are not quite what driving takes, so that other tours may turn
    out to be cheaper.
    """
    began = time.perf_counter()
    problem = problem.with_margin(0.0)
    draw = seeding.stream_seed(seed, "draft", number)
    spread = SPREADS[number % len(SPREADS)]
    shape = problem.mission.routing.cost.shape[1:]
    noise = seeding.stream(seed, "costs", number).standard_normal(shape)
    routing = problem.mission.routing
    factor = np.exp(spread * noise)
    routing = routing._replace(cost=routing.cost * factor, time=routing.time * factor)
    tours = route(routing, params.router, draw)
    routing_s = time.perf_counter() - began
    if not tours.feasible or halt[0]:
        return Attempt(routing_s=routing_s)
    plans: list[tuple[float, Plan]] = []
    preference = problem.preference
    for hurried in (False, True):
        if hurried and not (plans and preference.late_s(plans[-1][1])):
            break
        pressed = replace(problem, hurried=hurried)
        for plan in drafts(pressed, params, tours, seed, halt):
            if not plans or preference.rank(plan) < preference.rank(plans[-1][1]):
                plans.append((time.perf_counter(), plan))
    return Attempt(plans, routing_s)
