"""Proofs that a mission cannot be solved; nothing is called infeasible without one.

All proofs relax the problem: robots become discs that fit inside their footprints,
their dynamics and each other are ignored, and ways are as short as the obstacles allow
at all. What is impossible then is impossible.
"""

from __future__ import annotations

from collections.abc import Container, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np
import shapely
from shapely.geometry import Point, Polygon

from mrmg.errors import Fault, SceneError
from mrmg.planning.endings import (
    FINISHES_CROWDED,
    FINISHES_IN_STATION,
    GOAL_OUT_OF_ENERGY,
    listed,
)
from mrmg.planning.free_ground import FreeGround
from mrmg.planning.halting import NEVER, check
from mrmg.planning.path_bounds import Walls, outer_polygon, shortest_way_m
from mrmg.planning.roadmap.slopes import climb_J, height_span_m
from mrmg.planning.room import finish_cut_off, goal_cut_off, no_room
from mrmg.scene.region import Region
from mrmg.scene.types import Finish, Goal, Robot, Scene


def require_robots(scene: Scene) -> None:
    """Refuse a scene that is but a map, or has no digest.

    Raises:
        SceneError: if it has no robots, or numbers that are not finite.
    """
    _ = scene.digest  # which refuses these numbers; kernels would not
    if not scene.robots:
        message = "there are none; a mission needs at least one (mrmg scene populate)"
        raise SceneError(scene.name, [Fault("robots", message)])


def proof_of_infeasibility(scene: Scene, halt: np.ndarray = NEVER) -> str | None:
    """Return why the mission has no solution, or None if no proof is known.

    Raises:
        Halted: once `halt[0]` has turned true.
    """
    reaches = _reaches(scene, halt)
    proofs = _cut_off(scene, reaches)
    if proofs:
        return _with_others(proofs, dict.fromkeys(proofs, ""))
    short = _out_of_energy(scene, reaches, halt)
    if short:
        amounts = {goal: f" by {missing}" for goal, missing in short.items()}
        return _with_others(_out_of_reach(short), amounts)
    return _unreachable_finish(scene, reaches) or _crowded_finish(scene)


def _with_others(proofs: Mapping[str, str], amounts: Mapping[str, str]) -> str:
    """Return the first goal's proof, and the other goals that it holds for, too."""
    (_, sentence), *others = proofs.items()
    if not others:
        return sentence
    names = [f"{goal}{amounts[goal]}" for goal, _ in others]
    return f"{sentence}; likewise {listed(names)}"


def impossible_goals(scene: Scene, halt: np.ndarray = NEVER) -> dict[str, str]:
    """Return the goals that no robot can visit, each with the proof's sentence.

    Raises:
        Halted: once `halt[0]` has turned true.
    """
    reaches = _reaches(scene, halt)
    short = _out_of_energy(scene, reaches, halt)
    return _cut_off(scene, reaches) | _out_of_reach(short)


def mission_warnings(scene: Scene) -> list[str]:
    """Return what is known to keep a mission from being done, before it is planned.

    That is which goals and finishes are cut off, which finishes crowd each other, and
    which goals are out of reach of batteries: the robot cannot even drive there on the
    shortest path, recharging at any station it can reach. Goals that no robot reaches
    make a mission infeasible; they come before those that some cannot reach.
    """
    reaches = _reaches(scene)
    nobodys = _out_of_energy(scene, reaches)
    finishes = [_unreachable_finish(scene, reaches), _crowded_finish(scene)]
    return [
        *_cut_off(scene, reaches).values(),
        *filter(None, finishes),
        *_out_of_reach(nobodys).values(),
        *_out_of_own_reach(scene, reaches, nobodys),
    ]


