"""The plan as a function of continuous plan time, for all robots at once."""

from __future__ import annotations

import numpy as np

from mrmg.motion.dynamics import DERIVATIVES, NX, SPEED_STATES
from mrmg.plans import Plan, Trajectory
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
        pieces = [
            _pieces(robot.model, plan.trajectory(robot.id)) for robot in scene.robots
        ]
        self._is_speed = speed_states(scene)
        self._steps = pieces[0].shape[1]
        self._dt_s = plan.dt_s
        self.duration_s = plan.makespan_s
        self._cubics = np.stack(pieces, axis=2).reshape(4, self._steps, -1)

    def at(self, plan_time_s: np.ndarray) -> np.ndarray:
        """Return the states at the given plan times, shape (n,) -> (n, R, 5)."""
        time_s = np.minimum(plan_time_s, self.duration_s)
        piece = np.minimum((time_s / self._dt_s).astype(int), self._steps - 1)
        since_s = (time_s - self._dt_s * piece)[:, None]
        third, second, first, start = self._cubics[:, piece]
        states = ((third * since_s + second) * since_s + first) * since_s + start
        return np.asarray(states.reshape(len(time_s), -1, NX))

    def at_once(self, plan_time_s: float) -> np.ndarray:
        """Return the states at one plan time, shape (R, 5)."""
        return np.asarray(self.at(np.array([plan_time_s]))[0])

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


def _pieces(model: RobotModel, item: Trajectory) -> np.ndarray:
    """Return the cubics of one trajectory, highest power first, shape (4, n, 5)."""
    derivative = DERIVATIVES[model.motion_model](np.sin, np.cos, np.tan)
    # A plan without steps is one step of standing still.
    state = np.repeat(item.state, 2, axis=0) if len(item.state) == 1 else item.state
    dt_s = item.dt_s
    zero = np.zeros(len(state))
    slope = np.stack(
        derivative(
            state[:, 2], state[:, 3], state[:, 4], zero, zero, model.wheelbase_m
        ),
        axis=1,
    )
    start, chord = state[:-1], np.diff(state, axis=0) / dt_s
    before, after = slope[:-1], slope[1:]
    cubic = np.stack(
        [
            (before + after - 2.0 * chord) / dt_s**2,
            (3.0 * chord - 2.0 * before - after) / dt_s,
            before,
            start,
        ]
    )
    cubic[:2, :, 3:] = 0.0
    cubic[2, :, 3:] = chord[:, 3:]
    return cubic
