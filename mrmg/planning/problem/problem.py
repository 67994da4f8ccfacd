"""The planning problem: a scene with the arrays that every planner works on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from mrmg import seeding
from mrmg.energy.model import CONSUMERS_W
from mrmg.motion._kernels import CAR, write_states
from mrmg.planning.halting import NEVER
from mrmg.planning.parameters import PlannerParams
from mrmg.planning.preference import Preference
from mrmg.planning.problem._region_kernels import Zones
from mrmg.planning.problem._target_kernels import Targets
from mrmg.planning.problem.leg_times import routing_times
from mrmg.planning.problem.openings import (
    LEAST_CELL_M,
    cell_m,
    cramped_starts,
    guide_m,
    openings_at_starts,
    openings_to,
    tightest_openings,
)
from mrmg.planning.problem.targets import finish_of, gate_arrays, target_arrays
from mrmg.planning.problem.time_weighting import priced_world, with_energies
from mrmg.planning.roadmap._fleet_kernels import Spaces
from mrmg.planning.roadmap.fleet import fleet_array, stack_spaces
from mrmg.planning.roadmap.roadmap import Roadmap, build_roadmap
from mrmg.planning.routing._nrpa_kernels import RoutingArrays
from mrmg.planning.routing.instance import RoutingInstance
from mrmg.plans import Trajectory
from mrmg.scene.types import Scene
from mrmg.world._kernels import TerrainGrid
from mrmg.world.world import Opening, World


class Mission(NamedTuple):
    """A planning problem as arrays.

    Attributes:
        fleet, spaces, terrain, targets: robots, world and where to go.
        zones: stations that one robot at a time may be at.
        routing: the routing problem at the start; costs include the route margin.
    """

    fleet: np.ndarray
    spaces: Spaces
    terrain: TerrainGrid
    targets: Targets
    zones: Zones
    routing: RoutingArrays


@dataclass(frozen=True, slots=True)
class Problem:
    """A scene and its arrays.

    Attributes:
        scene: the scene.
        roadmap: its roadmap.
        mission: the arrays that kernels work on.
        start: composite state at the start, shape (R, 5).
        preference: what plans are compared by.
        start_energy: battery contents at the start [J], shape (R,).
        dt_s: time step of plans [s].
        route_margin: surcharge on the roadmap's energies in `mission.routing`.
        openings: places where robots keep less than their margins.
        minimum_time: whether plans must take less time at any cost.
        soc_margin: share of every battery's capacity that plans leave above the
            reserve.
    """

    scene: Scene
    roadmap: Roadmap
    mission: Mission
    start: np.ndarray
    preference: Preference
    start_energy: np.ndarray
    dt_s: float
    route_margin: float
    openings: tuple[Opening, ...] = ()
    minimum_time: bool = False
    soc_margin: float = 0.0

    def aims(self, robot: int, tour: Sequence[int]) -> np.ndarray:
        """Return the headings that a path must have at the targets of a tour [rad].

        NaN where they are free: robots that turn on the spot do so at the end.

        Args:
            robot: its number.
            tour: numbers of its targets, shape (S,).
        """
        target = self.mission.targets.target[list(tour)]
        free = target["tolerance"] >= np.pi
        if self.mission.fleet["model"][robot] != CAR:
            free |= np.array(tour) == self.mission.targets.finish[robot]
        return np.where(free, np.nan, target["heading"])

    def trajectory(self, robot: int, control: np.ndarray) -> Trajectory:
        """Return the motion of a robot from its start under controls.

        Args:
            robot: its number.
            control: u1, u2 held over each step of `dt_s`, shape (n, 2).
        """
        state = np.zeros((len(control) + 1, 5))
        state[0] = self.start[robot]
        control = np.array(control, order="C")
        write_states(self.mission.fleet[robot], self.dt_s, control, state)
        name = self.scene.robots[robot].id
        return Trajectory(robot=name, dt_s=self.dt_s, state=state, control=control)

    def path(self, robot: int, tour: Sequence[int]) -> np.ndarray:
        """Return the points of the roadmap along a robot's tour [m], shape (n, 2).

        Args:
            robot: its number.
            tour: numbers of its targets, goals before stations.
        """
        vertices, _ = self.tour_vertices(robot, tour)
        return np.asarray(self.roadmap.arrays.vertex[vertices])

    def tour_vertices(
        self, robot: int, tour: Sequence[int]
    ) -> tuple[list[int], list[int]]:
        """Return the roadmap's vertices along a tour, and where each leg ends."""
        roadmap = self.roadmap
        field = self.mission.fleet[robot]["field"]
        vertices, ends = [len(roadmap.targets) + robot], []
        for target in tour:
            successor = roadmap.arrays.successor[field, target]
            while successor[vertices[-1]] >= 0:
                vertices.append(int(successor[vertices[-1]]))
            ends.append(len(vertices) - 1)
        return vertices, ends

    def visits(self, tours: Sequence[Sequence[int]]) -> dict[str, tuple[str, ...]]:
        """Return ids of targets by ids of robots, as plans have them.

        Args:
            tours: numbers of each robot's targets, in order.
        """
        names = [target.id for target in self.scene.targets()]
        return {
            robot.id: tuple(names[t] for t in tour)
            for robot, tour in zip(self.scene.robots, tours, strict=True)
        }

    def with_routing(self, **arrays: Any) -> Problem:
        """Return the problem with other arrays of its routing problem."""
        routing = self.mission.routing._replace(**arrays)
        return replace(self, mission=self.mission._replace(routing=routing))

    def with_margin(self, margin: float) -> Problem:
        """Return the problem with another surcharge on the roadmap's energies."""
        routing = self.mission.routing
        share = (1.0 + margin) / (1.0 + self.route_margin)
        names = ("cost", "escape", "finish", "time", "finish_time")
        grown = {name: share * getattr(routing, name) for name in names}
        return replace(self.with_routing(**grown), route_margin=margin)

    def with_soc_margin(self, share: float) -> Problem:
        """Return the problem whose plans leave more in batteries than the reserve.

        Args:
            share: of their capacities, for all of them.
        """
        fleet = self.mission.fleet.copy()
        fleet["reserve"] += (share - self.soc_margin) * fleet["capacity"]
        routing = self.mission.routing._replace(reserve=fleet["reserve"].copy())
        mission = self.mission._replace(fleet=fleet, routing=routing)
        return replace(self, mission=mission, soc_margin=share)

    def with_limit(self, share: float) -> Problem:
        """Return the problem with routes that take a share of the time limit."""
        return self.with_routing(limit=share * self.mission.routing.limit)


