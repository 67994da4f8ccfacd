"""The discrete problem: who visits which goals in what order, recharging where.

An energy-constrained multi-start open route problem with recharging, solved by nested
rollout policy adaptation and local search with exact placing of the stations.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mrmg.planning import _routing_kernels
from mrmg.planning._nrpa_kernels import RoutingArrays
from mrmg.planning._refuel_kernels import IMPOSSIBLE


@dataclass(frozen=True, slots=True, kw_only=True)
class RouterParams:
    """Parameters of the router.

    Attributes:
        levels: nesting levels of NRPA.
        iterations: iterations of each level.
        alpha: step of the policy adaptation.
        kicks: restarts of the local search; 0 leaves NRPA's answer as it is.
    """

    levels: int = 2
    iterations: int = 20
    alpha: float = 1.0
    kicks: int = 20


@dataclass(frozen=True, slots=True)
class Routing:
    """An answer of the router.

    Attributes:
        tours: targets of each robot in order, stations included.
        cost_J: their energy; infinite if no feasible tours were found.
    """

    tours: tuple[tuple[int, ...], ...]
    cost_J: float

    @property
    def feasible(self) -> bool:
        """Whether tours were found."""
        return bool(np.isfinite(self.cost_J))


def routing_arrays(
    *,
    goals: int,
    distance: np.ndarray,
    start_distance: np.ndarray,
    plain: np.ndarray,
    energy: np.ndarray,
    capacity: np.ndarray,
    reserve: np.ndarray,
    open_goal: np.ndarray | None = None,
) -> RoutingArrays:
    """Return the routing problem of a fleet.

    Args:
        goals: number of goals G among the T targets.
        distance: weighted length from target to target [m], shape (R, T, T).
        start_distance: from each robot to each target [m], shape (R, T).
        plain: energy per metre of plain ground [J/m], shape (R,).
        energy: energy now [J], shape (R,).
        capacity: [J], shape (R,).
        reserve: [J], shape (R,).
        open_goal: which goals are still to be visited; all if None.
    """
    cost = np.concatenate([distance, start_distance[:, None, :]], axis=1)
    cost = np.ascontiguousarray(cost * plain[:, None, None])
    to_station = cost[:, :-1, goals:]
    if to_station.shape[2]:
        escape = to_station.min(axis=2)
    else:
        escape = np.zeros(cost.shape[::2])
    return RoutingArrays(
        goals=goals,
        cost=cost,
        # Contiguous, or kernels would be compiled anew for columns of a record array.
        energy=np.ascontiguousarray(energy, dtype=float),
        capacity=np.ascontiguousarray(capacity, dtype=float),
        reserve=np.ascontiguousarray(reserve, dtype=float),
        escape=np.ascontiguousarray(escape),
        open_goal=np.ones(goals, bool) if open_goal is None else open_goal,
    )


def solve_routing(problem: RoutingArrays, params: RouterParams, seed: int) -> Routing:
    """Solve a routing problem; the same seed gives the same tours."""
    robots = len(problem.energy)
    tour = np.zeros((robots, 3 * problem.goals + 3), np.int64)
    length = np.zeros(robots, np.int64)
    cost = _routing_kernels.solve_routing(
        problem,
        params.levels,
        params.iterations,
        params.alpha,
        params.kicks,
        np.array([seed], np.uint64),
        tour,
        length,
    )
    tours = tuple(
        tuple(int(t) for t in row[:n]) for row, n in zip(tour, length, strict=True)
    )
    return Routing(tours, float(cost) if cost < IMPOSSIBLE else float("inf"))
