"""What was seen of a driving fleet, tick by tick, and which visits that amounts to."""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set

import numpy as np

from mrmg.energy.metering import TimedStates, find_visits
from mrmg.energy.visits import first_stay
from mrmg.scene.types import Goal, Scene
from mrmg.simulation.supervision import Observation
from mrmg.supervision.metering import RobotMeter
from mrmg.supervision.stays import OngoingStay, seen_at, stays_under_way


class History:
    """The record of a drive as seen by its supervisor; it begins with the start."""

    def __init__(self, scene: Scene) -> None:
        """Begin with robots at rest at their starts."""
        self._scene = scene
        self._robots = [robot.id for robot in scene.robots]
        self._time_s = [0.0]
        self._state = [np.array([(*robot.pose, 0.0, 0.0) for robot in scene.robots])]
        self._metered = 0

    def add(self, now: Observation) -> None:
        """Record a tick."""
        self._time_s.append(now.time_s)
        self._state.append(now.state)
        self._work_J = now.work_J

    @property
    def unmetered_s(self) -> float:
        """Time since the meters were last fed [s]."""
        return self._time_s[-1] - self._time_s[self._metered]

    def feed(self, meters: Mapping[str, RobotMeter]) -> None:
        """Feed the meters, in the order of robots, with ticks they have not seen."""
        start, self._metered = self._metered, len(self._time_s) - 1
        if start == self._metered:
            return
        time_s = np.array(self._time_s[start:])
        state, work_J = np.stack(self._state[start:]), self._work_J()[start:]
        for index, meter in enumerate(meters.values()):
            meter.add(time_s, state[:, index], work_J[:, index])

    def visited(self) -> frozenset[str]:
        """Return the ids of goals that some robot was deep inside for long enough."""
        return frozenset(
            goal.id for goal in self._scene.goals if self._is_visited(goal)
        )

    def _is_visited(self, goal: Goal) -> bool:
        time_s = np.array(self._time_s)
        return any(
            seen_at(goal, path).any() and first_stay(goal, time_s, path, 0) is not None
            for path in self._paths().values()
        )

    def stays(
        self, visited: Set[str], out_of_service: Set[str]
    ) -> dict[str, OngoingStay]:
        """Return the stays of robots in service at goals without a visit, by goal."""
        goals = [
            goal
            for goal in self._scene.goals
            if goal.dwell_s > 0.0 and goal.id not in visited
        ]
        paths = self._paths()
        for name in out_of_service:
            del paths[name]
        return stays_under_way(goals, np.array(self._time_s), paths)

    def entered(self, tours: Mapping[str, Sequence[str]]) -> dict[str, tuple[str, ...]]:
        """Return the targets of each robot's tour that it has really visited."""
        time_s, state = np.array(self._time_s), np.stack(self._state, axis=1)
        entered = {}
        for index, name in enumerate(self._robots):
            motion = TimedStates(robot=name, time_s=time_s, state=state[index])
            visits = find_visits(self._scene, motion, tours[name])
            entered[name] = tuple(visit.target for visit in visits)
        return entered

    def _paths(self) -> dict[str, np.ndarray]:
        """Return the poses in which each robot was seen, shape (n, 3) each."""
        paths = np.stack(self._state, axis=1)[..., :3]
        return dict(zip(self._robots, paths, strict=True))
