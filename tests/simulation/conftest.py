"""Hand-made scenes and plans for the tests of the execution, as one fixture."""

from __future__ import annotations

import math
from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from mrmg.energy.ledger import EnergyLedger
from mrmg.energy.metering import step_energy_parts
from mrmg.motion.dynamics import DERIVATIVES, rk4_step
from mrmg.plans import Plan, Trajectory
from mrmg.scene.loading import scene_from_document
from mrmg.scene.types import Robot, Scene

DT_S = 0.1


def open_ground(
    poses: list[tuple[float, float, float]],
    half_m: float = 60.0,
    models: Sequence[str] = ("car",),
    **parts: Any,
) -> Scene:
    """A square of plain ground with robots r1, r2, ... at `poses` and further parts.

    The last of `models` goes for all robots that follow.
    """
    kinds = [*models, *[models[-1]] * len(poses)]
    document = {
        "format": 1,
        "name": "open ground",
        "bounds": [-half_m, -half_m, half_m, half_m],
        "robots": [
            {"id": f"r{index + 1}", "model": kind, "pose": list(pose)}
            for index, (kind, pose) in enumerate(zip(kinds, poses, strict=False))
        ],
        **parts,
    }
    return scene_from_document(document, source="test", base=None)


def rolled_out(robot: Robot, control: np.ndarray) -> Trajectory:
    """The trajectory of held controls, shape (n, 2), from rest at the start pose."""
    derivative = DERIVATIVES[robot.model.motion_model](math.sin, math.cos, math.tan)
    step = rk4_step(derivative)
    state = [(*robot.pose, 0.0, 0.0)]
    for u1, u2 in control:
        state.append(step(state[-1], (u1, u2), robot.model.wheelbase_m, DT_S))
    return Trajectory(
        robot=robot.id, dt_s=DT_S, state=np.array(state), control=np.array(control)
    )


def plan_of(scene: Scene, controls: list[np.ndarray]) -> Plan:
    """A plan that holds the given controls, one array a robot, all of one length."""
    return Plan(
        scene_name=scene.name,
        scene_digest=scene.digest,
        seed=0,
        profile="test",
        parameters_digest="",
        versions={},
        dt_s=DT_S,
        trajectories=tuple(
            rolled_out(robot, control)
            for robot, control in zip(scene.robots, controls, strict=True)
        ),
        tours={robot.id: () for robot in scene.robots},
        visits=(),
        ledger=EnergyLedger(()),
    )


def planned_J(scene: Scene, plan: Plan, robot: str) -> float:
    """The energy the model predicts for one robot of a plan."""
    return float(step_energy_parts(scene, plan.trajectory(robot)).sum())


def bang_bang(scene: Scene, robot: str, seconds: float, seed: int) -> np.ndarray:
    """Random controls as the planner makes them: at 85 % of the limits, held 0.3-1.5 s.

    Speeds reach both bounds and cross zero; steering, or turning, wanders over its
    whole range; the last seconds bring the robot to rest with straight wheels.
    """
    model = scene.robot(robot).model
    limits = model.limits.scaled(model.planning_share)
    rng = np.random.default_rng([seed, *robot.encode()])
    control: list[tuple[float, float]] = []
    v = psi = wanted_v = wanted_psi = 0.0
    hold = 0
    steps = round(seconds / DT_S)
    for index in range(steps):
        stopping = index >= steps - 40
        if hold == 0:
            hold = int(rng.integers(3, 16))
            wanted_v = rng.choice(
                [limits.v_min_m_s, 0.5, limits.v_max_m_s, limits.v_max_m_s]
            )
            wanted_psi = rng.uniform(-1, 1) * limits.w_max
        hold -= 1
        if stopping:
            wanted_v = wanted_psi = 0.0
        u1 = np.clip((wanted_v - v) / DT_S, -limits.u1_max_m_s2, limits.u1_max_m_s2)
        u2 = np.clip((wanted_psi - psi) / DT_S, -limits.u2_max, limits.u2_max)
        control.append((float(u1), float(u2)))
        v, psi = v + DT_S * u1, psi + DT_S * u2
    return np.array(control)


def straight(seconds: float, speed: float, acceleration: float = 1.0) -> np.ndarray:
    """Speed up, keep `speed`, slow down to rest; wheels straight."""
    ramp = round(speed / acceleration / DT_S)
    steps = round(seconds / DT_S)
    u1 = np.zeros(steps)
    u1[:ramp], u1[steps - ramp :] = acceleration, -acceleration
    return np.stack([u1, np.zeros(steps)], axis=1)


@pytest.fixture(scope="session")
def driving() -> SimpleNamespace:
    """The makers above, by name."""
    makers = (open_ground, rolled_out, plan_of, planned_J, bang_bang, straight)
    return SimpleNamespace(**{maker.__name__: maker for maker in makers})
