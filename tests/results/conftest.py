"""Hand-made scenes, motions and plans for the judges' tests."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import pytest

from mrmg.accounting import find_visits, plan_ledger
from mrmg.mission import Plan, Trajectory
from mrmg.motion.dynamics import DERIVATIVES, rk4_step
from mrmg.scene.loading import scene_from_document
from mrmg.scene.types import Robot, Scene

DT_S = 0.1

Controls = Sequence[tuple[float, float]]


@pytest.fixture
def make_scene() -> Callable[..., Scene]:
    """Return a maker of scenes: one robot at (5, 10), one goal at (15, 10)."""

    def make(**changes: Any) -> Scene:
        document = {
            "format": 1,
            "name": "handmade",
            "bounds": [0, 0, 40, 20],
            "goals": [{"id": "g", "circle": {"center": [15, 10], "radius": 1}}],
            "stations": [],
            "obstacles": [],
            "terrain": [],
            "battery": {"capacity_J": 20000, "reserve": 0.05},
            "robots": [{"id": "r1", "model": "car", "pose": [5, 10, 0]}],
        }
        return scene_from_document({**document, **changes}, source="handmade")

    return make


@pytest.fixture
def straight() -> Callable[[float], Controls]:
    """Return a maker of controls that drive straight on and stop."""

    def controls(distance_m: float) -> Controls:
        cruise = round((distance_m - 1.0) / 0.1)
        return [(1.0, 0.0)] * 10 + [(0.0, 0.0)] * cruise + [(-1.0, 0.0)] * 10

    return controls


@pytest.fixture
def drive() -> Callable[..., Trajectory]:
    """Return a function that drives a robot from its pose, in plain Python."""

    def driven(robot: Robot, controls: Controls) -> Trajectory:
        derivative = DERIVATIVES[robot.model.motion_model]
        step = rk4_step(derivative(math.sin, math.cos, math.tan))
        states = [(*robot.pose, 0.0, 0.0)]
        for u1, u2 in controls:
            states.append(step(*states[-1], u1, u2, robot.model.wheelbase_m, DT_S))
        return Trajectory(
            robot=robot.id,
            dt_s=DT_S,
            state=np.array(states),
            control=np.array(controls),
        )

    return driven


@pytest.fixture
def make_plan(drive: Callable[..., Trajectory]) -> Callable[..., Plan]:
    """Return a maker of plans from controls by robot, padded to equal length."""

    def make(
        scene: Scene,
        controls: Mapping[str, Controls],
        tours: Mapping[str, tuple[str, ...]],
    ) -> Plan:
        steps = max(len(item) for item in controls.values())
        trajectories = tuple(
            drive(
                robot,
                [
                    *controls[robot.id],
                    *[(0.0, 0.0)] * (steps - len(controls[robot.id])),
                ],
            )
            for robot in scene.robots
        )
        visits = [
            visit
            for item in trajectories
            for visit in find_visits(scene, item, tours[item.robot])
        ]
        return Plan(
            scene_name=scene.name,
            scene_digest=scene.digest,
            seed=3,
            profile="default",
            parameters_digest="none",
            versions={"mrmg": "test"},
            dt_s=DT_S,
            trajectories=trajectories,
            tours=tours,
            visits=tuple(sorted(visits, key=lambda visit: visit.step)),
            ledger=plan_ledger(scene, trajectories, visits),
        )

    return make
