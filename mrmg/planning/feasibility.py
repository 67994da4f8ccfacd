"""Proofs that a mission cannot be solved; nothing is called infeasible without one.

All proofs relax the problem: robots become discs that fit inside their footprints,
their dynamics and each other are ignored, and ways are as short as the obstacles allow
at all. What is impossible then is impossible.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
import shapely
from shapely.geometry import Point, Polygon, box

from mrmg.planning.roadmap.slopes import climb_J, height_span_m
from mrmg.scene.types import Goal, Region, Robot, Scene


def proof_of_infeasibility(scene: Scene) -> str | None:
    """Return why the mission has no solution, or None if no proof is known."""
    goals = next(iter(impossible_goals(scene).values()), None)
    return goals or _unreachable_finish(scene) or _crowded_finish(scene)


def impossible_goals(scene: Scene) -> dict[str, str]:
    """Return the goals that no robot can visit, each with the proof's sentence."""
    proofs = [_Reach.of(scene, robot) for robot in scene.robots]
    reasons = {goal.id: _why_impossible(goal, proofs) for goal in scene.goals}
    return {name: reason for name, reason in reasons.items() if reason}


def _why_impossible(goal: Goal, proofs: list[_Reach]) -> str:
    connected = [reach for reach in proofs if reach.is_connected(goal.region)]
    if not connected:
        return (
            f"goal {goal.id} is unreachable: for every robot it is cut off from "
            "the start by obstacles with no gap as wide as the robot"
        )
    missing_J = min(reach.missing_energy_J(goal.region) for reach in connected)
    if missing_J > 0.0:
        return (
            f"goal {goal.id} is out of energy's reach: even on the shortest way, "
            "over every station that can be reached, each robot that can get there "
            f"lacks at least {missing_J:.0f} J above its reserve"
        )
    return ""


def _unreachable_finish(scene: Scene) -> str | None:
    """Return which robot's finish it cannot get to."""
    for robot in scene.robots:
        if robot.finish and not _Reach.of(scene, robot).is_connected(
            robot.finish.region
        ):
            return (
                f"the finish of {robot.id} is unreachable: it is cut off from the "
                "start by obstacles with no gap as wide as the robot"
            )
    return None


def _crowded_finish(scene: Scene) -> str | None:
    """Return which two robots cannot both be at their finishes.

    The discs about the reference points inside both footprints would overlap wherever
    in their finishes the two stand.
    """
    bound = [
        (robot, _whole(robot.finish.region)) for robot in scene.robots if robot.finish
    ]
    for (first, first_region), (second, second_region) in combinations(bound, 2):
        widest_m = _longest_distance_m(first_region, second_region)
        needed_m = first.model.inscribed_radius_m + second.model.inscribed_radius_m
        if widest_m < needed_m:
            return (
                f"{first.id} and {second.id} cannot both stand at their finishes: no "
                f"two points of these are {needed_m:.2f} m apart, as the robots' "
                "bodies need"
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
        blocked: obstacles the reference point cannot enter.
        left_J: energy above the reserve with which the robot can leave each place it
            can recharge at, and the start, at best: (region, energy).
    """

    scene: Scene
    robot: Robot
    free: shapely.Geometry
    offset_m: float
    blocked: shapely.Geometry
    left_J: tuple[tuple[Region | Point, float], ...]

    @staticmethod
    def of(scene: Scene, robot: Robot) -> _Reach:
        obstacles = shapely.union_all(
            [obstacle.shape for obstacle in scene.obstacles if obstacle.stops(robot.id)]
        )
        # The largest disc inside the footprint; shrunk by the search's tolerance.
        spoke = shapely.maximum_inscribed_circle(Polygon(robot.model.footprint_m))
        centre = np.asarray(spoke.coords[0])
        radius = 0.98 * spoke.length
        x_min, y_min, x_max, y_max = scene.bounds
        free = box(
            x_min + radius, y_min + radius, x_max - radius, y_max - radius
        ).difference(obstacles.buffer(radius))
        x, y, yaw = robot.pose
        turn = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])
        disc = Point(turn @ centre + (x, y))
        parts = [part for part in shapely.get_parts(free) if part.distance(disc) < 0.05]
        reach = _Reach(
            scene=scene,
            robot=robot,
            free=shapely.union_all(parts),
            offset_m=float(np.hypot(*centre)),
            blocked=obstacles,
            left_J=(),
        )
        return reach._with_stations()

    def is_connected(self, region: Region) -> bool:
        """Tell whether the robot may get into a region as far as obstacles go."""
        near = _whole(region).buffer(self.offset_m + 0.05)
        return bool(self.free.intersects(near))

    def missing_energy_J(self, region: Region) -> float:
        """Return what the robot lacks to get to a region; not positive if it may."""
        return min(
            self._least_J(place, region) - energy_J for place, energy_J in self.left_J
        )

    def _with_stations(self) -> _Reach:
        battery = self.robot.battery
        full_J = battery.capacity_J - battery.reserve_J
        start = (Point(*self.robot.pose[:2]), battery.start_J - battery.reserve_J)
        reached: list[tuple[Region | Point, float]] = [start]
        waiting = [s for s in self.scene.stations if self.is_connected(s.region)]
        for place, energy_J in reached:  # grows while it is walked through
            for station in [*waiting]:
                if self._least_J(place, station.region) <= energy_J:
                    waiting.remove(station)
                    reached.append((station.region, full_J))
        return _Reach(
            scene=self.scene,
            robot=self.robot,
            free=self.free,
            offset_m=self.offset_m,
            blocked=self.blocked,
            left_J=tuple(reached),
        )

    def _least_J(self, place: Region | Point, region: Region) -> float:
        """Return a lower bound of the energy from a place to a region."""
        cheapest = min([1.0, *(area.multiplier for area in self.scene.terrain)])
        joules = cheapest * self.robot.model.energy_model.plain_ground_J_per_m()
        start = place if isinstance(place, Point) else _whole(place)
        end = _whole(region)
        _, high_m = height_span_m(self.scene, self.robot, start)
        low_m, _ = height_span_m(self.scene, self.robot, end)
        way_J = joules * shortest_way_m(start, end, self.blocked)
        return way_J + climb_J(self.robot, low_m - high_m)


def shortest_way_m(
    start: shapely.Geometry, end: shapely.Geometry, blocked: shapely.Geometry
) -> float:
    """Return a lower bound of the shortest way between two convex sets [m].

    Where an obstacle is in the way of the straight line, the way goes by one of the
    obstacles' corners at least.
    """
    straight = float(start.distance(end))
    line = shapely.shortest_line(start, end)
    if not line.intersects(shapely.buffer(blocked, -1e-6)):
        return straight
    corners = shapely.points(shapely.get_coordinates(blocked))
    by_corner = shapely.distance(corners, start) + shapely.distance(corners, end)
    return max(straight, float(by_corner.min()))


def _whole(region: Region) -> shapely.Geometry:
    """Return a polygon that holds the region; circles are drawn from within."""
    return region.shape.buffer(0.002 * region.radius_m)
