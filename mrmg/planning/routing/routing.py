"""The discrete problem: who visits which goals in what order, recharging where.

An energy-constrained multi-start open route problem with recharging, solved by nested
rollout policy adaptation and local search with exact placing of the stations.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mrmg.planning.routing import _routing_kernels
from mrmg.planning.routing._nrpa_kernels import RoutingArrays
from mrmg.planning.routing._routes_kernels import IMPOSSIBLE


@dataclass(frozen=True, slots=True, kw_only=True)
class RouterParams:
    """Parameters of the router.

    Attributes:
        method: name of the router (`routers.find_router`): "nrpa" alone, "search"
            (NRPA, then ruin and recreate), "exact", or one of another package. The
            other parameters are of the first two; tours that are drawn anew while a
            tree grows are always theirs.
        levels: nesting levels of NRPA.
        iterations: iterations of each level.
        alpha: step of the policy adaptation.
        rounds: most rounds of ruin and recreate, fewer if there are few goals; 0 leaves
            the order NRPA found.
    """

    method: str = "search"
    levels: int = 1
    iterations: int = 20
    alpha: float = 1.0
    rounds: int = 600


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
    finish_distance: np.ndarray | None = None,
    time: np.ndarray | None = None,
    finish_time: np.ndarray | None = None,
    limit: np.ndarray | None = None,
    charge_power: np.ndarray | None = None,
    energy_weight: float = 1.0,
    makespan_weight: float = 0.0,
) -> RoutingArrays:
    """Return the routing problem of a fleet of R robots with T targets.

    Args:
        goals: number of goals G among the targets.
        distance: weighted length from target to target [m], shape (R, T, T).
        start_distance: from each robot to each target [m], shape (R, T).
        plain: energy per metre of plain ground [J/m], shape (R,).
        energy: energy now [J], shape (R,).
        capacity: [J], shape (R,).
        reserve: [J], shape (R,).
        open_goal: which goals are still to be visited; all if None.
        finish_distance: from each target, and last from its start, to each robot's
            finish [m], shape (R, T + 1); inf for no way, 0 (or None) to end anywhere.
        time: from each target, and last from the start, to each target with the dwell
            there [s], shape (R, T + 1, T); nothing takes time if None.
        finish_time: from there to the finish [s], shape (R, T + 1); 0 if None.
        limit: longest time of each robot's route [s], shape (R,); none if None.
        charge_power: of stations for each battery [W], shape (R,); at once if None.
        energy_weight: of the summed energy in the objective.
        makespan_weight: of the longest time of a route in the objective [J/s].
    """
    robots, targets = start_distance.shape
    metres = np.concatenate([distance, start_distance[:, None, :]], axis=1)
    cost = np.ascontiguousarray(metres * plain[:, None, None])
    finish = _filled(finish_distance, 0.0, (robots, targets + 1)) * plain[:, None]
    return RoutingArrays(
        goals=goals,
        cost=cost,
        # Contiguous, or kernels would be compiled anew for columns of a record array.
        energy=np.ascontiguousarray(energy, dtype=float),
        capacity=np.ascontiguousarray(capacity, dtype=float),
        reserve=np.ascontiguousarray(reserve, dtype=float),
        escape=_escape(cost, finish, goals),
        open_goal=np.ones(goals, bool) if open_goal is None else open_goal,
        finish=finish,
        time=_filled(time, 0.0, cost.shape),
        finish_time=_filled(finish_time, 0.0, finish.shape),
        limit=_filled(limit, np.inf, (robots,)),
        charge_power=_filled(charge_power, np.inf, (robots,)),
        energy_weight=float(energy_weight),
        makespan_weight=float(makespan_weight),
    )


def _escape(cost: np.ndarray, finish: np.ndarray, goals: int) -> np.ndarray:
    """Return the energy from each target to the nearest place of safety, (R, T)."""
    to_station = cost[:, :-1, goals:]
    if not to_station.shape[2]:
        return np.ascontiguousarray(finish[:, :-1])
    nearest = np.asarray(to_station.min(axis=2))
    closed = finish.any(axis=1, keepdims=True)
    return np.where(closed, np.minimum(nearest, finish[:, :-1]), nearest)


def _filled(
    values: np.ndarray | None, otherwise: float, shape: tuple[int, ...]
) -> np.ndarray:
    if values is None:
        return np.full(shape, otherwise)
    return np.ascontiguousarray(values, dtype=float)


def tour_room(goals: int, targets: int) -> int:
    """Return the most targets a tour may hold: three for a goal, every station once."""
    return 2 * goals + targets + 3


def solve_routing(problem: RoutingArrays, params: RouterParams, seed: int) -> Routing:
    """Solve a routing problem; the same seed gives the same tours."""
    robots = len(problem.energy)
    room = tour_room(problem.goals, problem.cost.shape[2])
    tour = np.zeros((robots, room), np.int64)
    length = np.zeros(robots, np.int64)
    cost = _routing_kernels.solve_routing(
        problem,
        params.levels,
        params.iterations,
        params.alpha,
        params.rounds,
        np.array([seed], np.uint64),
        tour,
        length,
    )
    tours = tuple(
        tuple(int(t) for t in row[:n]) for row, n in zip(tour, length, strict=True)
    )
    return Routing(tours, float(cost) if cost < IMPOSSIBLE else float("inf"))
