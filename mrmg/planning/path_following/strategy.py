"""The default planner: path following along tours, and a search where that fails.

Its attempts differ by a schedule: which tours are drawn, for which energies, and what
they must leave in batteries.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import product

import numpy as np

from mrmg.planning.attempt import Attempt, GivenUp, Request, least_refusal
from mrmg.planning.parameters import PlannerParams
from mrmg.planning.path_following.coordination.coordination import coordinated
from mrmg.planning.path_following.coordination.rounds import rounds_of
from mrmg.planning.path_following.coordination.tasks import no_path
from mrmg.planning.path_following.draws import Draw, Tours, drawn_tours, tours_of
from mrmg.planning.path_following.driven_legs import Driven, with_driven_legs
from mrmg.planning.path_following.following import (
    LEAST_SOC_MARGIN,
    can_follow,
    follow_tours,
)
from mrmg.planning.path_following.refine import ROBOTS_MEET, along_trajectories, refine
from mrmg.planning.problem.problem import Problem
from mrmg.planning.problem.targets import whole_tours
from mrmg.planning.problem.time_weighting import time_counts
from mrmg.plans import Plan

TIME_SHARES = (1.0, 0.95, 0.85, 0.7)
"""Shares of the time limit that the tours of successive attempts may take: driving
takes longer than by the roadmap where robots turn much or get in each other's way."""

DRAWS_PER_ATTEMPT = 4
"""Tours drawn by each attempt after the first one, of which the best are followed."""

FURTHER_DRAWS = (1, 3)
"""Draws that the first attempt goes on with where its first one fails: the next is of
other energies, the third of energies that differ most."""

SEARCH_MARGINS = (1.0, 0.0, 2.0)
"""Multiples of the route margin in the tours of successive searches: batteries may
leave no room for it, or driving may take more than it allows for."""