def _out_of_own_reach(
    scene: Scene, reaches: Sequence[_Reach], nobodys: Container[str]
) -> Iterator[str]:
    """Yield sentences on robots that cannot reach goals that others can."""
    for reach in reaches:
        missing = {
            goal.id: reach.missing_energy_J(goal.region)
            for goal in scene.goals
            if goal.id not in nobodys and reach.is_connected(goal.region)
        }
        far = [name for name, missing_J in missing.items() if missing_J > 0.0]
        if far:
            most = energy_and_metres(max(missing.values()), reach.robot)
            yield (
                f"{reach.robot.id} cannot reach {listed(far)} with its battery, even "
                f"on the shortest path over every station: it is short of up to "
                f"{most} above its reserve; other robots can"
            )


def energy_and_metres(energy_J: float, robot: Robot) -> str:
    """Return an energy in words, for one robot in metres of plain ground, too."""
    units = energy_J / robot.model.energy_model.plain_ground_J_per_m()
    metres = units * robot.model.unit_m
    return f"{energy_J:.0f} J ({metres:.1f} m of plain ground)"


def _reaches(scene: Scene, halt: np.ndarray = NEVER) -> list[_Reach]:
    found = []
    for robot in scene.robots:
        check(halt)
        found.append(_Reach.of(scene, robot))
    return found


def _cut_off(scene: Scene, reaches: Sequence[_Reach]) -> dict[str, str]:
    """Return the goals that no robot of a fleet gets into, as far as obstacles go."""
    found = {goal.id: _no_way(scene, reaches, goal) for goal in scene.goals}
    return {goal: why for goal, why in found.items() if why}


def _no_way(scene: Scene, reaches: Sequence[_Reach], place: Goal | Finish) -> str:
    """Return why no robot gets into a place, as far as obstacles go; "" if one may."""
    why = ""
    for reach in reaches:
        if reach.is_connected(place.region):
            why = no_room(scene, reach.robot, place)
            if not why:
                return ""
    if why or not reaches:
        return why
    if isinstance(place, Finish):
        return finish_cut_off(scene, reaches[0].robot)
    return goal_cut_off(scene, place)


def _out_of_energy(
    scene: Scene, reaches: Sequence[_Reach], halt: np.ndarray = NEVER
) -> dict[str, str]:
    """Return the goals that are not cut off, but out of every battery's reach.

    With each, in words, what the robot that comes nearest is short of above its
    reserve, at least.
    """
    found = {}
    for goal in scene.goals:
        least: tuple[float, Robot] | None = None
        for reach in reaches:
            check(halt)
            if not reach.is_connected(goal.region):
                continue
            missing_J = reach.missing_energy_J(goal.region)
            if least is None or missing_J < least[0]:
                least = missing_J, reach.robot
            if missing_J <= 0.0:
                break
        if least is not None and least[0] > 0.0:
            found[goal.id] = energy_and_metres(*least)
    return found


def _out_of_reach(short: Mapping[str, str]) -> dict[str, str]:
    """Return the sentences on goals for which every robot is short of energy."""
    return {
        goal: GOAL_OUT_OF_ENERGY.format(goal=goal, missing=missing)
        for goal, missing in short.items()
    }


def _unreachable_finish(scene: Scene, reaches: Sequence[_Reach]) -> str | None:
    """Return which robot's finish it cannot get to."""
    for reach in reaches:
        finish = reach.robot.finish
        why = finish and _no_way(scene, [reach], finish)
        if why:
            return why
    return None


def _crowded_finish(scene: Scene) -> str | None:
    """Return which two robots cannot both be at their finishes.

    The discs about the reference points inside both footprints would overlap wherever
    in their finishes the two stand, or both would be at a station for one at a time.
    """
    bound = [(robot, robot.finish.region) for robot in scene.robots if robot.finish]
    single = [station for station in scene.stations if station.one_at_a_time]
    for (first, here), (second, there) in combinations(bound, 2):
        widest_m = _longest_distance_m(outer_polygon(here), outer_polygon(there))
        needed_m = first.model.inscribed_radius_m + second.model.inscribed_radius_m
        if widest_m < needed_m:
            return FINISHES_CROWDED.format(
                first=first.id, second=second.id, needed_m=needed_m
            )
        for station in single:
            if station.region.covers(here) and station.region.covers(there):
                return FINISHES_IN_STATION.format(
                    first=first.id, second=second.id, station=station.id
                )
    return None


