"""The supervisor of a fleet: stops it when it must, and plans the rest anew.

It watches a simulation. When a robot fails, or energy or tracking leave their corridor,
the whole fleet comes to rest by the braking its plan keeps possible. From there the
rest of the mission is planned with what was measured: charges, rolling resistances,
goals already visited, robots that are out of service. Planning takes no simulated time
beyond a fixed pause, so that a run is a function of its arguments.

    FOLLOWING --a fault, or a corridor left--> STOPPING --at rest, new plan--> FOLLOWING
                                               STOPPING --at rest, no plan--> FOLLOWING
                                                   (the rest pose, until the run ends)
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mrmg.energy.text import energy_text
from mrmg.plans import Plan
from mrmg.scene.types import Scene
from mrmg.simulation.supervision import Event, Observation, Orders
from mrmg.supervision.corridor import Departure, EnergyCorridor, tracking_departure
from mrmg.supervision.course import Course
from mrmg.supervision.faults import StopFault
from mrmg.supervision.history import History
from mrmg.supervision.metering import RobotMeter
from mrmg.supervision.remaining import FleetCondition, is_over
from mrmg.supervision.replanning import Replan, Replanner

TRACKED_M = 0.1
"""Offset up to which a robot counts as being where its plan has it."""

CHECK_S = 0.5
"""Time between two looks at the energy."""

PAUSE_S = 2.0
"""How long the fleet stands for a new plan."""

MOST_REPLANS = 10
"""New plans after which only faults still stop the fleet."""

_NO_PROGRESS_M = 1.0
"""Way between two hold-ups below which a robot makes no progress [m]."""

_SLOW_RATE = 0.5
"""Rate of the fleet's clock below which the fleet waits for somebody."""


