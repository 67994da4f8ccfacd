"""Driving a plan as the arguments of its run want it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

from mrmg.mission import Plan
from mrmg.run_arguments import RunArguments
from mrmg.scene.types import Scene

if TYPE_CHECKING:
    from mrmg.mission_control import Drive


def checked_drive(scene: Scene, arguments: RunArguments) -> RunArguments:
    """Return `arguments` with the drive's in the one form that equal drives share.

    Raises:
        UsageError, FileError: if the controller, a fault or a disturbance is unknown.
    """
    from mrmg.execution.controller import controller_maker
    from mrmg.execution.disturbance_spec import written_out
    from mrmg.mission_control.faults import checked_faults

    controller_maker(arguments.controller)
    disturb = None if arguments.disturb is None else written_out(arguments.disturb)
    faults = tuple(str(fault) for fault in checked_faults(scene, arguments.faults))
    return replace(arguments, disturb=disturb, faults=faults)


def drive(
    scene: Scene,
    plan: Plan,
    arguments: RunArguments,
    on_progress: Callable[[float, str], None] | None = None,
) -> Drive:
    """Drive a plan in MuJoCo as the arguments of its run want it."""
    from mrmg.execution.disturbance_spec import parse_disturbance
    from mrmg.mission_control import drive_mission
    from mrmg.planning import profile_params

    disturbance = None
    if arguments.disturb is not None:
        ranges = parse_disturbance(arguments.disturb)
        ids = [robot.id for robot in scene.robots]
        disturbance = ranges.draw(arguments.disturb_seed, ids)
    return drive_mission(
        scene,
        plan,
        controller=arguments.controller,
        disturbance=disturbance,
        replan=arguments.replan,
        faults=arguments.faults,
        seed=arguments.seed,
        planner=profile_params(),
        on_progress=on_progress,
    )
