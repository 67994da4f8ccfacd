"""The plan as a function of continuous plan time, for all robots at once."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import PPoly

from mrmg.motion.dynamics import DERIVATIVES, NX, SPEED_STATES
from mrmg.plans import Plan
from mrmg.scene.robot_model import RobotModel
from mrmg.scene.types import Scene

STANDSTILL_M_S = 1e-3
"""Planned speed below which a robot waits; sums of controls leave rounding errors."""


class FleetReference:
    """States of the fleet's plan at any plan time; at rest after its end.

    Between the states of the plan v and psi are linear, as their controls are held, and
    x, y, theta are the cubics through both ends with the motion model's slopes: within
    0.1 mm of the exact motion at steps of 0.1 s.

    Attributes:
        duration_s: plan time of the last state.
    """

    def __init__(self, scene: Scene, plan: Plan) -> None:
        """Interpolate the trajectories of `plan`, in the scene's order of robots."""
        items = [plan.trajectory(robot.id) for robot in scene.robots]
        state = np.stack([item.state for item in items], axis=1)
        # A plan without steps is one step of standing still.
        state = np.repeat(state, 2, axis=0) if len(state) == 1 else state
        each = zip(scene.robots, state.swapaxes(0, 1), strict=True)
        slope = np.stack([_slope(robot.model, own) for robot, own in each], axis=1)
        chord, before, after = np.diff(state, axis=0) / plan.dt_s, slope[:-1], slope[1:]
        # Not by `CubicHermiteSpline`, which refuses states that are no numbers.
        third = (before + after - 2.0 * chord) / plan.dt_s**2
        second = (3.0 * chord - 2.0 * before - after) / plan.dt_s
        cubics = np.stack([third, second, before, state[:-1]])
        cubics[:2, ..., 3:] = 0.0
        cubics[2, ..., 3:] = chord[..., 3:]
        self._states = PPoly(cubics, plan.dt_s * np.arange(len(state)))
        self._is_speed = speed_states(scene)
        self.duration_s = plan.makespan_s

    def at(self, plan_time_s: float | np.ndarray) -> np.ndarray:
        """Return the states at one plan time, shape (R, 5), or at n, (n, R, 5)."""
        return np.asarray(self._states(np.minimum(plan_time_s, self.duration_s)))

    def paced(
        self, clock_s: float, rate: float, period_s: float, count: int
    ) -> np.ndarray:
        """Return `count` states `period_s` of real time apart, shape (count, R, 5).

        The plan is run at `rate` times its speed from `clock_s`, so that speeds are
        multiplied by it.
        """
        states = self.at(clock_s + rate * period_s * np.arange(count))
        return np.where(self._is_speed, rate * states, states)


def speed_states(scene: Scene) -> np.ndarray:
    """Return which states of which robot are speeds, shape (R, 5)."""
    return np.array(
        [
            np.isin(np.arange(NX), SPEED_STATES[robot.model.motion_model])
            for robot in scene.robots
        ]
    )


def _slope(model: RobotModel, state: np.ndarray) -> np.ndarray:
    """Return how states change while the controls are zero, both of shape (n, 5)."""
    derivative = DERIVATIVES[model.motion_model](np.sin, np.cos, np.tan)
    zero = np.zeros(len(state))
    moved = derivative(*state.T[2:], zero, zero, model.wheelbase_m)
    return np.stack(moved, axis=1)
