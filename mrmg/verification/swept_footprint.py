"""Where a robot's footprint is at any instant of a planned motion, and in between.

Inside step i the motion is t -> rk4(state_i, control_i, t), which meets state i + 1 at
the step's end. Over an interval of length h, a point whose acceleration is at most A
strays from the straight line between its end positions by at most A h^2 / 8, so that
the hull of the footprint at both ends, grown by that sagitta, holds all of the motion.
"""

from __future__ import annotations

import numpy as np

from mrmg.motion.dynamics import DERIVATIVES, rk4_step
from mrmg.motion.user_motion import motion_of
from mrmg.plans import Trajectory
from mrmg.scene.robot_model import RobotModel

# Covers the integrator's own error, which the bound on the exact motion leaves out:
# some 1e-7 m at a sagitta of 1e-3 m, and of higher order in the step than the sagitta.
_SAGITTA_FACTOR = 1.01
_SAGITTA_SLACK_M = 1e-9

SAMPLES = 8
"""Parts of a step at whose ends a user's motion is looked at."""


class SweptFootprint:
    """The moving footprint of one robot on a planned trajectory.

    Attributes:
        model: shape and motion model.
        dt_s: length of a step.
        state: at the start of each step, shape (n, 5).
        control: held over each step, shape (n, 2).
        acceleration_m_s2: bound for any point of the footprint by step, shape (n,).
    """

    def __init__(self, model: RobotModel, trajectory: Trajectory) -> None:
        self.model, self.dt_s = model, trajectory.dt_s
        self.state, self.control = trajectory.state[:-1], trajectory.control
        self.acceleration_m_s2 = _acceleration_bound(model, trajectory)
        self._chord_m = np.hypot(*np.diff(trajectory.state[:, :2], axis=0).T)

    @property
    def reach_m(self) -> float:
        """Distance from the steps' positions within which the footprint stays [m]."""
        return self.model.circumscribed_radius_m + float(self.travel_m.max(initial=0.0))

    @property
    def travel_m(self) -> np.ndarray:
        """How far the reference point gets in each step at most [m], shape (n,)."""
        if self.model.motion_model not in DERIVATIVES:
            steps = np.arange(len(self.state))
            straying_m = self.sagitta(steps, np.full(len(steps), self.dt_s))
            return np.asarray(self._chord_m + straying_m)
        after = np.abs(self.state[:, 3] + self.dt_s * self.control[:, 0])
        return np.asarray(np.maximum(np.abs(self.state[:, 3]), after) * self.dt_s)

    def states_at(self, step: np.ndarray, time_s: np.ndarray) -> np.ndarray:
        """Return the states `time_s` after the start of each step, shape (k, 5)."""
        return _states_after(self.model, self.state[step], self.control[step], time_s)

    def corners_at(self, step: np.ndarray, time_s: np.ndarray) -> np.ndarray:
        """Return the footprint's corners at those instants [m], shape (k, m, 2)."""
        return self.model.footprint_at(self.states_at(step, time_s))

    def sagitta(self, step: np.ndarray, duration_s: np.ndarray) -> np.ndarray:
        """Return how far any point strays from its chord [m], shape (k,)."""
        straying = self.acceleration_m_s2[step] * duration_s**2 / 8.0
        return np.asarray(_SAGITTA_FACTOR * straying + _SAGITTA_SLACK_M)


def _states_after(
    model: RobotModel, state: np.ndarray, control: np.ndarray, time_s: np.ndarray
) -> np.ndarray:
    """Return the states after given times under held controls, shape (k, 5)."""
    if model.motion_model in DERIVATIVES:
        advance = rk4_step(DERIVATIVES[model.motion_model](np.sin, np.cos, np.tan))
        length_m = model.wheelbase_m
        return np.stack(advance(state.T, control.T, length_m, time_s), axis=-1)
    motion = motion_of(model)
    return np.array(
        [
            motion.step(tuple(before), tuple(held), model.wheelbase_m, duration)
            for before, held, duration in zip(
                state.tolist(), control.tolist(), np.asarray(time_s).tolist(),
                strict=True,
            )
        ]
    ).reshape(-1, 5)  # fmt: skip


def _acceleration_bound(model: RobotModel, trajectory: Trajectory) -> np.ndarray:
    """Bound |p''| of all footprint points p = r + R(theta) b in each step, shape (n,).

    |p''| <= |u1| + |v theta'| + |b| (|theta''| + theta'^2), each factor at its largest
    in the step: v and w are linear in time, so their magnitudes peak at the ends. Of a
    user's motion nothing is known but what it does: see `_sampled_acceleration`.
    """
    if model.motion_model not in DERIVATIVES:
        return _sampled_acceleration(model, trajectory)
    size = np.abs(trajectory.state[:, 3:])
    speed, w = np.maximum(size[:-1], size[1:]).T
    u1, u2 = np.abs(trajectory.control).T
    yaw_rate, yaw_acceleration = w, u2
    if model.motion_model == "car":
        tan = np.tan(w)
        yaw_rate = speed * tan / model.wheelbase_m
        yaw_acceleration = (u1 * tan + speed * u2 * (1.0 + tan**2)) / model.wheelbase_m
    reach = model.circumscribed_radius_m
    turning = reach * (yaw_acceleration + yaw_rate**2)
    return np.asarray(u1 + speed * yaw_rate + turning)


def _sampled_acceleration(model: RobotModel, trajectory: Trajectory) -> np.ndarray:
    """Return the largest |p''| of the corners at instants of each step, with a margin.

    An estimate and no bound: second differences over a 1/SAMPLES of the step.
    """
    state, control = trajectory.state[:-1], trajectory.control
    interval_s = trajectory.dt_s / SAMPLES
    corners = np.stack(
        [
            model.footprint_at(
                _states_after(
                    model, state, control, np.full(len(state), i * interval_s)
                )
            )
            for i in range(SAMPLES + 1)
        ]
    )
    second = np.diff(corners, 2, axis=0) / interval_s**2
    return np.asarray(1.5 * np.hypot(*np.moveaxis(second, -1, 0)).max(axis=(0, 2)))
