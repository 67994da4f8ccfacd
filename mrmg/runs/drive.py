"""Driving a plan as the arguments of its run want it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

from mrmg.plans import Plan
from mrmg.runs.arguments import RunArguments
from mrmg.scene.margins import STATES_NONE, margins_from
from mrmg.scene.types import Scene

if TYPE_CHECKING:
    from mrmg.supervision.driving import Drive


def checked_drive(scene: Scene, arguments: RunArguments) -> RunArguments:
    """Return `arguments` with the drive's in the one form that equal drives share.

    Raises:
        UsageError, FileError: if the controller, a fault or a disturbance is unknown.
    """
    from mrmg.simulation.controller import controller_maker
    from mrmg.simulation.disturbance_spec import written_out
    from mrmg.supervision.faults import checked_faults

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
    from mrmg.planning import profile_params
    from mrmg.simulation.disturbance_spec import parse_disturbance
    from mrmg.supervision.driving import drive_mission

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
        plant=arguments.plant,
        replan=arguments.replan,
        faults=arguments.faults,
        seed=arguments.seed,
        planner=profile_params(margins=margins_from(arguments.margins or STATES_NONE)),
        on_progress=on_progress,
    )
