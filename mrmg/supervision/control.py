"""Mission control: stops the fleet when it must, and plans the rest anew.

It watches a simulation. When a robot fails, or energy or tracking leave their corridor,
the whole fleet comes to rest by the braking its plan keeps possible. From there the
rest of the mission is planned with what was measured: charges, rolling resistances,
goals already visited, robots that are out of service. Planning takes no simulated time
beyond a fixed pause, so that a run is a function of its arguments.
"""

from __future__ import annotations

import math
from collections.abc import Sequence, Set
from dataclasses import dataclass, field, replace

import numpy as np

from mrmg.energy.metering import LoggedMotion, find_visits
from mrmg.energy.visits import first_stay
from mrmg.plans import Plan
from mrmg.scene.types import Goal, Scene
from mrmg.simulation.supervision import Event, Observation, Orders
from mrmg.supervision.corridor import Departure, EnergyCorridor, TrackingCorridor
from mrmg.supervision.course import Course
from mrmg.supervision.faults import StopFault
from mrmg.supervision.meter import RobotMeter
from mrmg.supervision.parameters import ControlParams
from mrmg.supervision.remaining import FleetCondition, is_over, remaining_scene
from mrmg.supervision.replanning import Replan, Replanner
from mrmg.supervision.stays import VISITED_DEPTH_M, StayUnderWay, stays_under_way

_STUCK_M = 1.0
"""Way between two hold-ups below which a robot counts as stuck."""


@dataclass
class _History:
    """Everything seen so far, tick by tick; states begin with the start."""

    time_s: list[float]
    state: list[np.ndarray]
    work_J: list[np.ndarray] = field(default_factory=list)
    metered: int = 0