def _longest_distance_m(first: shapely.Geometry, second: shapely.Geometry) -> float:
    """Return the largest distance of a point of one convex set from one of another."""
    corners = [shapely.get_coordinates(one) for one in (first, second)]
    offset = corners[0][:, None] - corners[1][None]
    return float(np.hypot(offset[..., 0], offset[..., 1]).max())


@dataclass(frozen=True)
class _Reach:
    """What one robot can reach at best.

    Attributes:
        scene, robot: the problem.
        free: where the centre of a disc inside the robot may be, the part joined to
            the start.
        offset_m: distance of the disc's centre from the reference point.
        walls: obstacles the reference point cannot enter.
    """

    scene: Scene
    robot: Robot
    free: shapely.Geometry
    offset_m: float
    walls: Walls

    @staticmethod
    def of(scene: Scene, robot: Robot) -> _Reach:
        ground = FreeGround.of(scene, robot)
        # The largest disc inside the footprint; shrunk by the search's tolerance.
        spoke = shapely.maximum_inscribed_circle(Polygon(robot.model.footprint_m))
        centre = np.asarray(spoke.coords[0])
        radius = 0.98 * spoke.length
        x, y, yaw = robot.pose
        turn = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])
        disc = Point(turn @ centre + (x, y))
        parts = [part for part in ground.pieces(radius) if part.distance(disc) < 0.05]
        return _Reach(
            scene=scene,
            robot=robot,
            free=shapely.union_all(parts),
            offset_m=float(np.hypot(*centre)),
            walls=Walls.of(ground.obstacles),
        )

    def is_connected(self, region: Region) -> bool:
        """Return whether the robot may get into a region as far as obstacles go."""
        near = outer_polygon(region).buffer(self.offset_m + 0.05)
        return bool(self.free.intersects(near))

    def missing_energy_J(self, region: Region) -> float:
        """Return what the robot lacks to get to a region; not positive if it may."""
        missing_J = np.inf
        for place, energy_J in self._left_J:
            missing_J = min(missing_J, self._least_J(place, region) - energy_J)
            if missing_J <= 0.0:
                break
        return missing_J

    @cached_property
    def _left_J(self) -> Sequence[tuple[Region | Point, float]]:
        """Return the places that the robot can recharge at, and the start.

        With each, the energy above the reserve with which it can leave it, at best.
        """
        battery = self.robot.battery
        # Robots may pass through a station at speed, and roll on from there.
        kinetic_J = self.robot.model.top_kinetic_J
        full_J = battery.capacity_J - battery.reserve_J + kinetic_J
        start = (Point(*self.robot.pose[:2]), battery.start_J - battery.reserve_J)
        reached: list[tuple[Region | Point, float]] = [start]
        waiting = [s for s in self.scene.stations if self.is_connected(s.region)]
        for place, energy_J in reached:  # grows while it is walked through
            for station in [*waiting]:
                if self._least_J(place, station.region) <= energy_J:
                    waiting.remove(station)
                    reached.append((station.region, full_J))
        return reached

    def _least_J(self, place: Region | Point, region: Region) -> float:
        """Return a lower bound of the energy from a place to a region."""
        model = self.robot.model
        if model.has_custom_motion:
            return 0.0  # see `lower_bound_J`
        cheapest = min([1.0, *(area.multiplier for area in self.scene.terrain)])
        cheapest += model.consumed_per_m(model.top_speed_m_s)
        joules = cheapest * model.energy_model.plain_ground_J_per_m()
        start = place if isinstance(place, Point) else outer_polygon(place)
        end = outer_polygon(region)
        _, high_m = height_span_m(self.scene, self.robot, start)
        low_m, _ = height_span_m(self.scene, self.robot, end)
        way_J = joules * shortest_way_m(start, end, self.walls)
        return way_J + climb_J(self.robot, low_m - high_m)
