"""The routing problem as it is stated: ways in metres, robots, what they have."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mrmg.planning.routing._nrpa_kernels import RoutingArrays


@dataclass(frozen=True, slots=True, kw_only=True)
class RoutingInstance:
    """A routing problem of a fleet of R robots with T targets.

    Attributes:
        goals: number of goals G among the targets.
        distance: weighted length from target to target [m], shape (C, T, T).
        start_distance: from each robot to each target [m], shape (R, T).
        plain: energy per metre of plain ground [J/m], shape (R,).
        energy: energy now [J], shape (R,).
        capacity: [J], shape (R,).
        reserve: [J], shape (R,).
        table: of each robot among the C, for robots alike; each has its own if None.
        finish_distance: from each target, and last from its start, to each robot's
            finish [m], shape (R, T + 1); inf for no way, 0 (or None) to end anywhere.
        time: from place to target with the dwell there [s], as `cost`; 0 if None.
        finish_time: from there to the finish [s], shape (R, T + 1); 0 if None.
        limit: longest time of each robot's route [s], shape (R,); none if None.
        consumers: what each robot draws at all times [W], shape (R,); nothing if None.
        charge_power: of stations for each battery [W], shape (R,); at once if None.
        energy_weight: of the summed energy in the objective, without consumers.
        makespan_weight: of the longest time of a route in the objective [J/s], in it
            what all consumers draw.
    """

    goals: int
    distance: np.ndarray
    start_distance: np.ndarray
    plain: np.ndarray
    energy: np.ndarray
    capacity: np.ndarray
    reserve: np.ndarray
    table: np.ndarray | None = None
    finish_distance: np.ndarray | None = None
    time: np.ndarray | None = None
    finish_time: np.ndarray | None = None
    limit: np.ndarray | None = None
    consumers: np.ndarray | None = None
    charge_power: np.ndarray | None = None
    energy_weight: float = 1.0
    makespan_weight: float = 0.0

    @property
    def arrays(self) -> RoutingArrays:
        """The problem as kernels take it."""
        robots, targets = self.start_distance.shape
        table = np.arange(robots) if self.table is None else self.table
        consumers = _filled(self.consumers, 0.0, (robots,))
        cost = self._costs(table)
        time = _filled(self.time, 0.0, cost.shape)
        owner = np.unique(table, return_index=True)[1]
        cost += _drawn_J(consumers[owner, None, None], time)
        finish = _filled(self.finish_distance, 0.0, (robots, targets + 1))
        finish_time = _filled(self.finish_time, 0.0, finish.shape)
        finish = finish * self.plain[:, None]
        finish += _drawn_J(consumers[:, None], finish_time)
        return RoutingArrays(
            goals=self.goals,
            cost=cost,
            energy=_filled(self.energy, 0.0, (robots,)),
            capacity=_filled(self.capacity, 0.0, (robots,)),
            reserve=_filled(self.reserve, 0.0, (robots,)),
            escape=_escape(cost[:, :targets, self.goals :], table, finish),
            open_goal=np.ones(self.goals, bool),
            finish=finish,
            time=time,
            finish_time=finish_time,
            limit=_filled(self.limit, np.inf, (robots,)),
            charge_power=_filled(self.charge_power, np.inf, (robots,)),
            consumers=consumers,
            energy_weight=float(self.energy_weight),
            makespan_weight=float(self.makespan_weight),
            table=table,
            home=homes(table, targets),
        )

    def _costs(self, table: np.ndarray) -> np.ndarray:
        """Return energies of all legs, homes behind targets, shape (C, T + H, T)."""
        targets = self.start_distance.shape[1]
        home, owner = homes(table, targets), np.unique(table, return_index=True)[1]
        cost = np.full((len(self.distance), int(home.max()) + 1, targets), np.inf)
        cost[:, :targets] = self.distance * self.plain[owner, None, None]
        cost[table, home] = self.start_distance * self.plain[:, None]
        return cost


def homes(table: np.ndarray, targets: int) -> np.ndarray:
    """Return the place of each robot's start in its table, behind all targets."""
    before = np.tril(table[:, None] == table, -1)
    return np.asarray(targets + before.sum(axis=1))


def _escape(
    to_station: np.ndarray, table: np.ndarray, finish: np.ndarray
) -> np.ndarray:
    """Return the energy from each target to the nearest place of safety, (R, T)."""
    if not to_station.shape[2]:
        return np.ascontiguousarray(finish[:, :-1])
    nearest = np.asarray(to_station.min(axis=2))[table]
    closed = finish.any(axis=1, keepdims=True)
    return np.asarray(np.where(closed, np.minimum(nearest, finish[:, :-1]), nearest))


def _drawn_J(power_W: np.ndarray, time: np.ndarray) -> np.ndarray:
    """Return what consumers draw on legs [J]; where there is no way, nothing."""
    return np.asarray(power_W * np.where(np.isfinite(time), time, 0.0))


def _filled(
    values: np.ndarray | None, otherwise: float, shape: tuple[int, ...]
) -> np.ndarray:
    if values is None:
        return np.full(shape, otherwise)
    # Contiguous, or kernels would be compiled anew for columns of a record array.
    return np.ascontiguousarray(values, dtype=float)