class MissionControl:
    """Supervises one run; see `execution.supervision.Supervisor`.

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
        params: ControlParams,
    ) -> None:
        """Watch over a mission.

        Args:
            scene: the mission.
            plan: it starts by.
            faults: in order of time.
            replanner: None to end the mission where the fleet had to be stopped.
            params: corridors and effort.
        """
        self.events: tuple[Event, ...] = ()
        self.replans: list[Replan] = []
        self.course = Course.of(scene, plan)
        self._scene, self._params, self._replanner = scene, params, replanner
        self._robots = [robot.id for robot in scene.robots]
        self._faults = list(faults)
        self._out_of_service: set[str] = set()
        self._held_up_at: dict[str, np.ndarray] = {}
        self._meters = {robot.id: RobotMeter(scene, robot) for robot in scene.robots}
        for name, meter in self._meters.items():
            meter.follow(plan.tours[name])
        self._tracking = TrackingCorridor(self._robots, params)
        self._energy = EnergyCorridor(self.course, params)
        start = np.array([(*robot.pose, 0.0, 0.0) for robot in scene.robots])
        self._seen = _History([0.0], [start])
        self._stopping = False

    def watch(self, now: Observation) -> Orders | None:
        """Look at the run after a tick; see `Supervisor.watch`."""
        self._note(now)
        if self._break_down(now) and not self._stopping:
            return self._stop(now)
        if self._stopping:
            return self._go_on(now) if now.ended else None
        departure = self._departure(now)
        if departure is None:
            return None
        self._tell(now, departure.cause, departure.robot, "stop", departure.message)
        if departure.cause == "tracking":
            self._give_up_if_stuck(now, departure.robot)
        return self._stop(now)

    def _note(self, now: Observation) -> None:
        seen = self._seen
        seen.time_s.append(now.time_s)
        seen.state.append(now.state)
        seen.work_J.append(now.work_J)
        if now.time_s - seen.time_s[seen.metered] >= self._params.check_s - 1e-9:
            self._meter()

    def _meter(self) -> None:
        """Let the meters take in what was not metered yet."""
        seen = self._seen
        if seen.metered == len(seen.work_J):
            return
        time_s = np.array(seen.time_s[seen.metered :])
        state = np.stack(seen.state[seen.metered :])
        work_J = np.stack(seen.work_J[seen.metered :])
        for index, meter in enumerate(self._meters.values()):
            meter.add(time_s, state[:, index], work_J[:, index])
        seen.metered = len(seen.work_J)

    def _break_down(self, now: Observation) -> bool:
        """Let due faults happen; tell whether any did."""
        due = [fault for fault in self._faults if fault.time_s <= now.time_s]
        for fault in due:
            self._faults.remove(fault)
            if fault.robot not in self._out_of_service:
                self._out_of_service.add(fault.robot)
                text = f"{fault.robot} has broken down"
                self._tell(now, "fault", fault.robot, "stop", text)
        return bool(due)

    def _give_up_if_stuck(self, now: Observation, robot: str) -> None:
        """Take a robot out of service that has not got on since it last held up all."""
        place = now.state[self._robots.index(robot), :2]
        before = self._held_up_at.get(robot)
        self._held_up_at[robot] = place
        if before is not None and np.hypot(*(place - before)) < _STUCK_M:
            self._out_of_service.add(robot)
            text = f"{robot} does not get on and is taken out of service"
            self._tell(now, "tracking", robot, "stop", text)

    def _departure(self, now: Observation) -> Departure | None:
        """Return the corridor that was left, if replanning could help."""
        limit = self._params.most_replans
        if self._replanner is None or len(self.replans) >= limit or now.ended:
            return None
        departure = self._tracking.left(now)
        if departure is None and self._seen.metered == len(self._seen.work_J):
            departure = self._energy.left(now.clock_s, self._meters)
        return departure

    def _stop(self, now: Observation) -> Orders | None:
        """Bring the fleet to rest from the next step of the plan on."""
        self._stopping = True
        dt_s = self.course.plan.dt_s
        step = math.floor(now.clock_s / dt_s + 1e-9) + 1
        if step >= self.course.steps:
            return None
        off_m = np.hypot(*(now.state - now.planned)[:, :2].T)
        states = {}
        for index, item in enumerate(self.course.plan.trajectories):
            tracked = off_m[index] <= self._params.tracked_m
            stalled = now.rate < 0.5
            on_plan = tracked and not stalled
            states[item.robot] = item.state[step] if on_plan else now.state[index]
        self.course = self.course.stopped(
            step, states, self._out_of_service, self._params.pause_s
        )
        clock_s = now.clock_s if now.rate >= 0.5 else step * dt_s
        return Orders(plan=self.course.plan, clock_s=clock_s)

    def _go_on(self, now: Observation) -> Orders | None:
        """Plan the rest from where the fleet has come to rest."""
        self._meter()
        self._stopping = False
        condition = self._condition(now)
        missing = [
            goal.id for goal in self._scene.goals if goal.id not in condition.visited
        ]
        if self._is_done(condition):
            self._tell(now, "rest", "", "finish", "all goals have been visited")
            return None
        over = self._why_over(missing)
        if over:
            self._tell(now, "rest", "", "end", over)
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
            self._tell(now, "rest", "", "end", text)
            return None
        step = self.course.steps
        tours = {
            name: (*entered, *outcome.plan.tours.get(name, ()))
            for name, entered in self._entered().items()
        }
        self.course = self.course.resumed(
            outcome.scene, outcome.plan, condition.energy_J, tours
        )
        for name, meter in self._meters.items():
            meter.follow(outcome.plan.tours.get(name, ()))
        self._energy.follow(self.course, step, self._meters, outcome.scene)
        self._tracking.reset(now.time_s)
        for reason in dict.fromkeys(outcome.given_up.values()):
            self._tell(now, "rest", "", "give_up", reason)
        self._tell(now, "rest", "", "replan", _said(outcome, len(missing), condition))
        return Orders(plan=self.course.plan, clock_s=step * self.course.plan.dt_s)

    def _is_done(self, condition: FleetCondition) -> bool:
        finishing = any(robot.finish is not None for robot in self._scene.robots)
        if len(condition.visited) < len(self._scene.goals):
            return False
        return not finishing or is_over(remaining_scene(self._scene, condition))

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
            off_m = float(np.hypot(*(now.state - now.planned)[index, :2]))
            gone = item.robot in self._out_of_service
            true = off_m > self._params.tracked_m or gone
            x, y, yaw = (now.state[index] if true else item.state[-1])[:3]
            poses[item.robot] = (float(x), float(y), float(yaw))
        visited = frozenset(
            goal.id for goal in self._scene.goals if self._is_visited(goal)
        )
        return FleetCondition(
            pose=poses,
            energy_J={name: meter.charge_J for name, meter in self._meters.items()},
            rolling_factor={
                name: meter.rolling.factor for name, meter in self._meters.items()
            },
            out_of_service=frozenset(self._out_of_service),
            time_s=now.time_s,
            visited=visited,
            stays=self._stays(visited),
        )

    def _stays(self, visited: Set[str]) -> dict[str, StayUnderWay]:
        """Return the stays of robots in service at goals that miss their visit."""
        goals = [
            goal
            for goal in self._scene.goals
            if goal.dwell_s > 0.0 and goal.id not in visited
        ]
        ways = self._ways()
        for name in self._out_of_service:
            del ways[name]
        return stays_under_way(goals, np.array(self._seen.time_s), ways)

    def _ways(self) -> dict[str, np.ndarray]:
        """Return where each robot was seen so far, shape (n, 2) each."""
        ways = np.stack(self._seen.state, axis=1)[..., :2]
        return dict(zip(self._robots, ways, strict=True))

    def _is_visited(self, goal: Goal) -> bool:
        """Tell whether some robot has been deep inside a goal, for long enough."""
        time_s = np.array(self._seen.time_s)
        return any(
            (goal.region.depth(way) >= VISITED_DEPTH_M).any()
            and first_stay(goal, time_s, way, 0) is not None
            for way in self._ways().values()
        )

    def _entered(self) -> dict[str, tuple[str, ...]]:
        """Return the targets of the tours so far that were really entered."""
        time_s, state = np.array(self._seen.time_s), np.stack(self._seen.state, axis=1)
        tours = self.course.plan.tours
        entered = {}
        for index, name in enumerate(self._robots):
            motion = LoggedMotion(robot=name, time_s=time_s, state=state[index])
            visits = find_visits(self._scene, motion, tours[name])
            entered[name] = tuple(visit.target for visit in visits)
        return entered

    def _tell(
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
        f"{outcome.plan.cost_J / 1000:.1f} kJ in {outcome.plan.makespan_s:.0f} s"
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
