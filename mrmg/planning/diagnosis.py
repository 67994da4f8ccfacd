"""Why a search ended without a plan: a proof that there is none, or an obstacle.

Roadmap energies prove nothing, as there may be better paths; proofs are of relaxed
missions (`feasibility`, `bound`).
"""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import replace
from functools import cached_property

import numpy as np

from mrmg import seeding
from mrmg.compared import compared
from mrmg.counted import counted
from mrmg.planning import endings
from mrmg.planning.attempt import Request
from mrmg.planning.bound.joint_bound import Divisions
from mrmg.planning.bound.makespan_bound import makespan_bound_s
from mrmg.planning.bound.tour_existence import NoTours, proof_of_no_tours
from mrmg.planning.endings import listed
from mrmg.planning.feasibility import (
    energy_and_metres,
    proof_of_infeasibility,
)
from mrmg.planning.frame import Frame
from mrmg.planning.halting import NEVER, Halted
from mrmg.planning.meetings import narrowest_meeting
from mrmg.planning.parameters import PlannerParams
from mrmg.planning.path_following.strategy import easiest, path_following
from mrmg.planning.preference import TIME_MARGIN_S
from mrmg.planning.problem.little_room import little_room
from mrmg.planning.problem.openings import passages_missing
from mrmg.planning.problem.problem import (
    Problem,
    state_mission,
    unjoined,
)
from mrmg.planning.room import finish_cut_off, goal_cut_off
from mrmg.planning.routing.routing import solve_routing
from mrmg.planning.routing.shortfall import MAX_SHARE, shortfall
from mrmg.planning.search import Search
from mrmg.planning.statistics import Statistics
from mrmg.plans import PlanStatus
from mrmg.scene.objective import overtime_s
from mrmg.scene.types import Robot, Scene


class Proofs:
    """The proofs that a mission has no solution, each sought once and when needed.

    They are given up once `halt[0]` has turned true.
    """

    def __init__(self, scene: Scene, step_s: float, halt: np.ndarray = NEVER) -> None:
        self.scene = scene
        self.step_s = step_s
        self.halt = halt

    def reason(self, *, tours_missing: bool) -> str | None:
        """Return why no plan exists, or None if no proof is known.

        Args:
            tours_missing: whether to search all tours, which takes seconds, and is of
                no use where the router found some or the bound of energy is finite.
        """
        with suppress(Halted):
            return self._simple or (self._of_no_tours if tours_missing else None)
        return None

    @cached_property
    def _simple(self) -> str | None:
        return proof_of_infeasibility(self.scene, self.halt) or self._of_lateness()

    def _of_lateness(self) -> str | None:
        """Return why no plan can keep the time limit, or None if no proof is known."""
        limit_s = self.scene.time_limit_s
        if math.isinf(limit_s):
            return None
        least_s = makespan_bound_s(self.scene, step_s=self.step_s, halt=self.halt)
        if math.isinf(least_s) or not overtime_s(limit_s, least_s):
            return None
        least, _ = compared(least_s, limit_s, 1)
        return endings.TOO_LATE.format(limit_s=limit_s, least=least)

    @cached_property
    def _of_no_tours(self) -> str | None:
        proof = proof_of_no_tours(self.scene, self.step_s, self.halt)
        if proof is not None:
            return _sentence(self.scene, proof)
        limit_s = self.scene.time_limit_s
        if math.isinf(limit_s):
            return None
        divisions = Divisions.of(self.scene, step_s=self.step_s, halt=self.halt)
        if divisions is None or math.isfinite(divisions.energy_within_J(limit_s)):
            return None
        return endings.NO_TIMELY_TOURS.format(limit_s=limit_s)


