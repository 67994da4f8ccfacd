"""Plans driven straight along tours.

The roadmap's paths along tours are smoothed and followed in closed loop
(`refine.drive_paths`). Where that succeeds, nearly always where there is room, that
is all. A robot that does not get through, or to a heading, drives over poses (`poses`).
Where robots get in each other's way, a search for motions starts from the paths
(`coordination`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import radians

import numpy as np

from mrmg.motion._kernels import UNICYCLE, USER
from mrmg.planning.assembly import Refusal
from mrmg.planning.attempt import Request
from mrmg.planning.path_following._band_kernels import CostMap
from mrmg.planning.path_following.arrivals import with_arrivals
from mrmg.planning.path_following.band import (
    TRACKING_M,
    Path,
    smooth_path,
    turns_of,
)
from mrmg.planning.path_following.coordination.rounds import ROUNDS, Round
from mrmg.planning.path_following.coordination.tasks import is_one_pose
from mrmg.planning.path_following.cost_map import cost_maps_of
from mrmg.planning.path_following.driven_legs import Driven, what_driving_took
from mrmg.planning.path_following.gears import with_best_gears, with_least_turning
from mrmg.planning.path_following.refine import drive_paths
from mrmg.planning.path_following.robot_task import RobotTask
from mrmg.planning.problem.problem import Problem
from mrmg.planning.problem.targets import whole_tours
from mrmg.planning.problem.time_weighting import time_counts
from mrmg.planning.routing.routing import Routing
from mrmg.plans import Plan

SHARP = radians(110.0)
"""Turn at a target from which on a car goes on in its other gear [rad]."""

REVERSE_SPEED_SHARE = 0.9
"""Share of its speed forwards from which on a car is as fast backwards."""

LEAST_SOC_MARGIN = 0.02
"""Share of a battery's capacity that plans always leave above its reserve: a robot may
take a percent or two more than planned on slopes and in turns on the spot."""

JUDGED_M = 4.0
"""Distance of the nodes of paths that only tours are judged by."""


def can_follow(problem: Problem) -> bool:
    """Return whether path following knows how all robots drive, not so a user's."""
    return bool((problem.mission.fleet["model"] != USER).all())


@dataclass(frozen=True, slots=True)
class Followed:
    """What following tours gave.

    Attributes:
        plan: along them, None if there is none.
        failure: why they could not be driven, in words.
        refused: why driving them gave no plan.
        driven: whether they could be driven, if not on the charge there is.
        led: whether a path led any robot.
        took: what driving took, if that gave no plan.
    """

    plan: Plan | None
    failure: str = ""
    refused: Refusal | None = None
    driven: bool = True
    led: bool = True
    took: Driven = field(default_factory=Driven)


def follow_tours(
    problem: Problem,
    request: Request,
    routing: Routing,
    rounds: Sequence[Round] = ROUNDS[:1],
) -> Followed:
    """Plan along tours.

    A robot that does not get through drives over poses, if there is a way.

    Args:
        problem: the mission.
        request: the attempt; the first one finds a plan soon rather than a cheap one.
        routing: the tours.
        rounds: of the search for motions where robots get in each other's way.
    """
    cost_maps, first = cost_maps_of(problem), request.number == 0
    stops = whole_tours(problem.mission.targets, routing.tours)
    tours = problem.visits(routing.tours)
    timed = problem.minimum_time or time_counts(problem.scene)
    tasks = []
    for r, (tour, cost_map) in enumerate(zip(stops, cost_maps, strict=True)):
        if request.halted:
            return Followed(None, driven=False)
        # The search for motions nearly always finds a curve to a single target with a
        # heading at once; along paths there are cheaper ones, which take longer.
        ahead = [] if first and is_one_pose(problem, r, tour) else tour
        path = tour_path(problem, r, ahead, timed)
        path = _geared(problem, r, cost_map, path, judged=not (first or timed))
        tasks.append(RobotTask(tour, path, cost_map))
    trajectories, failure = drive_paths(
        problem, tasks, request.halt, soon=first, rounds=rounds
    )
    if not trajectories:
        led = any(len(task.path.target) > 0 for task in tasks)
        return Followed(None, failure, driven=False, led=led)
    plan, refused = request.plan_or_refusal(problem, trajectories, tours)
    if plan is not None:
        return Followed(plan)
    took = what_driving_took(problem, trajectories, tours)
    return Followed(None, refused=refused, took=took)


def path_cost_J(problem: Problem, routing: Routing) -> float:
    """Return the cost of tours along smoothed paths of few nodes [J]."""
    plain = problem.mission.fleet["plain"]
    total, tours = 0.0, whole_tours(problem.mission.targets, routing.tours)
    for r, cost_map in enumerate(cost_maps_of(problem)):
        path = tour_path(problem, r, tours[r])
        _, cost_m = smooth_path(problem.mission.targets, cost_map, path, (JUDGED_M,))
        total += cost_m * float(plain[r])
    return total


def tour_path(
    problem: Problem,
    r: int,
    tour: Sequence[int],
    timed: bool = False,
) -> Path:
    """Return the way of the roadmap along robot r's tour.

    A car that can changes gear at a target where its way turns sharply, but not where
    time counts and it is slower backwards; a robot that turns on the spot has the gears
    in which it turns least.

    Args:
        problem: the mission.
        r: robot.
        tour: numbers of its targets.
        timed: whether time counts.
    """
    vertices, ends = problem.tour_vertices(r, tour)
    node = problem.roadmap.arrays.vertex[vertices]
    moves = np.hypot(*np.diff(node, axis=0).T) > 0.0
    node = node[np.concatenate([[True], moves])]
    stops = np.concatenate([[0], np.cumsum(moves)])[ends].astype(np.int64)
    heading = float(problem.start[r, 2])
    path = Path(
        node=node,
        gear=np.ones(len(node) - 1, np.int64),
        stop=stops,
        target=np.array(tour, np.int64),
        deeper=np.full(len(tour), TRACKING_M),
        heading=heading,
        pause_s=np.zeros(len(tour)),
        aim=problem.aims(r, tour),
    )
    if problem.mission.fleet[r]["model"] == UNICYCLE:
        return with_least_turning(problem, r, path)
    backwards, forwards = np.abs(problem.mission.fleet[r]["limit"][:2])
    least = REVERSE_SPEED_SHARE * forwards if timed else 0.0
    for at, turn in turns_of(path):
        if turn > SHARP and backwards > 0.0 and backwards >= least:
            path.gear[at:] *= -1
    return path


def _geared(
    problem: Problem, r: int, cost_map: CostMap, path: Path, judged: bool
) -> Path:
    """Return a path with the gears that look best, of a car if it may be priced."""
    robot = problem.mission.fleet[r]
    if robot["model"] == UNICYCLE or not robot["limit"][0] < 0.0:
        return path
    path = with_arrivals(problem, r, cost_map, path)
    if not judged:
        return path
    return with_best_gears(problem, r, cost_map, path, turns_of(path))