def state_problem(
    scene: Scene, world: World, roadmap: Roadmap, params: PlannerParams
) -> Problem:
    """Return the scene's problem; routing costs include the route margin."""
    fleet = fleet_array(scene, world, params.margins)
    places = len(scene.targets())
    targets = target_arrays(scene)
    dwell_s = targets.target["dwell"]
    energy = np.array([robot.battery.start_J for robot in scene.robots])
    table = tables_of(fleet)
    owner = np.unique(table, return_index=True)[1]

    start = np.zeros((len(scene.robots), 5))
    start[:, :3] = [robot.pose for robot in scene.robots]
    mission = Mission(
        fleet=fleet,
        spaces=stack_spaces(world),
        terrain=world.terrain,
        targets=targets,
        zones=gate_arrays(scene),
        routing=RoutingInstance(
            goals=len(scene.goals),
            distance=roadmap.distance[fleet["field"][owner], :places, :places],
            start_distance=roadmap.start_distance[:, :places],
            plain=fleet["plain"] * (1.0 + params.route_margin),
            table=table,
            energy=energy,
            capacity=fleet["capacity"],
            reserve=fleet["reserve"],
            finish_distance=_last_legs(scene, roadmap, fleet),
            consumers=fleet["energy"][:, CONSUMERS_W],
            **routing_times(scene, roadmap, fleet, table, dwell_s, params.route_margin),
        ).arrays,
    )
    return Problem(
        scene=scene,
        roadmap=roadmap,
        mission=mission,
        start=start,
        preference=Preference.of(scene),
        start_energy=energy,
        dt_s=params.dt_s,
        route_margin=params.route_margin,
    )


def tables_of(fleet: np.ndarray) -> np.ndarray:
    """Return a number for each robot; equal ones have the same legs and batteries."""
    deciding = ("field", "plain", "energy", "limit", "capacity", "reserve", "charge")
    columns = [np.asarray(fleet[name]).reshape(len(fleet), -1) for name in deciding]
    kinds = np.unique(np.concatenate(columns, axis=1), axis=0, return_inverse=True)[1]
    return np.asarray(kinds).reshape(-1)


