"""Choosing how a fleet comes to rest, so that nobody touches anything on the way.

All robots brake in full, steering held, if that keeps them clear. Else robots in
service may stop along their planned paths instead, all at one rate, later but without
leaving the places they were given.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Set
from dataclasses import dataclass

import numpy as np

from mrmg.plans import Trajectory
from mrmg.scene.robot_model import RobotModel
from mrmg.scene.types import Scene
from mrmg.supervision.braking import brake_to_rest
from mrmg.verification.distances import obstacle_distance, robot_distance

ENOUGH_M = 0.1
"""Clearance with which full braking needs no alternative."""

Motion = tuple[np.ndarray, np.ndarray]
"""States, shape (n + 1, 5), and controls, shape (n, 2)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Departing:
    """A fleet that is to be stopped.

    Attributes:
        scene: obstacles and robots.
        trajectories: the plan in force, in the scene's order of robots.
        step: of the plan, from which on the fleet brakes.
        states: of all robots at that step, shape (5,) each.
        broken: ids of robots that can but brake in full.
    """

    scene: Scene
    trajectories: tuple[Trajectory, ...]
    step: int
    states: Mapping[str, np.ndarray]
    broken: Set[str]

    def motions_to_rest(self) -> dict[str, Motion]:
        """Return how each robot comes to rest; motions differ in length."""
        braked = {item.robot: self._braking(item) for item in self.trajectories}
        clear_m = self._clearance_m(braked)
        if clear_m >= ENOUGH_M:
            return braked
        along = {
            item.robot: braked[item.robot]
            if item.robot in self.broken
            else self._along_plan(item)
            for item in self.trajectories
        }
        return along if self._clearance_m(along) > clear_m else braked

    def _model(self, item: Trajectory) -> RobotModel:
        return self.scene.robot(item.robot).model

    def _braking(self, item: Trajectory) -> Motion:
        first = self.states[item.robot]
        states, controls = brake_to_rest(self._model(item), first, item.dt_s)
        return np.concatenate([first[None], states]), controls

    def _along_plan(self, item: Trajectory) -> Motion:
        """Return the planned motion slowed down to rest at half the braking limit.

        The plan is run at a rate that falls evenly from 1 to 0.
        """
        model, dt_s = self._model(item), item.dt_s
        planned = item.state[self.step :]
        limit_m_s2 = 0.5 * model.planning_share * model.limits.u1_max_m_s2
        slowing_s = max(float(np.abs(planned[:, 3]).max()) / limit_m_s2, dt_s)
        count = math.ceil(slowing_s / dt_s)
        rate = 1.0 - np.arange(count + 1) / count
        plan_s = dt_s * np.cumsum([0.0, *(0.5 * (rate[1:] + rate[:-1]))])
        times_s = dt_s * np.arange(len(planned))
        states = np.stack(
            [np.interp(plan_s, times_s, column) for column in planned.T], axis=1
        )
        states[0] = self.states[item.robot]
        states[:, 3] *= rate
        if model.motion_model == "unicycle":
            states[:, 4] *= rate
        controls = np.diff(states[:, 3:], axis=0) / dt_s
        rest, straighten = brake_to_rest(model, states[-1], dt_s)
        return np.concatenate([states, rest]), np.concatenate([controls, straighten])

    def _clearance_m(self, motions: Mapping[str, Motion]) -> float:
        """Return the least distance of a robot to anything while it comes to rest."""
        robots = self.scene.robots
        longest = max(len(states) for states, _ in motions.values())
        poses = []
        for robot in robots:
            states, _ = motions[robot.id]
            standing = np.repeat(states[-1:], longest - len(states), axis=0)
            poses.append(np.concatenate([states, standing]))
        distances_m = [
            obstacle_distance(self.scene, robot, own).min()
            for robot, own in zip(robots, poses, strict=True)
        ]
        if len(robots) > 1:
            distances_m.append(robot_distance(robots, poses).min())
        return float(min(distances_m))
