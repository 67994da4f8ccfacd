"""Judge a plan by the scene alone, with nothing taken from the planner.

The controls are replayed through the plain Python form of the motion model, contacts
are decided by exact polygons at all times, between steps too, and energies are
recomputed.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mrmg.errors import require_types
from mrmg.motion.dynamics import NU, NX
from mrmg.plans import LONGEST_STEP_S, Plan, Trajectory
from mrmg.scene.types import Scene
from mrmg.verification.contact_rules import check_obstacles, check_robots
from mrmg.verification.margin_rules import check_margins
from mrmg.verification.mission_rules import check_mission
from mrmg.verification.motion_rules import check_motion
from mrmg.verification.swept_footprint import SweptFootprint
from mrmg.verification.verdict import Verdict, Violation, ViolationKind

COARSEST_STEP_M = 1.0
"""How far a footprint may at most stray from its chord within one step."""

LARGEST_STATE = 1e9
"""Largest magnitude of a state's component [SI] that geometry can be trusted with."""


def verify(scene: Scene, plan: Plan) -> Verdict:
    """Return the verdict on `plan`: every violation found, and certified clearances.

    Args:
        scene: what the plan must hold in.
        plan: from any planner. A malformed one (other robots, unequal lengths, numbers
            that are not finite) is judged by that alone.

    Raises:
        SceneError: if the scene has numbers that are not finite.
    """
    require_types((scene, Scene), (plan, Plan))
    mismatch = _check_digest(scene, plan)
    malformed = [*_check_form(scene, plan)] or _check_coarseness(scene, plan)
    if malformed:
        return Verdict(
            ok=False,
            violations=(*mismatch, *malformed),
            min_obstacle_clearance_m=None,
            min_robot_distance_m=None,
        )
    own = [(scene.robot(item.robot), item) for item in plan.trajectories]
    motion = [found for pair in own for found in check_motion(*pair)]
    space = [found for pair in own for found in check_obstacles(scene, *pair)]
    pairs = check_robots(scene, plan.trajectories)
    contacts = [found for check in (*space, *pairs) for found in check.violations]
    violations = (
        *mismatch,
        *motion,
        *contacts,
        *check_margins(scene, plan),
        *check_mission(scene, plan),
    )
    return Verdict(
        ok=not violations,
        violations=violations,
        min_obstacle_clearance_m=min(check.clearance_m for check in space),
        min_robot_distance_m=min((check.clearance_m for check in pairs), default=None),
        skipped=tuple(plan.skipped),
    )


def _check_digest(scene: Scene, plan: Plan) -> list[Violation]:
    if scene.is_named(plan.scene_digest):
        return []
    message = (
        f"the plan was made for scene {plan.scene_name} ({plan.scene_digest}), "
        f"this is {scene.name} ({scene.digest}); plan again"
    )
    return [Violation(kind=ViolationKind.SCENE_MISMATCH, message=message)]


def _check_form(scene: Scene, plan: Plan) -> Iterator[Violation]:
    """Check what all other rules take for granted."""
    expected = [robot.id for robot in scene.robots]
    planned = [trajectory.robot for trajectory in plan.trajectories]
    if planned != expected:
        yield _malformed(
            "", f"the plan moves robots {planned}, the scene has {expected}"
        )
    if not np.isfinite(plan.dt_s) or plan.dt_s <= 0.0:
        yield _malformed("", f"the step length is {plan.dt_s} s, it must be positive")
    elif plan.dt_s > LONGEST_STEP_S:
        text = f"the step length is {plan.dt_s} s, more than {LONGEST_STEP_S} s"
        yield _malformed("", text)
    unusable = [item.robot for item in plan.trajectories if not _is_tables(item)]
    for robot in unusable:
        yield _malformed(robot, "states and controls are no tables of 64-bit floats")
    if unusable:
        return
    steps = {len(trajectory.control) for trajectory in plan.trajectories}
    if len(steps) > 1 or 0 in steps:
        counts = sorted(steps)
        yield _malformed("", f"trajectories have {counts} steps, not one equal number")
    for trajectory in plan.trajectories:
        robot, n = trajectory.robot, len(trajectory.control)
        shapes = (trajectory.state.shape, trajectory.control.shape)
        if shapes != ((n + 1, NX), (n, NU)):
            yield _malformed(robot, f"states and controls have shapes {shapes}")
        elif not all(
            np.isfinite(a).all() for a in (trajectory.state, trajectory.control)
        ):
            yield _malformed(robot, "a state or control is not a finite number")
        if trajectory.dt_s != plan.dt_s:
            yield _malformed(robot, f"its step is {trajectory.dt_s} s long")
        if robot not in plan.tours:
            yield _malformed(robot, "the plan has no tour for it")
    for robot in sorted({visit.robot for visit in plan.visits} - set(planned)):
        yield _malformed(robot, "visits are stated but no motion")
    for robot, margins in plan.margins.items():
        if robot not in planned:
            yield _malformed(robot, "margins are stated but no motion")
        elif not np.isfinite(margins).all() or min(margins) < 0.0:
            yield _malformed(robot, f"its margins are {margins} m")
    for goal in sorted(set(plan.skipped) - {goal.id for goal in scene.goals}):
        yield _malformed("", f"{goal} is left out, and no goal of the scene")
    for passage in plan.narrow:
        stated = (passage.start_s, passage.end_s, passage.margin_m)
        if passage.robot not in planned:
            yield _malformed(passage.robot, "a passage is stated but no motion")
        elif not np.isfinite(stated).all():
            yield _malformed(passage.robot, "a passage is not of finite numbers")


def _is_tables(trajectory: Trajectory) -> bool:
    return all(
        array.ndim == 2 and array.dtype.kind == "f" and array.dtype.itemsize == 8
        for array in (trajectory.state, trajectory.control)
    )


def _check_coarseness(scene: Scene, plan: Plan) -> list[Violation]:
    """Check that single steps are short enough for their motion to be bounded.

    At a robot's limits a footprint strays centimetres from its chord in one step. A
    plan that may stray a metre is nonsense, and proving it clear would take forever.
    """
    violations = []
    for trajectory in plan.trajectories:
        model = scene.robot(trajectory.robot).model
        with np.errstate(over="ignore", invalid="ignore"):
            footprint = SweptFootprint(model, trajectory)
            steps = np.arange(len(trajectory.control))
            straying_m = footprint.sagitta(steps, np.full(len(steps), plan.dt_s))
        sizes = np.abs(trajectory.state[:-1]).max(axis=1)
        bounded = (straying_m <= COARSEST_STEP_M) & (sizes <= LARGEST_STATE)
        if not bounded.all():
            text = f"step {int(bounded.argmin())} moves too wildly to be checked"
            violations.append(_malformed(trajectory.robot, text))
    return violations


def _malformed(robot: str, text: str) -> Violation:
    return Violation(
        kind=ViolationKind.MALFORMED,
        robot=robot,
        message=f"{robot}: {text}" if robot else text,
    )
