"""The motions of a fleet, side by side, as the kernels see them, and in plans."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mrmg.planning.path_following.coordination import _conflict_kernels
from mrmg.planning.path_following.coordination._motion_kernels import OTHER, Traffic
from mrmg.planning.path_following.tracking import Motion
from mrmg.planning.problem.problem import Problem
from mrmg.plans import Trajectory

CLOSING_SHARE = 1.5
"""How much faster than the reference point at most the middle of a footprint moves."""


class FleetTraffic:
    """The motions of all robots; only those that change are copied."""

    def __init__(self, problem: Problem, horizon: int) -> None:
        """Make room for motions of so many steps."""
        mission = problem.mission
        robots, zones = len(mission.fleet), len(mission.zones.zone)
        top = np.maximum(mission.fleet["limit"][:, 1], -mission.fleet["limit"][:, 0])
        middle = np.hypot(*mission.fleet["middle"].T)
        turning = middle * np.where(
            mission.fleet["turning_radius"] > 0.0,
            top / np.maximum(mission.fleet["turning_radius"], 1e-6),
            mission.fleet["limit"][:, 2],
        )
        speed = CLOSING_SHARE * (top + turning)
        self._problem = problem
        self._closing = (speed[:, None] + speed) * problem.dt_s
        self._noted: list[Motion | None] = [None] * robots
        self._inside = np.zeros((robots, zones, horizon), bool)
        self._traffic = Traffic(
            fleet=mission.fleet,
            pose=np.zeros((robots, horizon + 1, 5)),
            middle=np.zeros((robots, horizon + 1, 2)),
            robot=np.zeros(robots, OTHER),
            busy=np.zeros((zones, horizon), bool),
            end=0,
        )

    def _note(self, motions: Sequence[Motion | None]) -> None:
        mission = self._problem.mission
        for r, motion in enumerate(motions):
            if motion is None or motion is self._noted[r]:
                continue
            count = len(motion.state)
            self._traffic.pose[r, :count] = motion.state
            _conflict_kernels.note_motion(
                mission.fleet, mission.zones, self._traffic, self._inside, r, count
            )
            self._noted[r] = motion

    def around(
        self, r: int, motions: Sequence[Motion | None], above: np.ndarray
    ) -> Traffic:
        """Return the traffic for robot r, which must not meet the robots marked."""
        self._note(motions)
        known = np.array([motion is not None for motion in motions])
        known[r] = False
        hard = above & known
        lasting = self._traffic.robot["last"][known]
        robot = self._traffic.robot.copy()
        robot["closing"] = self._closing[r]
        robot["hard"], robot["soft"] = hard, known & ~hard
        return self._traffic._replace(
            robot=robot,
            busy=self._inside[hard].any(axis=0),
            end=int(lasting.max()) if len(lasting) else 0,
        )

    def conflicts(self, r: int, motions: Sequence[Motion]) -> np.ndarray:
        """Return the step of r's first conflict with each robot, inf for never."""
        self._note(motions)
        fleet = self._problem.mission.fleet
        self._traffic.robot["closing"] = self._closing[r]
        conflict = np.full(len(fleet), np.inf)
        _conflict_kernels.conflicts_of(fleet, self._traffic, self._inside, r, conflict)
        return conflict


def trajectories_of(
    problem: Problem, motions: Sequence[Motion]
) -> tuple[Trajectory, ...]:
    """Return motions as trajectories of one length: who is through stands."""
    steps = max(1, *(len(motion.control) for motion in motions))
    trajectories = []
    for robot, motion in zip(problem.scene.robots, motions, strict=True):
        rest = steps - len(motion.control)
        control = np.pad(motion.control, ((0, rest), (0, 0)))
        state = np.pad(motion.state, ((0, rest), (0, 0)), mode="edge")
        trajectories.append(
            Trajectory(robot=robot.id, dt_s=problem.dt_s, state=state, control=control)
        )
    return tuple(trajectories)
