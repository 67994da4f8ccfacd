"""A mission in which every leg costs at most what it must, which bounds are proven of.

Legs cost the rolling resistance on the shortest ways (`geodesic`), from the last target
of a robot to its finish, too. On slopes the battery also pays for climbing and is paid
for rolling down, at most what that is worth without losses (`slopes.climb_J`). Along a
way this adds up to the difference of heights between its ends. So a tour costs as much
as on flat ground and the climb from its start to the lowest ground on which it can end,
with batteries that hold as much more as heights are worth.

Charges are taken at the middle of each planning step. In a step in which the robot
turns round, the way back is not charged; that is worth less than 0.01 mm.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry import Point

from mrmg.energy.metering import SHORTEST_ON_SLOPES_S
from mrmg.planning.bound.arcs import ArcWays
from mrmg.planning.bound.borders import half_arc_m
from mrmg.planning.bound.clearance import avoided_ground, passing_radius_m
from mrmg.planning.bound.geodesic import Ground, Ways
from mrmg.planning.bound.visibility import VisibilityGraph
from mrmg.planning.consumers import with_consumers_as_ground
from mrmg.planning.halting import NEVER, check
from mrmg.planning.path_bounds import outer_polygon
from mrmg.planning.roadmap.slopes import climb_J, height_span_m
from mrmg.planning.routing._nrpa_kernels import RoutingArrays
from mrmg.planning.routing.instance import RoutingInstance
from mrmg.scene.region import Region
from mrmg.scene.types import Robot, Scene

CELLS = 30_000
"""Cells of the grid on which ways are bounded."""

FINER = 5
"""Parts into which cells are cut for visibility graphs."""

TravelKey = tuple[tuple[str, ...], float, float, float]
"""What the ways of a robot depend on: obstacles, radii, top speed."""


@dataclass(frozen=True)
class Relaxation:
    """A mission in which every leg costs at most what it must.

    Attributes:
        scene, step_s: the mission and the time step of its plans.
        problem: with the least ways from region to region.
        keys: what the ways of each robot depend on.
        ways: by key.
        price: energy of a metre of plain ground of each robot [J/m], shape (R,).
    """

    scene: Scene
    step_s: float
    problem: RoutingArrays
    keys: list[TravelKey]
    ways: dict[TravelKey, Ways]
    price: np.ndarray

    @staticmethod
    def of(
        scene: Scene,
        *,
        step_s: float = 0.1,
        cells: int = CELLS,
        shared: bool = False,
        halt: np.ndarray = NEVER,
    ) -> Relaxation:
        """Relax a mission.

        Between recharges a robot may bring kinetic energy along and use its height,
        which is added to its capacity and to its energy at the start.

        Args:
            scene: the mission.
            step_s: time step of its plans.
            cells: cells of the grid on which ways are bounded.
            shared: whether robots alike share their legs.
            halt: shape (1,); it is given up once it has turned true.

        Raises:
            Halted: once `halt[0]` has turned true.
        """
        scene = with_consumers_as_ground(scene)
        regions = [target.region for target in scene.targets()]
        targets = len(regions)
        ends = {r: one.finish for r, one in enumerate(scene.robots) if one.finish}
        regions += [finish.region for finish in ends.values()]
        keys = [_travel_key(scene, robot) for robot in scene.robots]
        ways = _ways_by_key(scene, keys, step_s, cells, regions, halt)
        batteries = [robot.battery for robot in scene.robots]
        price = [r.model.energy_model.plain_ground_J_per_m() for r in scene.robots]
        full_J = [_relaxed_full_J(scene, one) for one in scene.robots]
        reserve_J = [battery.reserve_J - 1e-3 for battery in batteries]
        alike = [0 if shared else r for r in range(len(keys))]
        kinds = list(zip(keys, price, full_J, reserve_J, alike, strict=True))
        distinct = list(dict.fromkeys(kinds))
        first = np.stack([ways[key].from_start[r] for r, key in enumerate(keys)])
        last = np.zeros((len(keys), targets + 1))
        for place, r in enumerate(ends, start=targets):
            last[r] = [*ways[keys[r]].between[:targets, place], first[r, place]]
        problem = RoutingInstance(
            goals=len(scene.goals),
            distance=np.stack(
                [ways[k].between[:targets, :targets] for k, *_ in distinct]
            ),
            start_distance=first[:, :targets],
            finish_distance=last,
            plain=np.array(price),
            table=np.array([distinct.index(kind) for kind in kinds]),
            energy=np.array([_relaxed_start_J(scene, one) for one in scene.robots]),
            capacity=np.array(full_J),
            reserve=np.array(reserve_J),
        ).arrays
        return Relaxation(scene, step_s, problem, keys, ways, np.array(price))

    def with_end_climbs(self) -> RoutingArrays:
        """Return the problem in which tours cost the climb to where they end, too.

        Without regeneration the battery never gains, so a mission without a finish
        counts as ended at a robot's last goal; with it, the robot may roll down to the
        lowest place there is.
        """
        scene, finish = self.scene, self.problem.finish.copy()
        if scene.elevation is None:
            return self.problem
        anywhere = shapely.box(*scene.bounds)
        places = [outer_polygon(target.region) for target in scene.targets()]
        for r, robot in enumerate(scene.robots):
            start = Point(*robot.pose[:2])
            ends = [*places, start]
            if robot.finish:
                ends = [outer_polygon(robot.finish.region)]
            elif robot.model.regeneration_efficiency > 0.0:
                ends = [anywhere]
            low_m = np.array([height_span_m(scene, robot, end)[0] for end in ends])
            start_m = height_span_m(scene, robot, start)[1]
            finish[r] += climb_J(robot, 1.0) * (low_m - start_m)
            if len(low_m) > 1:
                finish[r, -1] = 0.0  # it has not moved
        return self.problem._replace(finish=finish)

    def arc_ways(self, finer: int = FINER) -> list[ArcWays]:
        """Return the ways of each robot between arcs; robots share what is equal.

        Cells are cut into `finer` parts along each side.
        """
        found, targets = {}, len(self.scene.targets())
        for key, robot in zip(self.keys, self.scene.robots, strict=True):
            if key not in found:
                ways = self.ways[key].among(targets)
                graph = VisibilityGraph.of(
                    self.scene,
                    ways.ground.blocked,
                    cell_m=ways.ground.cell_m / finer,
                    step_m=_charged_at_once_m(self.scene, robot, self.step_s),
                    reach_m=max(map(half_arc_m, ways.regions)),
                )
                goals = len(self.scene.goals)
                found[key] = ArcWays.of(ways, graph, _starts(self.scene), goals)
        return [found[key] for key in self.keys]


def _charged_at_once_m(scene: Scene, robot: Robot, step_s: float) -> float:
    """Return the longest way that one price is charged for [m]."""
    if scene.elevation is not None and step_s < SHORTEST_ON_SLOPES_S:
        step_s += SHORTEST_ON_SLOPES_S  # by whole steps of at least that
    return robot.model.top_speed_m_s * step_s


def _ways_by_key(
    scene: Scene,
    keys: Sequence[TravelKey],
    step_s: float,
    cells: int,
    regions: Sequence[Region],
    halt: np.ndarray,
) -> dict[TravelKey, Ways]:
    """Return the ways between regions of every kind of robot."""
    x_min, y_min, x_max, y_max = scene.bounds
    cell_m = math.sqrt((x_max - x_min) * (y_max - y_min) / cells)
    ways: dict[TravelKey, Ways] = {}
    for key, robot in zip(keys, scene.robots, strict=True):
        if key not in ways:
            check(halt)
            own = _starts(scene)[[other == key for other in keys]]
            ends = [*map(outer_polygon, regions), shapely.multipoints(own)]
            step_m = _charged_at_once_m(scene, robot, step_s)
            blocked = avoided_ground(scene, robot, shapely.union_all(ends), step_m)
            ground = Ground.of(scene, blocked, cell_m=cell_m, step_m=step_m)
            ways[key] = Ways.of(ground, regions, _starts(scene), halt)
    return ways


def _starts(scene: Scene) -> np.ndarray:
    return np.array([robot.pose[:2] for robot in scene.robots])


def _relaxed_start_J(scene: Scene, robot: Robot) -> float:
    """Return the energy at the start, with what rolling down from there is worth."""
    _, start_m = height_span_m(scene, robot, Point(*robot.pose[:2]))
    low_m, _ = height_span_m(scene, robot, shapely.box(*scene.bounds))
    return robot.battery.start_J + climb_J(robot, start_m - low_m)


def _relaxed_full_J(scene: Scene, robot: Robot) -> float:
    """Return a full battery's energy, with what top speed on the top is worth."""
    low_m, high_m = height_span_m(scene, robot, shapely.box(*scene.bounds))
    moving_J = robot.model.top_kinetic_J + climb_J(robot, high_m - low_m)
    return robot.battery.capacity_J + moving_J


def _travel_key(scene: Scene, robot: Robot) -> TravelKey:
    """Return what the ways of a robot depend on."""
    obstacles = tuple(o.id for o in scene.barriers if o.stops(robot.id))
    model = robot.model
    radii = model.inscribed_radius_m, passing_radius_m(model)
    return obstacles, *radii, model.top_speed_m_s
