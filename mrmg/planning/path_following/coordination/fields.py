"""Costs-to-go of robots over grids, made when they are asked for."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mrmg.motion._kernels import CAR
from mrmg.planning.path_following.coordination import _field_kernels
from mrmg.planning.path_following.coordination._guide_kernels import BEARINGS, Guide
from mrmg.planning.path_following.coordination._motion_kernels import Traffic
from mrmg.planning.problem.problem import Problem
from mrmg.world import _raster_kernels
from mrmg.world.world import CELL_M

TIGHT_PRICE = 2.0
"""Factor on the cost of a metre where a robot cannot turn round."""

MOST_CELLS = 60_000
"""Cells of a field, about."""

FINE_SHARE = 1.0 / 15.0
"""Spacing of the points of a cell at which it is looked at whether a robot has room, as
a share of the clearance that it needs. Looked at more coarsely, gaps count as wide
enough that are not, and a search that is led into one looks at all there is before
it."""

MOST_POINTS = 60_000
"""Such points of all cells, at most: cells of wide maps have one."""

MOST_TIMED_CELLS = 3_000_000
"""Cells of fields that know where the other robots are when, over all layers and legs,
at most: it bounds their time and memory."""

MOST_POSES = 200_000
"""Poses of fields that know how long turning takes, over all legs, at most."""

FEW_TIMED_CELLS, COARSEST_SHARE = 300_000, 0.3
"""Cells of such fields beyond which each four cells are joined, where they are finer
than usual, and the longest side of what becomes of them, in radii of the robot."""

UNKNOWN = np.zeros((0, 1, 1, 1))
"""What turning costs where that is not known."""

NO_GUIDE = Guide(np.zeros((1, 1, 1, 1)), UNKNOWN, 0.0, 0.0, 1e9, 1 << 30)
"""Costs-to-go of those who do without."""


class Fields:
    """Costs-to-go over grids of one problem."""

    def __init__(self, problem: Problem, coarser: int = 1) -> None:
        """Keep the problem; no field is made yet.

        Args:
            problem: the mission.
            coarser: how many times as long the sides of cells are as usual.
        """
        self._problem = problem
        self._coarse: Fields | None = None
        self._known: dict[tuple[int, tuple[int, ...]], np.ndarray] = {}
        self._turning: dict[tuple[int, ...], np.ndarray] = {}
        self._ground: dict[int, tuple[np.ndarray, np.ndarray]] = {}
        self._room: dict[tuple[int, float], np.ndarray] = {}
        self._beside: dict[tuple[int, float, float], np.ndarray] = {}
        spaces = problem.mission.spaces
        cells = spaces.distance[0].size
        self._coarser = coarser * max(1, round((cells / MOST_CELLS) ** 0.5))
        self._cell_m = float(spaces.cell * self._coarser)
        self._grid = float(spaces.x_min), float(spaces.y_min), self._cell_m
        self._shape = [-(-n // self._coarser) for n in spaces.distance[0].shape]

    def in_time(self, r: int, targets: Sequence[int], traffic: Traffic) -> Fields:
        """Return the finest fields of few cells in time, or the coarsest there are."""
        radius_m = float(self._problem.mission.fleet[r]["radius"])
        few = self._timed_cells(r, targets, traffic) <= FEW_TIMED_CELLS
        if few or 2.0 * self._cell_m > min(CELL_M, COARSEST_SHARE * radius_m):
            return self
        if self._coarse is None:
            self._coarse = Fields(self._problem, 2 * self._coarser)
        return self._coarse.in_time(r, targets, traffic)

    def static(self, r: int, targets: Sequence[int]) -> Guide:
        """Return robot r's costs-to-go among obstacles alone."""
        top = float(self._problem.mission.fleet["limit"][r, 1])
        field = np.zeros((self._legs(r, targets), 1, *self._shape))
        for i in range(len(targets)):
            field[i, 0] = self._way(r, tuple(targets[i:])) / top
        return Guide(field, UNKNOWN, *self._grid, 1 << 30)

    def _legs(self, r: int, targets: Sequence[int]) -> int:
        """Return the legs of a tour: without a finish, one more to where r stays."""
        return len(targets) + int(self._problem.mission.targets.finish[r] < 0)

    def _layers(self, r: int, traffic: Traffic) -> tuple[int, int]:
        """Return how many steps a layer of time lasts for robot r, and the layers."""
        step_m = float(self._problem.mission.fleet[r]["limit"][1]) * self._problem.dt_s
        layer = max(1, int(self._cell_m / step_m))
        return layer, -(-traffic.end // layer) + 1

    def are_timed(self, r: int, targets: Sequence[int], traffic: Traffic) -> bool:
        """Return whether there are few enough cells for costs-to-go in time."""
        return 0 < self._timed_cells(r, targets, traffic) <= MOST_TIMED_CELLS

    def _timed_cells(self, r: int, targets: Sequence[int], traffic: Traffic) -> int:
        layers = self._legs(r, targets) * self._layers(r, traffic)[1]
        return int(layers * self._shape[0] * self._shape[1])

    def timed(
        self,
        r: int,
        targets: Sequence[int],
        stay: np.ndarray,
        traffic: Traffic,
        costs: tuple[float, float],
        inflation: float,
    ) -> tuple[Guide, np.ndarray]:
        """Return robot r's costs-to-go among the others, and the way down them.

        The way is a chain of points, shape (n, 2); cars, which cannot follow it, have
        none of more than one.

        Args:
            r: robot.
            targets: of its tour; a finish comes last.
            stay: steps to stand in each of them but a finish, shape (L,) or (L - 1,).
            traffic: how the others move.
            costs: of a second of holding, and of a second in conflict with a robot of
                lower priority.
            inflation: of the others, beyond the distance to be kept from them, in
                sides of cells; below 0 it is led to wherever it may get through.
        """
        mission, dt_s, cell_m = self._problem.mission, self._problem.dt_s, self._cell_m
        own = mission.fleet[r : r + 1]
        top = float(own[0]["limit"][1])
        layer, layers = self._layers(r, traffic)
        price = self._price(r, targets) * cell_m / top
        hold_share, soft_share = costs
        penalty, layer_s = np.zeros((layers, *price.shape)), layer * dt_s
        inner_m = self._problem.scene.robots[r].model.inscribed_radius_m
        inner_m += inflation * cell_m
        _field_kernels.add_others(
            own, traffic, inner_m, self._grid, layer, soft_share * layer_s, penalty
        )
        regions = self._regions(r, targets)
        standing, stood = hold_share * layer_s, np.full(len(regions), -1)
        stood[: len(stay)] = -(-stay // layer)
        lasting = np.where(penalty[-1] < np.inf, price, np.inf)
        field = np.empty((len(regions), *penalty.shape))
        for i, region in reversed([*enumerate(regions)]):
            hold = np.full(price.shape, standing)
            field[i] = np.inf
            last = np.where(region, 0.0, np.inf)
            if stood[i] >= 0:
                ahead = np.minimum(np.arange(layers) + stood[i], layers - 1)
                field[i][:, region] = field[i + 1, ahead][:, region]
                last = field[i, -1]
            else:
                hold[region] = 0.0
            last = np.where(lasting < np.inf, last, np.inf)
            field[i, -1] = _field_kernels.cost_to_go(lasting, last)
            _field_kernels.timed_cost_to_go(price, penalty, hold, field[i])
        way = self._problem.start[r : r + 1, :2]
        if own[0]["model"] != CAR:
            way = self._way_down(r, regions, stood, (price, standing, field))
        return Guide(field, UNKNOWN, *self._grid, layer), way

    def _way_down(
        self,
        r: int,
        regions: np.ndarray,
        stood: np.ndarray,
        costs: tuple[np.ndarray, float, np.ndarray],
    ) -> np.ndarray:
        """Return robot r's cheapest way down its costs-to-go, shape (n, 2).

        Args:
            r: robot.
            regions: that its legs lead to.
            stood: layers to stand in each of them, -1 for good.
            costs: of a cell's side, of holding for a layer, and to go.
        """
        corner, here = np.array(self._grid[:2]), self._problem.start[r, :2]
        rows, columns = self._shape
        way = np.zeros((len(costs[2][0]) + 2 * len(regions) * (rows + columns), 2), int)
        cell = ((here - corner) // self._cell_m).astype(int)
        way[0] = np.clip(cell[::-1], 0, (rows - 1, columns - 1))
        size = _field_kernels.descend(costs[0], regions, stood, *costs[1:], way)
        points = corner + (way[:size, ::-1] + 0.5) * self._cell_m
        points[0] = here
        return np.asarray(points)

    def _way(self, r: int, targets: tuple[int, ...]) -> np.ndarray:
        """Return the way from each cell through targets [m], inf if there is none."""
        if (r, targets) not in self._known:
            later = self._way(r, targets[1:]) if targets[1:] else np.zeros(self._shape)
            seed = np.where(self._region(targets[:1]), later, np.inf)
            price = self._cell_m * self._price(r, targets)
            self._known[r, targets] = _field_kernels.cost_to_go(price, seed)
        return self._known[r, targets]

    def turning(self, r: int, targets: Sequence[int]) -> np.ndarray:
        """Return what turning costs robot r beside its costs-to-go [s] (`Guide`).

        It is `UNKNOWN` for cars, whose searches take longer with it among boxes than
        without, and for too many poses.
        """
        if (r, *targets) not in self._turning:
            car = self._problem.mission.fleet[r]["model"] == CAR
            poses = len(targets) * BEARINGS * self._shape[0] * self._shape[1]
            known = not car and 0 < poses <= MOST_POSES
            found = self._turns(r, targets) if known else UNKNOWN
            self._turning[r, *targets] = found
        return self._turning[r, *targets]

    def _turns(self, r: int, targets: Sequence[int]) -> np.ndarray:
        mission = self._problem.mission
        robot, price = mission.fleet[r], self._price(r, targets)
        back, top, rate = np.maximum(np.abs(robot["limit"][:3]), 1e-6)
        heading = 2.0 * np.pi / BEARINGS * np.arange(BEARINGS)
        turn_s = heading[1] / rate * np.where(price < np.inf, price, 1.0)
        turning = np.zeros((len(targets), BEARINGS, *self._shape))
        cost = turning[0]
        for i in range(len(targets) - 1, -1, -1):
            aim = mission.targets.target[targets[i]]
            off = np.abs((heading - aim["heading"] + np.pi) % (2.0 * np.pi) - np.pi)
            after = slice(None)
            if aim["tolerance"] < np.pi:
                after = slice(int(off.argmin()), int(off.argmin()) + 1)
            region = self._region(targets[i : i + 1])
            off_s = np.maximum(0.0, off - aim["tolerance"]) / rate
            later = cost[after, region] + off_s[:, None]
            cost = np.full(turning.shape[1:], np.inf)
            cost[:, region] = later
            side_s = self._cell_m / top * price
            _field_kernels.turning_cost_to_go(side_s, turn_s, top / back, cost)
            way_s = self._way(r, tuple(targets[i:])) / top
            known = np.isfinite(way_s) & np.isfinite(cost)
            np.subtract(cost, way_s, out=turning[i], where=known)
        return turning

    def _price(self, r: int, targets: Sequence[int]) -> np.ndarray:
        """Return what a metre costs robot r in each cell, inf where it has no room.

        In its targets it has.
        """
        if r not in self._ground:
            self._ground[r] = self._priced(r)
        free, price = self._ground[r]
        passable = free | self._region(targets) | self._beside_walls(r, targets)
        return np.where(passable, price, np.inf)

    def _priced(self, r: int) -> tuple[np.ndarray, np.ndarray]:
        """Return where robot r has room without targets, and the price of a metre."""
        robot, n = self._problem.mission.fleet[r], self._coarser
        spaces = self._problem.mission.spaces
        distance = spaces.distance[robot["space"]]
        rows, columns = self._shape
        padded = np.full((rows * n, columns * n), -np.inf)
        padded[: distance.shape[0], : distance.shape[1]] = distance
        nearest = padded.reshape(rows, n, columns, n).max(axis=(1, 3))
        needed_m = float(robot["passage"])
        roomy_m = float(robot["radius"] + robot["margin"])
        lacking = (roomy_m - nearest) / max(roomy_m - needed_m, self._cell_m)
        fine_m = float(spaces.cell) if self._problem.openings else self._cell_m
        free = (nearest > needed_m - 0.5 * fine_m) & self._has_room(r)
        return free, 1.0 + TIGHT_PRICE * np.clip(lacking, 0.0, 1.0)

    def _beside_walls(self, r: int, targets: Sequence[int]) -> np.ndarray:
        """Return which cells near robot r's start and targets it may stand in.

        With its back to a wall its reference point is nearer to that than ways lead.
        """
        mission = self._problem.mission
        centers = mission.targets.target["center"][list(targets)]
        beside = np.zeros(self._shape, bool)
        for x, y in [self._problem.start[r, :2].tolist(), *centers.tolist()]:
            if (r, x, y) not in self._beside:
                fits = self._beside[r, x, y] = np.zeros(self._shape, bool)
                _field_kernels.add_fitting(
                    mission.fleet[r : r + 1], mission.spaces, (x, y), self._grid, fits
                )
            beside |= self._beside[r, x, y]
        return beside

    def _has_room(self, r: int) -> np.ndarray:
        """Return which cells have a point with the clearance that robot r needs.

        All have on maps that are wide, have no obstacles or have openings, whose cells
        are fine already; within obstacles it is not known.
        """
        robot, spaces = self._problem.mission.fleet[r], self._problem.mission.spaces
        space, needed_m = int(robot["space"]), float(robot["passage"])
        rows, columns = self._shape
        parts = min(
            int(self._cell_m / (FINE_SHARE * needed_m)),
            int((MOST_POINTS / (rows * columns)) ** 0.5),
        )
        if parts < 2 or self._problem.openings or not self._problem.scene.barriers:
            return np.ones(self._shape, bool)
        if (space, needed_m) not in self._room:
            near = slice(spaces.bucket_start[space, 0], spaces.bucket_start[space, -1])
            fine_m = self._cell_m / parts
            away_m = _raster_kernels.edge_distance_field(
                spaces.edge[np.unique(spaces.bucket_edge[near])],
                spaces.x_min, spaces.y_min, fine_m, rows * parts, columns * parts,
            )  # fmt: skip
            most_m = away_m.reshape(rows, parts, columns, parts).max(axis=(1, 3))
            self._room[space, needed_m] = most_m > needed_m - 0.5 * fine_m
        return self._room[space, needed_m]

    def _regions(self, r: int, targets: Sequence[int]) -> np.ndarray:
        """Return which cells each leg of robot r's tour ends in, shape (L, ny, nx)."""
        regions = np.ones((self._legs(r, targets), *self._shape), bool)
        for region, target in zip(regions, targets, strict=False):
            region[:] = self._region([target])
        return regions

    def _region(self, targets: Sequence[int]) -> np.ndarray:
        """Return which cells lie in one of some targets, shape (ny, nx)."""
        places, region = self._problem.mission.targets, np.zeros(self._shape, bool)
        for t in targets:
            _field_kernels.add_region(places, t, *self._grid, region)
        return region
