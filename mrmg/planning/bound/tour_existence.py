"""Proof that no tours exist which keep every battery above its reserve.

A relaxed mission, in which every leg costs at most what it must (`relaxation`),
is searched completely. With V_r(S, g) the most energy above the reserve that robot r
can have left at goal g after goals S, c_r a leg's bound and F_r a full battery,

    V_r(S + h, h) = max(max_g V_r(S, g) - c_r(g, h), max_s F_r - c_r(s, h))

over the goals g of S and the stations s that r can get to after S; negative values are
none at all, and values above F_r count as F_r. F_r includes what motion at top speed is
worth. On slopes a leg costs its climb, too, from the highest ground of the region that
it leaves to the lowest one of the other, which is less than nothing downhill.

More energy left is never worse, so V decides which subsets each robot can visit; a
fleet visits what its robots can divide among them. Every plan that the verifier accepts
is a path through the relaxed mission: each robot touches its goals and stations in some
order, each leg drains at least its bound, and a station leaves at most a full battery.

Goals that are left out only make a mission easier, so missions of more than MOST_GOALS
goals are tried by their most remote ones together and by all others one by one.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import shapely

from mrmg.energy.metering import SHORTEST_ON_SLOPES_S
from mrmg.planning.bound.exact_tours import (
    MOST_GOALS,
    MOST_LABELS,
    least_costs,
    of_robot,
    with_endless_batteries,
)
from mrmg.planning.bound.relaxation import Relaxation
from mrmg.planning.halting import NEVER, check
from mrmg.planning.path_bounds import outer_polygon
from mrmg.planning.roadmap.slopes import climb_J, height_span_m
from mrmg.planning.routing._nrpa_kernels import RoutingArrays
from mrmg.planning.routing.shortfall import least_share, with_batteries
from mrmg.scene.types import Scene


@dataclass(frozen=True, slots=True, kw_only=True)
class NoTours:
    """Proof that a mission has no tours that its batteries allow.

    Attributes:
        goals: numbers of the goals that cannot all be visited, whatever happens to the
            others.
        left_out: those of them that the fleet leaves out where it visits most.
        unreachable: those that no robot gets to with any battery.
        cut_off: numbers of the robots that cannot get to their finishes with any
            battery.
        homeless: numbers of the robots that cannot get to their finishes with theirs.
        share: the usable energy of all batteries must grow by more than this share; inf
            if nothing that was tried is enough.
    """

    goals: tuple[int, ...]
    left_out: tuple[int, ...]
    unreachable: tuple[int, ...]
    cut_off: tuple[int, ...]
    homeless: tuple[int, ...]
    share: float


def proof_of_no_tours(
    scene: Scene, step_s: float, halt: np.ndarray = NEVER
) -> NoTours | None:
    """Return the proof that no tours exist, or None if none is known.

    Args:
        scene: the mission.
        step_s: time step of the plans.
        halt: shape (1,); the proof is given up once it has turned true.

    Raises:
        Halted: if it was given up.
    """
    if not scene.has_destinations:
        return None
    if scene.elevation is not None and step_s < SHORTEST_ON_SLOPES_S:
        return None  # slopes are charged over longer times, in which speeds may change
    if scene.has_custom_motion:
        return None  # see `lower_bound_J`
    relaxed = Relaxation.of(scene, step_s=step_s, halt=halt)
    problem = _with_climbs(relaxed)
    for goals in _goals_to_try(problem):
        check(halt)
        if not visits(problem, goals)[-1]:
            return proof_of(problem, goals)
    return None


def _with_climbs(relaxed: Relaxation) -> RoutingArrays:
    """Return the problem in which each leg costs its climb, too."""
    scene, problem = relaxed.scene, relaxed.problem
    if scene.elevation is None:
        return problem
    regions = [outer_polygon(target.region) for target in scene.targets()]
    cost, finish = problem.cost.copy(), problem.finish.copy()
    for r, robot in enumerate(scene.robots):
        places = [*regions, shapely.Point(*robot.pose[:2])]
        low_m, high_m = np.array([height_span_m(scene, robot, p) for p in places]).T
        joules = climb_J(robot, 1.0)
        cost[r] += joules * (low_m[None, :-1] - high_m[:, None])
        if robot.finish:
            end = outer_polygon(robot.finish.region)
            finish[r] += joules * (height_span_m(scene, robot, end)[0] - high_m)
    batteries = [robot.battery for robot in scene.robots]
    kinetic_J = np.array([robot.model.top_kinetic_J for robot in scene.robots])
    return problem._replace(
        cost=cost,
        finish=finish,
        energy=np.array([battery.start_J for battery in batteries]),
        capacity=np.array([battery.capacity_J for battery in batteries]) + kinetic_J,
    )


def _goals_to_try(problem: RoutingArrays) -> Iterator[np.ndarray]:
    """Yield the most remote goals, and then each of the others."""
    apart_J = problem.cost[:, -1, : problem.goals].min(axis=0)
    remote = np.argsort(-apart_J, kind="stable")
    most, (robots, places, _) = MOST_GOALS, problem.cost.shape
    while most > 1 and robots * (places << most) > MOST_LABELS:
        most -= 1
    yield np.sort(remote[:most])
    yield from remote[most:, None]


def visits(problem: RoutingArrays, goals: np.ndarray, share: float = 0.0) -> np.ndarray:
    """Return which subsets of n goals a fleet can visit and then end, shape (2^n,).

    Args:
        problem: the mission, with legs that cost at most what they must.
        goals: their numbers; no others are to be visited.
        share: by which the usable energy of all batteries is larger than it is.

    Returns:
        Flags; all of them where it takes too many labels to tell.
    """
    least = least_costs(with_batteries(problem, share), goals, free=True)
    if least is None:
        return np.ones(1 << len(goals), bool)
    return np.asarray(np.isfinite(least))


def proof_of(problem: RoutingArrays, goals: np.ndarray) -> NoTours:
    """Return the proof that a fleet cannot visit all of some goals, as `visits`."""
    subsets = np.flatnonzero(visits(problem, goals))
    most = max((int(one) for one in subsets), key=int.bit_count, default=0)
    endless = with_endless_batteries(problem)
    robots, numbers = range(len(problem.energy)), [int(goal) for goal in goals]
    return NoTours(
        goals=tuple(numbers),
        left_out=tuple(g for i, g in enumerate(numbers) if not most >> i & 1),
        unreachable=tuple(
            g for g in numbers if not any(_can_visit(endless, r, g) for r in robots)
        ),
        cut_off=tuple(r for r in robots if not _can_visit(endless, r)),
        homeless=tuple(r for r in robots if not _can_visit(problem, r)),
        share=least_share(lambda share: bool(visits(problem, goals, share)[-1]))[0],
    )


def _can_visit(problem: RoutingArrays, r: int, *goals: int) -> bool:
    """Return whether one robot of a fleet can visit goals and then end."""
    return bool(visits(of_robot(problem, r), np.array(goals, np.int64))[-1])
