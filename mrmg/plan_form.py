"""The form of a plan, which whatever judges or drives it takes for granted.

That is: the robots of the scene, as many steps of one length for each of them, and
finite numbers.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mrmg.errors import UsageError
from mrmg.motion.dynamics import NU, NX
from mrmg.plans import LONGEST_STEP_S, Plan, Trajectory
from mrmg.scene.types import Scene


def require_form(scene: Scene, plan: Plan) -> None:
    """Refuse a plan whose parts do not fit each other or the scene.

    Raises:
        UsageError: naming the first fault.
    """
    for robot, fault in misfits(scene, plan):
        raise UsageError(
            f"the plan is malformed: {f'{robot}: ' if robot else ''}{fault}; "
            "mrmg.verify(scene, plan) lists all that is wrong with it"
        )


def misfits(scene: Scene, plan: Plan) -> Iterator[tuple[str, str]]:
    """Yield what does not fit: the robot, "" for the plan, and what."""
    expected = [robot.id for robot in scene.robots]
    planned = [trajectory.robot for trajectory in plan.trajectories]
    if planned != expected:
        yield "", f"the plan moves robots {planned}, the scene has {expected}"
    if not np.isfinite(plan.dt_s) or plan.dt_s <= 0.0:
        yield "", f"the step length is {plan.dt_s} s, it must be positive"
    elif plan.dt_s > LONGEST_STEP_S:
        yield "", f"the step length is {plan.dt_s} s, more than {LONGEST_STEP_S} s"
    unusable = [item.robot for item in plan.trajectories if not _is_tables(item)]
    for robot in unusable:
        yield robot, "states and controls are no tables of 64-bit floats"
    if unusable:
        return
    steps = sorted({len(trajectory.control) for trajectory in plan.trajectories})
    if len(steps) > 1:
        yield "", f"trajectories have {steps} steps, not one equal number"
    for trajectory in plan.trajectories:
        robot, n = trajectory.robot, len(trajectory.control)
        shapes = (trajectory.state.shape, trajectory.control.shape)
        if shapes != ((n + 1, NX), (n, NU)):
            yield robot, f"states and controls have shapes {shapes}"
        if trajectory.dt_s != plan.dt_s:
            yield robot, f"its step is {trajectory.dt_s} s long"
        if robot not in plan.tours:
            yield robot, "the plan has no tour for it"


def form_faults(scene: Scene, plan: Plan) -> Iterator[tuple[str, str]]:
    """Yield what is wrong with a plan's form, as `misfits`, which come first."""
    faults = [*misfits(scene, plan)]
    yield from faults
    if faults:
        return
    planned = [trajectory.robot for trajectory in plan.trajectories]
    for one in plan.trajectories:
        if len(one.control) == 0:
            yield one.robot, "its trajectory has no steps"
        if not all(np.isfinite(array).all() for array in (one.state, one.control)):
            yield one.robot, "a state or control is not a finite number"
    for robot in sorted({visit.robot for visit in plan.visits} - set(planned)):
        yield robot, "visits are stated but no motion"
    for robot, margins in plan.margins.items():
        if robot not in planned:
            yield robot, "margins are stated but no motion"
        elif not np.isfinite(margins).all() or min(margins) < 0.0:
            yield robot, f"its margins are {margins} m"
    for goal in sorted(set(plan.skipped) - {goal.id for goal in scene.goals}):
        yield "", f"{goal} is left out, and no goal of the scene"
    for passage in plan.narrow:
        stated = (passage.start_s, passage.end_s, passage.margin_m)
        if passage.robot not in planned:
            yield passage.robot, "a passage is stated but no motion"
        elif not np.isfinite(stated).all():
            yield passage.robot, "a passage is not of finite numbers"


def _is_tables(trajectory: Trajectory) -> bool:
    return all(
        array.ndim == 2 and array.dtype.kind == "f" and array.dtype.itemsize == 8
        for array in (trajectory.state, trajectory.control)
    )
