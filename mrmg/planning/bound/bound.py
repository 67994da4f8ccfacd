"""A proven lower bound of a fleet's energy.

Whoever solves a mission visits the goals and recharges at stations in some order. The
energy of that is at least the rolling resistance on the shortest ways (`geodesic`), as
a robot that starts and ends at rest gets no inertia for nothing, and turning, idling
and other robots only cost more. The least over all orders is the bound.

Orders are distinguished by where each region is touched first (`touring`), as the way
through a region is no more for nothing than any other. Legs of the cheapest orders are
those of visibility graphs (`visibility`), all others those of fields. Where goals are
many, not all visits are remembered (`counted_visits`); where there are more still,
trees with prices span them (`relaxed_routing_J`).

On slopes the battery also pays for climbing and is paid for rolling down, at most what
that is worth without losses (`slopes.climb_J`). Along a way this adds up to the
difference of heights between its ends, so the bound of flat ground less the descent
from each start to the lowest ground on which a mission can end is a bound, with
batteries that hold as much more.

Charges are taken at the middle of each planning step. In a step in which the robot
turns round, the way back is not charged; that is worth less than 0.01 mm.

With more obstacles no cell that none can enter is cheaper, and no tours are cheaper
where no leg is. Yet an obstacle or a goal more may lower the bound; the greater of both
holds. What a field certifies of a leg may be less, by less than half a percent in all
that was tried: fields are solved and then divided by how much too steep they are, which
depends on where fronts meet. And where obstacles are joined to terrain by another one,
or a goal is next to them, less is known of how far ways keep from them (`clearance`),
which is worth 0.1 to 3 %.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely
from shapely.geometry import Point

from mrmg.energy.metering import SHORTEST_ON_SLOPES_S
from mrmg.planning.bound import _bound_kernels
from mrmg.planning.bound.arcs import ArcWays
from mrmg.planning.bound.borders import half_arc_m
from mrmg.planning.bound.clearance import avoided_ground, passing_radius_m
from mrmg.planning.bound.completions import over_stations
from mrmg.planning.bound.counted_visits import counted_visits
from mrmg.planning.bound.exact_tours import are_few, exact_routing
from mrmg.planning.bound.geodesic import Ground, Ways
from mrmg.planning.bound.touring import touring_bound_J
from mrmg.planning.bound.visibility import VisibilityGraph
from mrmg.planning.consumers import with_consumers_as_ground
from mrmg.planning.halting import NEVER, check
from mrmg.planning.path_bounds import outer_polygon
from mrmg.planning.roadmap.slopes import climb_J, height_span_m
from mrmg.planning.routing._nrpa_kernels import RoutingArrays
from mrmg.planning.routing.instance import RoutingInstance
from mrmg.planning.routing.routing import RouterParams, solve_routing
from mrmg.scene.region import Region
from mrmg.scene.types import Robot, Scene

CELLS = 30_000
"""Cells of the grid on which ways are bounded."""

SPANNING_ROUNDS = 400
"""Changes of the prices in the bound of missions with more goals."""

FINER = 5
"""Parts into which cells are cut for visibility graphs."""

ROUNDS = 20
"""Times that the ways of the cheapest tours are tightened at most."""

MOST_TARGETS = 64
"""Goals and stations up to which tours are told apart by arcs, by the memory for legs
from arc to arc (134 MB) ..."""

MOST_LEGS = 20_000
"""... and legs of all robots between them, by the time that their arcs take."""

TravelKey = tuple[tuple[str, ...], float, float, float]
"""What the ways of a robot depend on: obstacles, radii, top speed."""

ROUNDING_SHARE = 1e-9
"""What rounding may add to a bound; taken off."""


def lower_bound_J(
    scene: Scene,
    *,
    step_s: float = 0.1,
    cells: int = CELLS,
    rounds: int = ROUNDS,
    finer: int = FINER,
    halt: np.ndarray = NEVER,
) -> float:
    """Return an energy [J] that no plan of a mission undercuts.

    None is known of robots with a custom motion model: a step is charged by the speeds
    at its ends, and such a model need not drive that way in it.

    Args:
        scene: the mission.
        step_s: time step of the plans.
        cells: cells of the grid on which ways are bounded; more bring the bound nearer
            to the truth.
        rounds: how often the ways of the cheapest tours are tightened; as `cells`.
        finer: parts into which cells are cut for that; as `cells`.
        halt: shape (1,); once it has turned true, what is proven is returned.

    Returns:
        The bound, at least 0; inf if the mission is proven to have no solution.

    Raises:
        Halted: if nothing is proven by then.
    """
    if not scene.goals or scene.has_custom_motion:
        return 0.0
    few = are_few(len(scene.goals), len(scene.robots))
    targets = len(scene.targets())
    legs = len(scene.robots) * targets**2
    by_arcs = few or (targets <= MOST_TARGETS and legs <= MOST_LEGS)
    relaxed = Relaxation.of(
        scene, step_s=step_s, cells=cells, shared=not by_arcs, halt=halt
    )
    problem = relaxed.problem
    routing = exact_routing(problem) if few else None
    bound = routing.cost_J if routing else relaxed_routing_J(problem)
    if by_arcs and rounds and not halt[0]:
        routing = routing or solve_routing(problem, RouterParams(), 0)
        if routing.feasible:
            bound = touring_bound_J(
                problem,
                replace(routing, cost_J=bound),
                relaxed.arc_ways(finer),
                relaxed.price,
                visits=None if few else counted_visits(problem),
                rounds=rounds,
                halt=halt,
            )
    bound -= sum(most_descent_J(scene, robot) for robot in scene.robots)
    return max(0.0, bound) * (1.0 - ROUNDING_SHARE)


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
        with_finishes: bool = False,
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
            with_finishes: whether tours lead on to where robots must end.
            shared: whether robots alike share their legs.
            halt: shape (1,); it is given up once it has turned true.

        Raises:
            Halted: once `halt[0]` has turned true.
        """
        scene = with_consumers_as_ground(scene)
        regions = [target.region for target in scene.targets()]
        targets = len(regions)
        ends = {r: one.finish for r, one in enumerate(scene.robots) if one.finish}
        regions += [finish.region for finish in ends.values() if with_finishes]
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
        for place, r in enumerate(ends if with_finishes else (), start=targets):
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

    def arc_ways(self, finer: int = FINER) -> list[ArcWays]:
        """Return the ways of each robot between arcs; robots share what is equal.

        Cells are cut into `finer` parts along each side.
        """
        found = {}
        for key, robot in zip(self.keys, self.scene.robots, strict=True):
            if key not in found:
                ways = self.ways[key]
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


