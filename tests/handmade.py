"""Hand-made scenes, motions and plans for the judges' tests."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from mrmg.energy.metering import find_visits, plan_ledger
from mrmg.motion.dynamics import DERIVATIVES, rk4_step
from mrmg.plans import Plan, Trajectory
from mrmg.scene.loading import scene_from_document
from mrmg.scene.types import Robot, Scene
from mrmg.simulation.log import ExecutionLog

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
            states.append(step(states[-1], (u1, u2), robot.model.wheelbase_m, DT_S))
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


@pytest.fixture
def case(
    make_scene: Any, make_plan: Any, straight: Any
) -> Callable[..., tuple[Scene, Plan]]:
    """Return a maker of (scene, plan): r1 drives 12 m along y = 10 through the goal."""

    def make(
        distance_m: float = 12.0, tour: tuple[str, ...] = ("g",), **scene: Any
    ) -> tuple[Scene, Plan]:
        made = make_scene(**scene)
        controls = {robot.id: straight(distance_m) for robot in made.robots}
        tours = {robot.id: tour if robot.id == "r1" else () for robot in made.robots}
        return made, make_plan(made, controls, tours)

    return make


@pytest.fixture
def missing(
    make_scene: Any, make_plan: Any, straight: Any
) -> Callable[[], tuple[Scene, Plan]]:
    """Return a maker of (scene, plan): of its tour h, g the robot misses h."""

    def make() -> tuple[Scene, Plan]:
        places = {"h": [10, 18], "g": [15, 10]}
        goals = [
            {"id": name, "circle": {"center": at, "radius": 1}}
            for name, at in places.items()
        ]
        scene = make_scene(goals=goals)
        return scene, make_plan(scene, {"r1": straight(12.0)}, {"r1": ("h", "g")})

    return make


TICK_S = 0.02


@pytest.fixture
def make_log() -> Callable[..., ExecutionLog]:
    """Return a maker of logs of straight plans that were driven without any error.

    The work at the wheels is force times way, in closed form for straight motion over
    plain ground.
    """

    def make(scene: Scene, plan: Plan) -> ExecutionLog:
        ticks = round(DT_S / TICK_S)
        states, works = zip(
            *(_driven(scene, item, ticks) for item in plan.trajectories), strict=True
        )
        state = np.array(states)
        robots, n, _ = state.shape
        time_s = TICK_S * np.arange(n)
        return ExecutionLog(
            scene_digest=scene.digest,
            plan_digest=plan.digest,
            model_digest="none",
            controller="perfect",
            control_period_s=TICK_S,
            completed=True,
            robots=tuple(robot.id for robot in scene.robots),
            versions={"mujoco": "none"},
            time_s=time_s,
            clock_s=time_s,
            state=state,
            reference=state,
            command=state[:, :, 3:],
            multiplier=np.ones((robots, n)),
            force_N=np.zeros((robots, n - 1)),
            work_J=np.array(works),
            qpos=np.zeros((n, 0)),
            contacts=(),
            timing={
                "wall_s": 1.0,
                "realtime_factor": 20.0,
                "controller_ms": {"median": 0.2, "p99": 0.4},
            },
        )

    return make


def _driven(
    scene: Scene, trajectory: Trajectory, ticks: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return states and (driving, braking) work of a straight motion at every tick."""
    model = scene.robot(trajectory.robot).model
    u1 = np.repeat(trajectory.control[:, 0], ticks)
    v = np.concatenate([[0.0], np.cumsum(u1 * TICK_S)])
    way_m = 0.5 * (v[:-1] + v[1:]) * TICK_S
    travelled_m = np.concatenate([[0.0], np.cumsum(way_m)])
    x, y, theta = scene.robot(trajectory.robot).pose
    state = np.zeros((len(v), 5))
    state[:, 0] = x + travelled_m * np.cos(theta)
    state[:, 1] = y + travelled_m * np.sin(theta)
    state[:, 2], state[:, 3] = theta, v
    force_N = model.effective_mass_kg * u1 + model.energy_model.rolling_force_N
    work_J = force_N * way_m
    return state, np.stack([np.maximum(work_J, 0), np.minimum(work_J, 0)], axis=-1)


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> list[Figure]:
    """The figures that were written."""
    figures: list[Figure] = []
    save = Figure.savefig

    def kept(figure: Figure, *given: Any, **details: Any) -> None:
        save(figure, *given, **details)
        figures.append(figure)

    monkeypatch.setattr(Figure, "savefig", kept)
    return figures