def _sentence(scene: Scene, proof: NoTours) -> str:
    """Return the reason that a proof gives."""
    names = [goal.id for goal in scene.goals]
    if proof.unreachable:
        return goal_cut_off(scene, scene.goals[proof.unreachable[0]])
    if proof.cut_off:
        return finish_cut_off(scene, scene.robots[proof.cut_off[0]])
    if proof.homeless:
        robot = scene.robots[proof.homeless[0]]
        more = _more_energy(robot, proof.share)
        return endings.FINISH_OUT_OF_ENERGY.format(robot=robot.id, more=more)
    robot = max(scene.robots, key=_usable_J)
    return endings.NO_TOURS.format(
        served=len(proof.goals) - len(proof.left_out),
        goals=counted(len(proof.goals), "goal")
        if len(proof.goals) == len(names)
        else f"the {len(proof.goals)} most remote goals",
        left_out=listed([names[g] for g in proof.left_out]),
        more=_more_energy(robot, proof.share),
    )


def _usable_J(robot: Robot) -> float:
    return robot.battery.capacity_J - robot.battery.reserve_J


def _more_energy(robot: Robot, share: float) -> str:
    """Return in words how much more usable energy batteries must hold."""
    if math.isinf(share):
        return "many times the usable energy"
    if share == 0.0:
        return "slightly more usable energy"
    more = energy_and_metres(share * _usable_J(robot), robot)
    return f"{share:.0%} more usable energy, which is {more} for {robot.id}"


def _unjoined(
    problem: Problem, params: PlannerParams, *, stations: bool
) -> tuple[str, str]:
    """Return goals and finishes that robots know no path to, or stations, and why.

    Args:
        problem: the mission as it lies, with the roadmap of its frame.
        params: of planning.
        stations: whether stations are asked for.
    """
    scene, targets = problem.scene, problem.roadmap.targets
    goals, places = len(scene.goals), len(scene.targets())
    lacking = [
        (r, t)
        for r, t in unjoined(scene, problem.roadmap)
        if (goals <= t < places) == stations
    ]
    names = [targets[t] if t < places else f"the {targets[t]}" for _, t in lacking]
    frame = Frame.of(scene, params.margins)
    margins = frame.params(params).margins
    passages = passages_missing(frame.scene(scene), margins, lacking, frame.on_the_map)
    return listed([*dict.fromkeys(names)]), "; ".join(passages)


def why_no_plan(
    problem: Problem, request: Request, search: Search
) -> tuple[PlanStatus, str]:
    """Return how a search ended that found neither a plan nor a proof, and why."""
    params, statistics = request.params, search.statistics
    if statistics.left_s(params.budget_s) > 0.0:
        return PlanStatus.NO_PLAN_FOUND, _obstacle(problem, request, search)
    if not search.begun:
        return why_in_time(params, statistics)
    so_far = _obstacle(problem, request, search) if search.attempts else ""
    return why_in_time(params, statistics, search, so_far)


def why_in_time(
    params: PlannerParams,
    statistics: Statistics,
    search: Search | None = None,
    so_far: str = "",
) -> tuple[PlanStatus, str]:
    """Return how planning ended whose budget is over.

    Args:
        params: with the budget.
        statistics: of planning.
        search: what it had come to; None if it was still to begin.
        so_far: why it has no plan, if there was time to find out.
    """
    if search is None:
        return PlanStatus.TIMEOUT, endings.BUDGET_FOR_ROADMAP.format(
            budget_s=params.budget_s, init_s=statistics.time_s["init"]
        )
    made = counted(search.attempts, "attempt")
    return PlanStatus.TIMEOUT, endings.BUDGET_OVER.format(
        budget_s=params.budget_s,
        attempts=made if search.attempts else "less than one attempt",
        so_far=so_far or "no plan was found",
    )