def most_descent_J(scene: Scene, robot: Robot) -> float:
    """Return the battery energy that a start above the mission's end is worth.

    Without regeneration the battery never gains, so the mission counts as ended at a
    robot's last goal; with it, the robot may roll down to the lowest place there is.
    """
    _, start_m = height_span_m(scene, robot, Point(*robot.pose[:2]))
    ends = [shapely.box(*scene.bounds)]
    if robot.model.regeneration_efficiency == 0.0:
        ends = [outer_polygon(goal.region) for goal in scene.goals]
    lowest_m = min(height_span_m(scene, robot, end)[0] for end in ends)
    return climb_J(robot, max(0.0, start_m - lowest_m))


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


def relaxed_routing_J(problem: RoutingArrays) -> float:
    """Return a lower bound of the cost of all tours of a mission of any size.

    Robots are exchangeable but for their starts, and batteries only limit single legs;
    the bound is that of spanning trees with prices (`_bound_kernels.spanning_bound`).
    """
    goals, start = problem.goals, problem.cost.shape[2]
    goal_list = np.flatnonzero(problem.open_goal)
    if not len(goal_list):
        return 0.0
    usable = np.array([problem.capacity, problem.energy]) - problem.reserve
    owner = np.unique(problem.table, return_index=True)[1]
    most = np.broadcast_to(usable[0, owner, None, None], problem.cost.shape).copy()
    most[problem.table, problem.home] = usable[1, :, None]
    legs = np.where(problem.cost <= most, problem.cost, np.inf)
    legs = over_stations(legs, range(goals, start))[..., goal_list]
    between = np.min(legs[:, goal_list], axis=0)
    symmetric = np.ascontiguousarray(np.minimum(between, between.T))
    first = np.ascontiguousarray(legs[problem.table, problem.home])
    return float(_bound_kernels.spanning_bound(symmetric, first, SPANNING_ROUNDS))
