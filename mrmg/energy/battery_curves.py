"""Battery content of each robot over time, as planned and as driven."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from mrmg.energy.audit import measured_step_energy
from mrmg.energy.metering import (
    LoggedMotion,
    battery_content,
    battery_profile,
    find_visits,
)
from mrmg.plans import Plan, Visit
from mrmg.scene.types import Scene
from mrmg.simulation.log import ExecutionLog


@dataclass(frozen=True, slots=True, kw_only=True)
class BatteryCurve:
    """Battery content of one robot over time.

    Attributes:
        robot: id of the robot.
        time_s: shape (n,).
        energy_J: content at each time, after a recharge, shape (n,).
        visits: of this robot; their `energy_J` is the content on arrival.
    """

    robot: str
    time_s: np.ndarray
    energy_J: np.ndarray
    visits: tuple[Visit, ...]


def planned_curves(scene: Scene, plan: Plan) -> tuple[BatteryCurve, ...]:
    """Return the battery content the plan predicts, one curve per robot."""
    return tuple(
        BatteryCurve(
            robot=trajectory.robot,
            time_s=trajectory.time_s,
            energy_J=plan.content_J[trajectory.robot]
            if plan.content_J
            else battery_profile(scene, trajectory, plan.visits),
            visits=tuple(v for v in plan.visits if v.robot == trajectory.robot),
        )
        for trajectory in plan.trajectories
    )


def measured_curves(
    scene: Scene, plan: Plan, log: ExecutionLog
) -> tuple[BatteryCurve, ...]:
    """Return the battery content by the work of the simulated drives."""
    if log.disturbance is not None:
        scene = log.disturbance.actual_scene(scene)
    curves = []
    for index, (robot, state) in enumerate(zip(log.robots, log.state, strict=True)):
        motion = LoggedMotion(robot=robot, time_s=log.time_s, state=state)
        visits = find_visits(scene, motion, plan.tours.get(robot, ()))
        draw_J = measured_step_energy(scene.robot(robot), log, index).sum(axis=1)
        content_J, arrival_J = battery_content(scene, motion, draw_J, visits)
        curves.append(
            BatteryCurve(
                robot=robot,
                time_s=log.time_s,
                energy_J=content_J,
                visits=tuple(
                    replace(visit, energy_J=energy_J)
                    for visit, energy_J in zip(visits, arrival_J, strict=True)
                ),
            )
        )
    return tuple(curves)


def with_recharge_jumps(curve: BatteryCurve) -> tuple[np.ndarray, np.ndarray]:
    """Return times and contents [J], with the content on arrival at each station."""
    stations = [visit for visit in curve.visits if visit.kind == "station"]
    steps = np.array([visit.step for visit in stations], dtype=int)
    time_s = np.insert(curve.time_s, steps, curve.time_s[steps])
    arrival_J = np.array([visit.energy_J for visit in stations])
    return time_s, np.insert(curve.energy_J, steps, arrival_J)
