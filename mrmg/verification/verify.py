"""Judge a plan by the scene alone, with nothing taken from the planner.

The controls are replayed through the plain Python form of the motion model, contacts
are decided by exact polygons at all times, between steps too, and energies are
recomputed.
"""

from __future__ import annotations

import numpy as np

from mrmg.errors import require_types
from mrmg.plan_form import form_faults
from mrmg.plans import Plan
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
    malformed = [_malformed(*fault) for fault in form_faults(scene, plan)]
    malformed = malformed or _check_coarseness(scene, plan)
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