def _obstacle(problem: Problem, request: Request, search: Search) -> str:
    """Return what stood in the way of a plan."""
    scene, params, seed = problem.scene, request.params, request.seed
    places, passages = _unjoined(problem, params, stations=False)
    if places:
        return endings.NO_PATH.format(places=places, passages=passages)
    crammed = [*little_room(scene, params.margins)]
    if crammed:
        return "; ".join(crammed)
    if not search.tours_found:
        return _missing_tours(problem, params, seed)
    if math.isfinite(search.earliest_s):
        latest_s = scene.time_limit_s - TIME_MARGIN_S
        return endings.LATE.format(
            earliest=compared(search.earliest_s, latest_s, 1)[0],
            limit_s=scene.time_limit_s,
            margin_s=TIME_MARGIN_S,
        )
    if search.refused:  # neither headings nor room stood in the way of these motions
        blocked = f"; with others, {search.blocked}" if search.blocked else ""
        return endings.REFUSED.format(refused=search.refused.why, blocked=blocked)
    rounds = search.statistics.counts.get("coordinated", 0)
    searched = f", and {counted(rounds, 'search', 'searches')} for motions found none"
    searched = searched if rounds else ""
    in_time = search.statistics.left_s(params.budget_s) > 0.0
    headings = _headings_in_the_way(scene, request) if in_time else []
    if headings:
        return endings.HEADINGS.format(places=listed(headings), searched=searched)
    routing = solve_routing(
        easiest(problem, params).mission.routing,
        params.router,
        seeding.stream_seed(seed, "meeting"),
    )
    known = [search.blocked, narrowest_meeting(problem, routing.tours, params.margins)]
    robots = listed([robot.id for robot in scene.robots])
    blocked = "; ".join(filter(None, known)) or f"no motions were found of {robots}"
    return endings.NO_PROGRESS.format(blocked=blocked, searched=searched)


def _headings_in_the_way(scene: Scene, request: Request) -> list[str]:
    """Return the places with headings, if one attempt without these finds a plan."""
    goals = [goal.id for goal in scene.goals if goal.heading_rad is not None]
    headed = [
        robot.id
        for robot in scene.robots
        if robot.finish and robot.finish.heading_rad is not None
    ]
    if not goals + headed:
        return []
    free = replace(
        scene,
        goals=tuple(replace(goal, heading_rad=None) for goal in scene.goals),
        robots=tuple(
            replace(robot, finish=replace(robot.finish, heading_rad=None))
            if robot.finish
            else robot
            for robot in scene.robots
        ),
    )
    frame = Frame.of(free, request.params.margins)
    params = frame.params(request.params)
    problem = state_mission(frame.scene(free), request.seed, params, request.halt)
    found = path_following(problem, request)
    return goals + [f"the finish of {name}" for name in headed] if found.plans else []


def _missing_tours(problem: Problem, params: PlannerParams, seed: int) -> str:
    """Return which goals tours leave out on the roadmap, and what they are short of."""
    scene = problem.scene
    missing = shortfall(
        easiest(problem, params).mission.routing,
        params.router,
        seeding.stream_seed(seed, "shortfall"),
    )
    names = [scene.goals[g].id for g in missing.left_out]
    left_out = f"leave out {listed(names)}" if names else "cannot be driven"
    robot = max(scene.robots, key=_usable_J)
    if missing.time_share:
        longer_s = missing.time_share * scene.time_limit_s
        remedy = f"they need a time limit about {longer_s:.0f} s longer"
    else:
        more = _more_energy(robot, missing.battery_share)
        remedy = f"they need batteries with about {more}"
        if math.isinf(missing.battery_share):
            remedy = _no_battery_helps(scene)
    stations, why = _unjoined(problem, params, stations=True)
    if stations:
        remedy = f"{remedy}; no path was found to {stations}: {why}"
    limit = ""
    if math.isfinite(scene.time_limit_s):
        limit = f" and the time limit of {scene.time_limit_s:g} s"
    return endings.NO_TOURS_FOUND.format(limit=limit, left_out=left_out, remedy=remedy)


def _no_battery_helps(scene: Scene) -> str:
    """Return why batteries of many times the capacity do not help, in words."""
    empty = [
        robot.id
        for robot in scene.robots
        if robot.battery.start_J <= robot.battery.reserve_J
    ]
    if empty:
        return f"{listed(empty)} start with no energy above the reserve"
    return f"not even {1.0 + MAX_SHARE:.0f} times the usable energy is enough"