def _last_legs(scene: Scene, roadmap: Roadmap, fleet: np.ndarray) -> np.ndarray:
    """Return the cost from each place to each robot's finish [m], (R, G + S + 1)."""
    places = len(scene.targets())
    legs = np.zeros((len(fleet), places + 1))
    for r, finish in enumerate(finish_of(scene)):
        if finish >= 0:
            legs[r, :places] = roadmap.distance[fleet[r]["field"], :places, finish]
            legs[r, places] = roadmap.start_distance[r, finish]
    return legs


ROADMAPS = 3
"""Roadmaps built at most, each with three times the samples, to join all goals."""


def state_mission(
    scene: Scene, seed: int, params: PlannerParams, halt: np.ndarray = NEVER
) -> Problem:
    """Build the roadmap, denser while it does not join all goals, and the problem.

    Robots keep less than their margins on ways to targets that it does not join with
    them, and about starts that are nearer to obstacles.

    Raises:
        Halted: once `halt[0]` has turned true.
    """
    world = World.from_scene(scene, cell_m=cell_m(scene, params.margins))
    problem = _joined(scene, seed, params, world, halt)
    lacking = unjoined(scene, problem.roadmap)
    fleet, spaces = problem.mission.fleet, problem.mission.spaces
    cramped = cramped_starts(fleet, spaces, problem.start)
    beside_walls = sorted({*cramped, *(r for r, _ in lacking)})
    openings = (
        *openings_at_starts(scene, params.margins, beside_walls),
        *openings_to(scene, params.margins, lacking),
    )
    return _opened(scene, seed, params, openings, halt) if openings else problem


def tightened(
    scene: Scene, seed: int, params: PlannerParams, halt: np.ndarray = NEVER
) -> Problem | None:
    """Return the problem with the certified minimum in all narrow ground.

    Where robots have to turn they may need it though they get through without. A robot
    alone on wide ground has nothing to gain: None.

    Raises:
        Halted: once `halt[0]` has turned true.
    """
    openings = tightest_openings(scene, params.margins)
    alone = len(scene.robots) == 1 and not openings
    return None if alone else _opened(scene, seed, params, openings, halt)


def _opened(
    scene: Scene,
    seed: int,
    params: PlannerParams,
    openings: tuple[Opening, ...],
    halt: np.ndarray,
) -> Problem:
    """Return the problem with openings."""
    fine_m = cell_m(scene, params.margins, LEAST_CELL_M)
    world = World.from_scene(
        scene, cell_m=fine_m, openings=openings, guide_m=guide_m(fine_m)
    )
    opened = _joined(scene, seed, params, world, halt)
    return replace(opened, openings=openings)


def _joined(
    scene: Scene, seed: int, params: PlannerParams, world: World, halt: np.ndarray
) -> Problem:
    """Return the problem with the first roadmap of several that joins all goals."""
    priced = priced_world(scene, world)
    samples = params.samples
    for attempt in range(ROADMAPS):
        roadmap = build_roadmap(
            scene,
            priced,
            samples=samples,
            neighbours=params.neighbours,
            margins=params.margins,
            rng=seeding.stream(seed, "roadmap", attempt),
            halt=halt,
        )
        if not any(t < len(scene.goals) for _, t in unjoined(scene, roadmap)):
            break
        samples *= 3
    if priced is not world:
        roadmap = with_energies(roadmap, scene, world, params.margins)
    return state_problem(scene, world, roadmap, params)


def unjoined(scene: Scene, roadmap: Roadmap) -> list[tuple[int, int]]:
    """Return robots and numbers of targets that the roadmap knows no path to for them.

    That is goals and stations that no robot knows one to, for every robot, and finishes
    for their own.
    """
    joined = np.isfinite(roadmap.start_distance)
    robots = range(len(scene.robots))
    shared = range(len(scene.targets()))
    own = enumerate(finish_of(scene).tolist())
    return [
        *((r, t) for t in shared if not joined[:, t].any() for r in robots),
        *((r, t) for r, t in own if t >= 0 and not joined[r, t]),
    ]
