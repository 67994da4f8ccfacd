"""Rules of one robot's motion: where it starts, how it moves, within which limits."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from mrmg.columns import state_columns
from mrmg.compared import compared
from mrmg.motion.dynamics import DERIVATIVES, SPEED_STATES
from mrmg.motion.user_motion import plain_step
from mrmg.plans import Trajectory
from mrmg.scene.robot_model import RobotModel
from mrmg.scene.types import Robot
from mrmg.verification.verdict import Violation, ViolationKind

REST_TOLERANCE = 1e-6
"""Largest speed [m/s] or yaw rate [rad/s] of a robot that counts as resting."""

LIMIT_TOLERANCE = 1e-9
"""Rounding that is forgiven at a limit, in the unit of the component."""

USER_TOLERANCE = 1e-9
"""By how much a user's compiled motion may differ from its plain Python form."""


def check_motion(robot: Robot, trajectory: Trajectory) -> list[Violation]:
    """Return every broken rule of start, end, dynamics and limits."""
    return [
        *_check_start(robot, trajectory),
        *_check_final_rest(robot, trajectory),
        *_check_finish(robot, trajectory),
        *_check_dynamics(robot.model, trajectory),
        *_check_limits(robot.model, trajectory),
    ]


def worst_of_runs(amount: np.ndarray, broken: np.ndarray) -> list[int]:
    """Return the index of the largest amount in each run of consecutive broken ones."""
    indices = np.flatnonzero(broken)
    runs = np.split(indices, np.flatnonzero(np.diff(indices) > 1) + 1)
    return [int(run[amount[run].argmax()]) for run in runs if len(run)]


def violation_at(
    trajectory: Trajectory,
    step: int,
    kind: ViolationKind,
    message: str,
    *,
    amount: float,
    other: str = "",
) -> Violation:
    """Return a violation at one state of a trajectory."""
    x_m, y_m = trajectory.state[step, :2].tolist()
    return Violation(
        kind=kind,
        robot=trajectory.robot,
        other=other,
        time_s=step * trajectory.dt_s,
        x_m=x_m,
        y_m=y_m,
        amount=amount,
        message=f"{trajectory.robot}: {message}",
    )


def _check_start(robot: Robot, trajectory: Trajectory) -> Iterator[Violation]:
    expected = np.array([*robot.pose, 0.0, 0.0])
    error = np.abs(trajectory.state[0] - expected)
    worst = int(error.argmax())
    if error[worst] == 0.0:
        return
    name = _components(robot.model)[worst]
    found, wanted = compared(trajectory.state[0, worst], expected[worst], 3)
    message = f"the plan starts with {name} = {found}, the scene with {wanted}"
    amount = float(error[worst])
    yield violation_at(trajectory, 0, ViolationKind.START, message, amount=amount)


def _check_final_rest(robot: Robot, trajectory: Trajectory) -> Iterator[Violation]:
    last = len(trajectory.state) - 1
    for column in SPEED_STATES.get(robot.model.motion_model, (3, 4)):
        value = float(trajectory.state[last, column])
        if abs(value) > REST_TOLERANCE:
            name = _components(robot.model)[column]
            message = f"the plan ends in motion, {name} = {value:.3g}"
            kind = ViolationKind.FINAL_REST
            yield violation_at(trajectory, last, kind, message, amount=abs(value))


def _check_finish(robot: Robot, trajectory: Trajectory) -> Iterator[Violation]:
    """Check that the robot ends in its finish, with the required heading."""
    if robot.finish is None:
        return
    last = len(trajectory.state) - 1
    kind = ViolationKind.FINISH
    x, y, yaw = trajectory.state[-1, :3]
    missed_m = -float(robot.finish.region.depth(np.array([[x, y]]))[0])
    if missed_m > 0.0:
        message = f"ends {missed_m:.3g} m outside its finish"
        yield violation_at(trajectory, last, kind, message, amount=missed_m)
    if robot.finish.heading_rad is not None:
        off = abs(math.remainder(yaw - robot.finish.heading_rad, math.tau))
        excess = off - robot.finish.heading_tolerance_rad
        if excess > 0.0:
            found, most = compared(off, robot.finish.heading_tolerance_rad, 2)
            message = f"ends {found} rad off its finish's heading, {most} are allowed"
            yield violation_at(trajectory, last, kind, message, amount=excess)


def _components(model: RobotModel) -> tuple[str, ...]:
    """Return the names of the state's components, without their units."""
    return tuple(name.split("_")[0] for name in state_columns(model.motion_model))


def replay(model: RobotModel, trajectory: Trajectory) -> np.ndarray:
    """Return the state after each step, from the state before it, shape (n, 5).

    Runs the plain Python form of the motion model, one step at a time, so that a valid
    plan is met bit for bit and a defect stays in its own step. A step that is like the
    one before it, as of a robot that stands, is not run again.
    """
    step = plain_step(model)
    length_m, dt_s = float(model.wheelbase_m), float(trajectory.dt_s)
    changes = changing_steps(trajectory.state[:-1], trajectory.control)
    states, controls = (
        rows[changes].tolist() for rows in (trajectory.state[:-1], trajectory.control)
    )
    found = [
        step(tuple(state), tuple(control), length_m, dt_s)
        for state, control in zip(states, controls, strict=True)
    ]
    return np.asarray(np.array(found).reshape(-1, 5)[np.cumsum(changes) - 1])


def changing_steps(*columns: np.ndarray) -> np.ndarray:
    """Return which steps are not like the one before them, shape (n, k) -> (n,)."""
    rows = np.concatenate(columns, axis=1)
    differs = (rows[1:] != rows[:-1]).any(axis=1)
    return np.asarray(np.concatenate([[True], differs])[: len(rows)])


def _check_dynamics(model: RobotModel, trajectory: Trajectory) -> list[Violation]:
    defect = np.abs(replay(model, trajectory) - trajectory.state[1:]).max(axis=1)
    tolerance = 0.0 if model.motion_model in DERIVATIVES else USER_TOLERANCE
    return [
        violation_at(
            trajectory,
            step + 1,
            ViolationKind.DYNAMICS,
            f"the controls of step {step} do not lead to the next state, "
            f"which is {defect[step]:.3g} off",
            amount=float(defect[step]),
        )
        for step in worst_of_runs(defect, defect > tolerance)
    ]


def _check_limits(model: RobotModel, trajectory: Trajectory) -> list[Violation]:
    limits = model.limits
    v, w = trajectory.state[:, 3], trajectory.state[:, 4]
    u1, u2 = np.abs(trajectory.control).T
    name = _components(model)[4]
    of_states = (
        ("v", v, v - limits.v_max_m_s, limits.v_max_m_s),
        ("v", v, limits.v_min_m_s - v, limits.v_min_m_s),
        (f"|{name}|", np.abs(w), np.abs(w) - limits.w_max, limits.w_max),
    )
    of_controls = (
        ("|u1|", u1, u1 - limits.u1_max_m_s2, limits.u1_max_m_s2),
        ("|u2|", u2, u2 - limits.u2_max, limits.u2_max),
    )
    rules = {
        ViolationKind.STATE_LIMIT: of_states,
        ViolationKind.CONTROL_LIMIT: of_controls,
    }
    return [
        violation_at(
            trajectory,
            step,
            kind,
            "{} is {}, the limit is {}".format(name, *compared(value[step], limit, 3)),
            amount=float(excess[step]),
        )
        for kind, own in rules.items()
        for name, value, excess, limit in own
        for step in worst_of_runs(excess, excess > LIMIT_TOLERANCE)
    ]
