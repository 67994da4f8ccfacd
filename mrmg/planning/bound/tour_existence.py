"""Proof that no tours exist which keep every battery above its reserve.

A relaxed mission, in which every leg costs at most what it must (`bound.Relaxation`),
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
from dataclasses import dataclass, replace

import numpy as np
import shapely

from mrmg.energy.metering import SHORTEST_ON_SLOPES_S
from mrmg.planning.bound import _bound_kernels
from mrmg.planning.bound.bound import Relaxation
from mrmg.planning.bound.exact_tours import MOST_GOALS
from mrmg.planning.halting import NEVER, check
from mrmg.planning.path_bounds import outer_polygon
from mrmg.planning.roadmap.slopes import climb_J, height_span_m
from mrmg.planning.routing._nrpa_kernels import RoutingArrays
from mrmg.planning.routing.shortfall import least_share
from mrmg.scene.types import Scene

ENDLESS_J = 1e15
"""Stands for a battery that never runs out, finite so that differences are."""


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
    if not scene.goals and not any(robot.finish for robot in scene.robots):
        return None
    if scene.elevation is not None and step_s < SHORTEST_ON_SLOPES_S:
        return None  # slopes are charged over longer times, in which speeds may change
    relaxed = Relaxation.of(scene, step_s=step_s, with_finishes=True, halt=halt)
    problem = _with_climbs(relaxed)
    for goals in _goals_to_try(problem):
        check(halt)
        fleet = RelaxedFleet(problem, goals)
        if not fleet.visits()[-1]:
            return fleet.proof()
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
    yield np.sort(remote[:MOST_GOALS])
    yield from remote[MOST_GOALS:, None]


@dataclass(frozen=True)
class RelaxedFleet:
    """Which goals a fleet can visit together, for batteries of any size.

    Attributes:
        problem: the mission, with legs that cost at most what they must.
        goals: numbers of n goals, the only ones to be visited.
    """

    problem: RoutingArrays
    goals: np.ndarray

    def visits(self, share: float = 0.0) -> np.ndarray:
        """Return which subsets the fleet can visit, shape (2^n,).

        Args:
            share: by which the usable energy of all batteries is larger than it is.
        """
        fleet = np.full(1 << len(self.goals), np.inf)
        fleet[0] = 0.0
        for r in range(len(self.problem.energy)):
            own = self.robot_visits(r, *(1.0 + share) * self._usable_J(r))
            fleet, _ = _bound_kernels.join_robot(fleet, np.where(own, 0.0, np.inf))
        return np.asarray(np.isfinite(fleet))

    def proof(self) -> NoTours:
        """Return the proof that the fleet cannot visit all goals."""
        robots = range(len(self.problem.energy))
        subsets = np.flatnonzero(self.visits())
        most = max((int(one) for one in subsets), key=int.bit_count, default=0)
        nowhere = replace(self, goals=self.goals[:0])
        singles = {
            int(goal): replace(self, goals=np.array([goal])) for goal in self.goals
        }
        endless = (ENDLESS_J, ENDLESS_J)
        return NoTours(
            goals=tuple(singles),
            left_out=tuple(g for i, g in enumerate(singles) if not most >> i & 1),
            unreachable=tuple(
                goal
                for goal, alone in singles.items()
                if not any(alone.robot_visits(r, *endless)[1] for r in robots)
            ),
            cut_off=tuple(
                r for r in robots if not nowhere.robot_visits(r, *endless)[0]
            ),
            homeless=tuple(
                r for r in robots if not nowhere.robot_visits(r, *self._usable_J(r))[0]
            ),
            share=least_share(lambda share: bool(self.visits(share)[-1]))[0],
        )

    def _usable_J(self, r: int) -> np.ndarray:
        """Return what is above the reserve at the start and in a full battery, (2,)."""
        problem = self.problem
        whole = (problem.energy[r], problem.capacity[r])
        return np.array(whole) - float(problem.reserve[r])

    def robot_visits(self, r: int, start_J: float, full_J: float) -> np.ndarray:
        """Return which subsets one robot can visit and then end, shape (2^n,).

        Args:
            r: robot.
            start_J: energy above the reserve at the start.
            full_J: energy above the reserve of a full battery.
        """
        n, first = len(self.goals), self.problem.goals
        cost, finish = self.problem.cost[r], self.problem.finish[r]
        start = cost.shape[1]
        hops = _closure(cost[first:start, first:] <= full_J)
        subset = np.arange(1 << n)
        size = np.array([int(one).bit_count() for one in subset])
        left = np.full((1 << n, n), -np.inf)
        ends = np.zeros(1 << n, bool)
        place, energy = np.array([start]), np.array([[start_J]])
        for k in range(n + 1):
            now = subset[size == k]
            if k:
                place, energy = self.goals, left[now]
            arrives = (energy[:, :, None] >= cost[place, first:]).any(axis=1)
            at_station = (arrives[:, :, None] & hops).any(axis=1)
            ends[now] = (energy >= finish[place]).any(axis=1)
            ends[now] |= (at_station & (full_J >= finish[first:start])).any(axis=1)
            for g, goal in enumerate(self.goals):
                ahead = (now >> g & 1) == 0
                most = (energy[ahead] - cost[place, goal]).max(axis=1)
                over = np.where(
                    at_station[ahead], full_J - cost[first:start, goal], -np.inf
                )
                most = np.maximum(most, over.max(axis=1, initial=-np.inf))
                most = np.where(most >= 0.0, np.minimum(most, full_J), -np.inf)
                left[now[ahead] | 1 << g, g] = most
        for g in range(n):  # whoever can visit more can visit less
            without = subset[(subset >> g & 1) == 0]
            ends[without] |= ends[without | 1 << g]
        return ends


def _closure(hops: np.ndarray) -> np.ndarray:
    """Return from which station which others can be got to over any others."""
    joined = np.asarray(hops | np.eye(len(hops), dtype=bool))
    for k in range(len(joined)):
        joined |= joined[:, k : k + 1] & joined[k : k + 1]
    return joined
