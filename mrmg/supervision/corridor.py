"""The corridors a driving fleet must stay in, and the reports of leaving one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mrmg.compared import compared
from mrmg.scene.types import Scene
from mrmg.simulation.supervision import Observation
from mrmg.supervision.course import Course
from mrmg.supervision.metering import RobotMeter

OFF_M = 0.5
"""How far a robot may be from its plan."""

STALL_S = 2.0
"""How long the fleet's clock may stand still."""

ENERGY_SHARE = 0.10
"""Excess of measured over planned energy since the last plan that is tolerated, as a
share of the planned."""

ENERGY_FLOOR = 0.01
"""Further excess tolerated, as a share of the capacity: what is measured over a few
metres is uncertain."""

_CHANCE_M = 1.0
"""Way over plain ground; by its energy planned and measured may differ by chance."""


@dataclass(frozen=True, slots=True)
class Departure:
    """A corridor that was left.

    Attributes:
        cause: "energy" or "tracking".
        robot: id of the robot.
        message: one sentence.
    """

    cause: str
    robot: str
    message: str


def tracking_departure(robots: Sequence[str], now: Observation) -> Departure | None:
    """Return which robot is off its plan, or keeps the whole fleet waiting, if any.

    Args:
        robots: ids, in the scene's order.
        now: the fleet.
    """
    worst = int(now.off_m.argmax())
    robot, off_m = robots[worst], now.off_m[worst]
    if off_m > OFF_M:
        text = f"{robot} is {off_m:.2f} m off its plan"
        return Departure("tracking", robot, text)
    if now.stalled_s > STALL_S:
        text = f"the fleet has waited {now.stalled_s:.1f} s for {robot}"
        return Departure("tracking", robot, text)
    return None


class EnergyCorridor:
    """Reports when a robot takes more energy than the plan in force allows for.

    Measured over planned energy since the plan began, less what may be chance, is how
    much more than planned the rest is expected to take, too.
    """

    def __init__(self, course: Course) -> None:
        """Reckon from the beginning of a course."""
        self.follow(course, 0, {}, course.scene)

    def follow(
        self,
        course: Course,
        step: int,
        meters: Mapping[str, RobotMeter],
        planned_for: Scene,
    ) -> None:
        """Reckon from a step of a course on.

        Args:
            course: whose plan is in force.
            step: of the course, at which that plan begins.
            meters: of all robots at that step.
            planned_for: the scene whose reserves that plan keeps.
        """
        self._course, self._step = course, step
        self._reserve_J = {
            robot.id: min(
                robot.battery.reserve_J,
                course.scene.robot(robot.id).battery.reserve_J,
            )
            for robot in planned_for.robots
        }
        self._used_J = {name: meter.used_J for name, meter in meters.items()}
        self._planned_J = {
            robot: np.concatenate([[0.0], np.cumsum(parts_J.sum(axis=1))])
            for robot, parts_J in course.parts_J.items()
        }

    def left(
        self, clock_s: float, meters: Mapping[str, RobotMeter]
    ) -> Departure | None:
        """Return how the corridor was left at a plan time, if it was."""
        for robot, meter in meters.items():
            departure = self._left_by(robot, meter, clock_s)
            if departure is not None:
                return departure
        return None

    def _left_by(
        self, robot: str, meter: RobotMeter, clock_s: float
    ) -> Departure | None:
        capacity_J = meter.robot.battery.capacity_J
        planned_J = self._planned(robot, self._step * self._dt_s, clock_s)
        measured_J = meter.used_J - self._used_J.get(robot, 0.0)
        excess_J = measured_J - planned_J
        tolerated_J = ENERGY_SHARE * planned_J + ENERGY_FLOOR * capacity_J
        if excess_J > tolerated_J:
            used, planned = compared(measured_J, planned_J)
            text = f"has used {used} J since its plan began, planned were {planned} J"
            return Departure("energy", robot, f"{robot} {text}")
        chance_J = _CHANCE_M * meter.robot.model.energy_model.plain_ground_J_per_m()
        if excess_J <= chance_J or planned_J <= 0.0 or robot not in self._reserve_J:
            return None
        more = 1.0 + (excess_J - chance_J) / planned_J
        target, arrival_s = self._next_recharge(robot, clock_s)
        to_go_J = more * self._planned(robot, clock_s, arrival_s)
        left_J, reserve_J = meter.battery.charge_J - to_go_J, self._reserve_J[robot]
        if left_J < reserve_J:
            left, reserve = compared(left_J, reserve_J)
            text = f"would get to {target} with {left} J, its reserve is {reserve} J"
            return Departure("energy", robot, f"{robot} {text}")
        return None

    @property
    def _dt_s(self) -> float:
        return self._course.plan.dt_s

    def _planned(self, robot: str, from_s: float, to_s: float) -> float:
        """Return the planned energy of a robot between two plan times [J]."""
        sums_J = self._planned_J[robot]
        times_s = np.arange(len(sums_J)) * self._dt_s
        before_J, after_J = np.interp([from_s, to_s], times_s, sums_J)
        return float(after_J - before_J)

    def _next_recharge(self, robot: str, clock_s: float) -> tuple[str, float]:
        """Return where and when a robot recharges next, or where its plan ends."""
        for visit in self._course.plan.visits:
            ahead = visit.step * self._dt_s > clock_s
            if visit.robot == robot and visit.kind == "station" and ahead:
                return visit.target, visit.step * self._dt_s
        return "the end of its tour", self._course.steps * self._dt_s