class FleetSupervisor:
    """Supervises one run; see `simulation.supervision.Supervisor`.

    Attributes:
        events: what happened, in order of time.
        replans: outcomes of planning anew, in order.
        course: the plans in force so far.
    """

    def __init__(
        self,
        scene: Scene,
        plan: Plan,
        *,
        faults: Sequence[StopFault] = (),
        replanner: Replanner | None = None,
    ) -> None:
        """Supervise a mission.

        Args:
            scene: the mission.
            plan: it starts by.
            faults: in order of time.
            replanner: None to end the mission where the fleet had to be stopped.
        """
        self.events: tuple[Event, ...] = ()
        self.replans: list[Replan] = []
        self.course = Course.of(scene, plan)
        self._scene, self._replanner = scene, replanner
        self._robots = [robot.id for robot in scene.robots]
        self._faults = list(faults)
        self._out_of_service: set[str] = set()
        self._held_up_at: dict[str, np.ndarray] = {}
        self._meters = {robot.id: RobotMeter(scene, robot) for robot in scene.robots}
        for name, meter in self._meters.items():
            meter.battery.follow(plan.tours[name])
        self._energy = EnergyCorridor(self.course)
        self._history = History(scene)
        self._stopping = False

    def watch(self, now: Observation) -> Orders | None:
        """Look at the run after a tick; see `Supervisor.watch`."""
        self._history.add(now)
        if self._history.unmetered_s >= CHECK_S - 1e-9:
            self._history.feed(self._meters)
        faulty = self._break_down(now)
        if self._stopping:
            return self._resume(now) if now.ended else None
        if faulty:
            return self._stop(now)
        departure = self._departure(now)
        if departure is None:
            return None
        self._report(now, departure.cause, departure.robot, "stop", departure.message)
        if departure.cause == "tracking":
            self._retire_without_progress(now, departure.robot)
        return self._stop(now)

    def _break_down(self, now: Observation) -> bool:
        """Let due faults happen; return whether any did."""
        due = [fault for fault in self._faults if fault.time_s <= now.time_s]
        for fault in due:
            self._faults.remove(fault)
            if fault.robot not in self._out_of_service:
                self._out_of_service.add(fault.robot)
                text = f"{fault.robot} has broken down"
                self._report(now, "fault", fault.robot, "stop", text)
        return bool(due)

    def _retire_without_progress(self, now: Observation, robot: str) -> None:
        """Take a robot out of service that has held up the fleet here before."""
        place = now.state[self._robots.index(robot), :2]
        before = self._held_up_at.get(robot)
        self._held_up_at[robot] = place
        if before is not None and np.hypot(*(place - before)) < _NO_PROGRESS_M:
            self._out_of_service.add(robot)
            text = f"{robot} does not get on and is taken out of service"
            self._report(now, "tracking", robot, "stop", text)

    def _departure(self, now: Observation) -> Departure | None:
        """Return the corridor that was left, if replanning could help."""
        if self._replanner is None or len(self.replans) >= MOST_REPLANS or now.ended:
            return None
        departure = tracking_departure(self._robots, now)
        if departure is None and self._history.unmetered_s == 0.0:
            departure = self._energy.left(now.clock_s, self._meters)
        return departure

    def _stop(self, now: Observation) -> Orders | None:
        """Bring the fleet to rest from the next step of the plan on."""
        self._stopping = True
        dt_s = self.course.plan.dt_s
        step = math.floor(now.clock_s / dt_s + 1e-9) + 1
        if step >= self.course.steps:
            return None
        states = {}
        for index, item in enumerate(self.course.plan.trajectories):
            tracked = now.off_m[index] <= TRACKED_M
            on_plan = tracked and now.rate >= _SLOW_RATE
            states[item.robot] = item.state[step] if on_plan else now.state[index]
        self.course = self.course.stopped(step, states, self._out_of_service, PAUSE_S)
        clock_s = now.clock_s if now.rate >= _SLOW_RATE else step * dt_s
        return Orders(plan=self.course.plan, clock_s=clock_s)

    def _resume(self, now: Observation) -> Orders | None:
        """Plan the rest from where the fleet has come to rest."""
        self._history.feed(self._meters)
        self._stopping = False
        condition = self._condition(now)
        missing = [
            goal.id for goal in self._scene.goals if goal.id not in condition.visited
        ]
        if is_over(self._scene, condition):
            self._report(now, "rest", "", "finish", "all goals have been visited")
            return None
        over = self._why_over(missing)
        if over:
            self._report(now, "rest", "", "end", over)
            return None
        assert self._replanner is not None
        outcome = replace(
            self._replanner.replan(condition, len(self.replans)),
            time_s=now.time_s,
            rolling_factor=condition.rolling_factor,
        )
        self.replans.append(outcome)
        if outcome.scene is None or outcome.plan is None:
            text = f"no way to go on: {outcome.reason}; goals left: {_list(missing)}"
            self._report(now, "rest", "", "end", text)
            return None
        step = self.course.steps
        entered = self._history.entered(self.course.plan.tours)
        tours = {
            name: (*targets, *outcome.plan.tours.get(name, ()))
            for name, targets in entered.items()
        }
        self.course = self.course.resumed(
            outcome.plan, condition.energy_J, condition.rolling_factor, tours
        )
        for name, meter in self._meters.items():
            meter.battery.follow(outcome.plan.tours.get(name, ()))
        self._energy.follow(self.course, step, self._meters, outcome.scene)
        for reason in dict.fromkeys(outcome.given_up.values()):
            self._report(now, "rest", "", "give_up", reason)
        self._report(now, "rest", "", "replan", _said(outcome, len(missing), condition))
        return Orders(plan=self.course.plan, clock_s=step * self.course.plan.dt_s)

    def _why_over(self, missing: Sequence[str]) -> str:
        """Return why the mission ends where the fleet rests; "" if it need not."""
        left = f"goals left: {_list(missing)}"
        if self._replanner is None:
            return f"replanning is off; {left}"
        if len(self._out_of_service) == len(self._robots):
            return f"no robot is left in service; {left}"
        return ""

    def _condition(self, now: Observation) -> FleetCondition:
        """Return the condition of the fleet, which is at rest."""
        poses = {}
        for index, item in enumerate(self.course.plan.trajectories):
            gone = item.robot in self._out_of_service
            true = now.off_m[index] > TRACKED_M or gone
            x, y, yaw = (now.state[index] if true else item.state[-1])[:3]
            poses[item.robot] = (float(x), float(y), float(yaw))
        visited = self._history.visited()
        return FleetCondition(
            pose=poses,
            energy_J={
                name: meter.battery.charge_J for name, meter in self._meters.items()
            },
            rolling_factor={
                name: meter.rolling.factor for name, meter in self._meters.items()
            },
            out_of_service=frozenset(self._out_of_service),
            time_s=now.time_s,
            visited=visited,
            stays=self._history.stays(visited, self._out_of_service),
        )

    def _report(
        self, now: Observation, cause: str, robot: str, action: str, message: str
    ) -> None:
        event = Event(
            time_s=now.time_s, cause=cause, robot=robot, action=action, message=message
        )
        self.events = (*self.events, event)


def _said(outcome: Replan, missing: int, condition: FleetCondition) -> str:
    """Return one sentence about a new plan."""
    assert outcome.plan is not None
    wanted = missing - len(outcome.given_up)
    count = f"{wanted} of {missing}" if outcome.given_up else str(wanted)
    words = [
        f"new plan for {count} {'goal' if count == '1' else 'goals'}: "
        f"{energy_text(outcome.plan.cost_J, 1)} in {outcome.plan.makespan_s:.0f} s"
    ]
    factors = [
        f"{name} {factor:.2f}"
        for name, factor in condition.rolling_factor.items()
        if name not in condition.out_of_service
    ]
    words.append(f"rolling resistance {', '.join(factors)} of the model's")
    if outcome.reserve_share < 1.0:
        words.append(f"keeps {outcome.reserve_share:.0%} of the reserves")
    return "; ".join(words)


def _list(names: Sequence[str]) -> str:
    return ", ".join(names) or "none"