LEAST_GAIN = 0.001
"""Share of the objective that a refinement must save to be followed by another."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Schedule:
    """What one attempt tries, in this order.

    Attributes:
        time_share: of the time limit that tours may take.
        followed: state-of-charge margins with draws of tours that are followed, one
            after another until there is a plan.
        search_margin: surcharge on the energies of the tours that are searched along.
    """

    time_share: float
    followed: tuple[tuple[float, tuple[Draw, ...]], ...]
    search_margin: float

    @staticmethod
    def of(problem: Problem, params: PlannerParams, number: int) -> Schedule:
        """Return the schedule of attempt `number`."""
        timed = time_counts(problem.scene)
        limited = np.isfinite(problem.preference.limit_s)
        alone = number == 0 or timed or limited
        first = number * DRAWS_PER_ATTEMPT
        numbers = range(first, first + (1 if alone else DRAWS_PER_ATTEMPT))
        draws = tuple(Draw.of(one, timed) for one in numbers)
        wanted = max(params.soc_margin, LEAST_SOC_MARGIN)
        followed = [(wanted, draws), (LEAST_SOC_MARGIN, draws)]
        if number == 0:
            further = [(Draw.of(one, timed),) for one in FURTHER_DRAWS]
            followed += [(LEAST_SOC_MARGIN, each) for each in further]
        margin = params.route_margin * SEARCH_MARGINS[number % len(SEARCH_MARGINS)]
        followed.append((LEAST_SOC_MARGIN, (Draw(first, 0.0, margin),)))
        return Schedule(
            time_share=TIME_SHARES[number % len(TIME_SHARES)],
            followed=tuple(followed) if follows(problem, params) else (),
            search_margin=margin,
        )


@dataclass(slots=True)
class Learnt:
    """What an attempt learns by following tours.

    Attributes:
        useless: least state-of-charge margin at which tours are of no use.
        met: whether robots got in each other's way so that no motions were found.
        searched: whether these were searched for without any path.
        took: what driving took.
    """

    useless: dict[Tours, float] = field(default_factory=dict)
    met: bool = False
    searched: bool = False
    took: Driven = field(default_factory=Driven)


def follows(problem: Problem, params: PlannerParams) -> bool:
    """Return whether paths are followed, or motions are searched for at once."""
    return params.follow_paths and can_follow(problem)


def easiest(problem: Problem, params: PlannerParams) -> Problem:
    """Return the problem of the least energies that tours are drawn for.

    A plan may be found along tours that it has, though not with every draw of tours.
    """
    if follows(problem, params):
        return problem.with_margin(0.0).with_soc_margin(LEAST_SOC_MARGIN)
    return problem.with_margin(params.route_margin).with_soc_margin(0.0)


def path_following(problem: Problem, request: Request) -> Attempt:
    """Follow paths along tours; where that fails, search for motions along others."""
    schedule = Schedule.of(problem, request.params, request.number)
    problem = problem.with_limit(schedule.time_share)
    found = Attempt(tours_found=False)
    for tried in _tries(problem, request, schedule):
        found = tried.after(found)
        if found.plans or request.halted:
            break
    return found


def _tries(problem: Problem, request: Request, schedule: Schedule) -> Iterator[Attempt]:
    """Yield what came of each entry of a schedule.

    What driving along tours took corrects the energies that the next ones are found
    for.
    """
    learnt = Learnt()
    for soc_margin, draws in schedule.followed:
        kept = with_driven_legs(problem.with_soc_margin(soc_margin), learnt.took)
        yield follow_paths(kept, request, draws, soc_margin, learnt)
    for soc_margin in (request.params.soc_margin, 0.0):  # until there are tours
        kept = problem.with_soc_margin(soc_margin).with_margin(schedule.search_margin)
        searched = search_motions(kept, request, further=int(learnt.searched))
        yield searched
        if searched.tours_found:
            return


def search_motions(problem: Problem, request: Request, further: int = 0) -> Attempt:
    """Search for motions along tours, and refine their plan.

    Args:
        problem: the mission.
        request: the attempt.
        further: how many rounds further than that of the attempt the search begins.
    """
    began = time.perf_counter()
    routing = tours_of(problem, request)
    routing_s = time.perf_counter() - began
    if not routing.feasible or request.halted:
        return Attempt(routing_s=routing_s, tours_found=routing.feasible)
    targets = whole_tours(problem.mission.targets, routing.tours)
    trajectories = coordinated(
        problem,
        targets,
        [no_path(problem, r) for r in range(len(targets))],
        request.halt,
        seed=request.stream_seed("coordination"),
        rounds=rounds_of(request.number + further),
    )
    tours = problem.visits(routing.tours)
    plans: list[Plan] = []
    found_at = []
    plan, refused = None, None
    if trajectories:
        plan, refused = request.plan_or_refusal(problem, trajectories, tours)
    if refused:  # batteries may suffice along smoother paths
        smooth = along_trajectories(problem, targets, trajectories, request.halt)
        if smooth:
            plan, other = request.plan_or_refusal(problem, smooth, tours)
            refused = least_refusal(refused, other)
    left = request.params.refinements
    while plan is not None:
        plans.append(plan)
        found_at.append(time.perf_counter())
        late = problem.preference.late_s(plan) > 0.0
        sooner = replace(problem, minimum_time=late)
        better = plan
        if left > 0:
            better = refine(sooner, request, plan)
        enough = not problem.preference.gains(better, plan, LEAST_GAIN)
        plan = better if better is not plan else None
        left = 0 if enough else left - 1
    counts = {"coordinated": 1, "router_calls": 1}
    given_up = _given_up(problem, request, plans)
    return Attempt(
        plans, found_at, routing_s, counts, refused=refused, given_up=given_up
    )


def _given_up(problem: Problem, request: Request, plans: Sequence[Plan]) -> GivenUp:
    """Return whether plans of a problem leave less in batteries than is wanted."""
    if problem.soc_margin >= request.params.soc_margin:
        return GivenUp.NONE
    wanted = problem.with_soc_margin(request.params.soc_margin)
    kept = all(request.plan(wanted, one.trajectories, one.tours) for one in plans)
    return GivenUp.NONE if kept else GivenUp.CHARGE


def follow_paths(
    problem: Problem,
    request: Request,
    draws: tuple[Draw, ...],
    soc_margin: float,
    learnt: Learnt,
) -> Attempt:
    """Drive straight along tours.

    The first attempt takes the router's tours as they are; others the best of several
    draws.

    Args:
        problem: the mission.
        request: the attempt.
        draws: of tours.
        soc_margin: state-of-charge margin that plans must leave.
        learnt: by following tours before; receives what is learnt by these.
    """
    began = time.perf_counter()
    choice, calls = drawn_tours(problem, request, draws)
    routing_s = time.perf_counter() - began
    problem = problem.with_margin(0.0)
    preference = problem.preference
    plans: list[Plan] = []
    found_at: list[float] = []
    blocked, refused, driven = "", None, 0
    for tours, minimum_time in product(choice, (False, True)):
        if request.halted or (plans and not preference.late_s(plans[-1])):
            break
        useless = soc_margin >= learnt.useless.get(tours.tours, np.inf)
        if not plans and (minimum_time or useless):
            continue
        driven += 1
        followed = follow_tours(
            replace(problem, minimum_time=minimum_time),
            request,
            tours,
            rounds_of(request.number + learnt.met),
        )
        learnt.met |= followed.failure == ROBOTS_MEET
        learnt.searched |= learnt.met and not followed.led
        learnt.useless[tours.tours] = soc_margin if followed.driven else 0.0
        plan, blocked = followed.plan, followed.failure or blocked
        refused = least_refusal(refused, followed.refused)
        learnt.took.update(followed.took)
        if plan is not None and (
            not plans or preference.rank(plan) < preference.rank(plans[-1])
        ):
            plans.append(plan)
            found_at.append(time.perf_counter())
    counts = {"path_following_plans": driven, "router_calls": calls}
    given_up = _given_up(problem, request, plans)
    return Attempt(
        plans, found_at, routing_s, counts, bool(choice), blocked, refused, given_up
    )
