"""A plain baseline: nearest goal first, recharge when low, straight-line following.

Whichever robot is free first drives straight to the nearest goal that nobody has taken,
or to the nearest station when its charge would not lead it to the goal and from there
to a station. It knows nothing of obstacles, terrain and other robots.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import atan, atan2, cos, hypot, pi, sin, tan

import numpy as np

from mrmg.energy.metering import battery_profile, find_visits, plan_ledger
from mrmg.motion.dynamics import car_derivative, rk4_step
from mrmg.plans import Plan, Trajectory
from mrmg.scene.types import Goal, Robot, Scene, Station

DT_S = 0.1

ALLOWANCE = 1.3
"""Energy that a metre is reckoned at, over that of plain ground straight ahead."""

LOOKAHEAD_M = 2.5
"""Distance of the point that is steered for, at most."""

DEEP = 0.5
"""Share of a target's radius within which a robot heads for the next one."""

LONGEST_LEG_S = 600.0
"""A robot that takes longer for one leg is stuck."""

_STEP = rk4_step(car_derivative(sin, cos, tan))


class StuckError(Exception):
    """A robot does not get to its target."""


@dataclass(slots=True)
class Car:
    """A car on its way.

    Attributes:
        scene: the mission.
        robot: which car it is.
        states, controls: of all steps so far.
        tour: ids of the targets visited.
    """

    scene: Scene
    robot: Robot
    states: list[tuple[float, ...]]
    controls: list[tuple[float, float]] = field(default_factory=list)
    tour: list[str] = field(default_factory=list)

    @property
    def time_s(self) -> float:
        """Time until which it has driven."""
        return len(self.controls) * DT_S

    def trajectory(self) -> Trajectory:
        """Return its motion so far."""
        return Trajectory(
            robot=self.robot.id,
            dt_s=DT_S,
            state=np.array(self.states, dtype=float),
            control=np.array(self.controls).reshape(-1, 2),
            motion=self.robot.model.motion_name,
        )

    def charge_J(self) -> float:
        """Return what its battery holds, as its energy model meters it."""
        if not self.controls:
            return self.robot.battery.start_J
        motion = self.trajectory()
        visits = find_visits(self.scene, motion, self.tour)
        return float(battery_profile(self.scene, motion, visits)[-1])

    def act(self, u1: float, u2: float) -> None:
        """Hold controls for a step."""
        wheelbase_m = self.robot.model.wheelbase_m
        self.states.append(_STEP(self.states[-1], (u1, u2), wheelbase_m, DT_S))
        self.controls.append((u1, u2))

    def drive_to(self, target: Goal | Station) -> None:
        """Follow the straight line to a target by pure pursuit.

        Raises:
            StuckError: if it is not there in time.
        """
        model = self.robot.model
        limits = model.limits.scaled(model.planning_share)
        centre, radius_m = target.region.center, DEEP * target_radius_m(target)
        until_s = self.time_s + LONGEST_LEG_S
        while hypot(*(np.array(self.states[-1][:2]) - centre)) > radius_m:
            if self.time_s > until_s:
                raise StuckError(f"{self.robot.id} does not get to {target.id}")
            x, y, theta, v, psi = self.states[-1]
            dx, dy = centre[0] - x, centre[1] - y
            off = (atan2(dy, dx) - theta + pi) % (2.0 * pi) - pi
            ahead_m = min(hypot(dx, dy), LOOKAHEAD_M)
            # A target inside the turning circle is left first, straight on.
            side_m = model.turning_radius_m - abs(-sin(theta) * dx + cos(theta) * dy)
            within = hypot(side_m, cos(theta) * dx + sin(theta) * dy)
            leaving = within < model.turning_radius_m and abs(off) > 0.5
            wanted = (
                0.0 if leaving else atan(2 * model.wheelbase_m * sin(off) / ahead_m)
            )
            if abs(off) > 0.5 * pi and not leaving:
                wanted = limits.w_max if off > 0.0 else -limits.w_max
            wanted = max(-limits.w_max, min(limits.w_max, wanted))
            self.act(
                bounded((limits.v_max_m_s - v) / DT_S, limits.u1_max_m_s2),
                bounded((wanted - psi) / DT_S, limits.u2_max),
            )
        self.tour.append(target.id)

    def stop(self) -> None:
        """Brake to rest."""
        model = self.robot.model
        most = model.limits.scaled(model.planning_share).u1_max_m_s2
        while abs(self.states[-1][3]) > 1e-9:
            self.act(bounded(-self.states[-1][3] / DT_S, most), 0.0)


def bounded(value: float, most: float) -> float:
    """Return a value within plus and minus a bound."""
    return max(-most, min(most, value))


def target_radius_m(target: Goal | Station) -> float:
    """Return how deep the middle of a target lies in it."""
    return float(target.region.depth(np.array([target.region.center]))[0])


def distance_m(point: tuple[float, ...], target: Goal | Station) -> float:
    """Return the distance of a state from a target's middle."""
    return hypot(point[0] - target.region.center[0], point[1] - target.region.center[1])


def plain_plan(scene: Scene) -> Plan:
    """Return the baseline's plan of a mission with cars, whatever is wrong with it.

    Raises:
        StuckError: if a robot does not get to a target, or no station is within reach.
    """
    cars = [Car(scene, robot, [(*robot.pose, 0.0, 0.0)]) for robot in scene.robots]
    open_goals = list(scene.goals)
    while open_goals:
        car = min(cars, key=lambda one: one.time_s)
        here = car.states[-1]
        goal = min(open_goals, key=lambda one: distance_m(here, one))
        metre_J = ALLOWANCE * car.robot.model.energy_model.plain_ground_J_per_m()
        left_J = car.charge_J() - car.robot.battery.reserve_J
        onwards_m = min(
            (
                distance_m(tuple(goal.region.center), station)
                for station in scene.stations
            ),
            default=0.0,
        )
        need_J = metre_J * (distance_m(here, goal) + onwards_m)
        if left_J >= need_J or not scene.stations:
            open_goals.remove(goal)
            car.drive_to(goal)
            continue
        station = min(scene.stations, key=lambda one: distance_m(here, one))
        if car.tour and car.tour[-1] == station.id:
            open_goals.remove(goal)  # full, and still not enough: it tries
            car.drive_to(goal)
            continue
        car.drive_to(station)
    for car in cars:
        car.stop()
    for car in cars:
        while len(car.controls) < max(len(one.controls) for one in cars):
            car.act(0.0, 0.0)
    driven = tuple(car.trajectory() for car in cars)
    tours = {car.robot.id: tuple(car.tour) for car in cars}
    visits = [
        visit
        for each in driven
        for visit in find_visits(scene, each, tours[each.robot])
    ]
    visits.sort(key=lambda visit: (visit.step, visit.robot))
    return Plan(
        scene_name=scene.name,
        scene_digest=scene.digest,
        seed=0,
        profile="baseline",
        parameters_digest="",
        versions={},
        dt_s=DT_S,
        trajectories=driven,
        tours=tours,
        visits=tuple(visits),
        ledger=plan_ledger(scene, driven, visits),
    )
