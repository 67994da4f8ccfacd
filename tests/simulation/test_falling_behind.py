"""Every controller's contract: who falls behind cuts no corner and meets nobody."""

from __future__ import annotations

from itertools import takewhile
from types import SimpleNamespace

import numpy as np
import pytest
from shapely import Point, affinity
from shapely.geometry import LineString, Polygon

from mrmg.plans import Plan
from mrmg.scene.robot_model import RobotModel
from mrmg.scene.types import Scene
from mrmg.shipped import model_names
from mrmg.simulation.controller import controller_names
from mrmg.simulation.disturbance import Disturbance, RobotDisturbance
from mrmg.simulation.log import ExecutionLog
from mrmg.simulation.simulation import simulate

pytestmark = pytest.mark.quick("car-mpc", "diffdrive-tvlqr", "hauler-pure_pursuit")

DRAG = {"husky": 0.39}
"""Rolling resistance over weight of which a drive can overcome hardly more; OTHERS
where a robot has none of its own. A Husky needs half its grip for turning alone, and
goes astray before it is much slower."""

OTHERS = 0.43

CLOSE_M = 0.5
"""Distance the planner keeps between robots."""

LOST_M = 0.3
"""How much of it may be lost until the fleet has slowed down."""


def starting(model: RobotModel) -> tuple[float, int]:
    """Return acceleration [m/s^2] and steps to three quarters of the top speed."""
    speed = 0.75 * model.limits.v_max_m_s
    most = min(1.0, model.planning_share * model.limits.u1_max_m_s2)
    steps = round(speed / most / 0.1)
    return speed / (0.1 * steps), steps


def weaving(model: RobotModel, seconds: float) -> np.ndarray:
    """Drive at three quarters of the top speed in waves, and stop."""
    u1, ramp = starting(model)
    steps = round(seconds / 0.1)
    control = np.zeros((steps, 2))
    control[:ramp, 0], control[-ramp:, 0] = u1, -u1
    wave = np.repeat([1.0, -1.0, -1.0, 1.0], 10) * 0.4 * model.limits.w_max
    for start in range(ramp, steps - ramp - len(wave), len(wave)):
        control[start : start + len(wave), 1] = wave
    return control


def crossing(model: RobotModel, seconds: float, wait: int) -> np.ndarray:
    """Wait for so many steps, then drive straight on and stop."""
    u1, ramp = starting(model)
    control = np.zeros((round(seconds / 0.1), 2))
    control[wait : wait + ramp, 0], control[-ramp:, 0] = u1, -u1
    return control


def apart_m(scene: Scene, states: np.ndarray) -> float:
    """Least distance of the two footprints; states of shape (2, n, 5)."""
    outlines = [Polygon(robot.model.footprint_m) for robot in scene.robots]
    least = np.inf
    for both in states[:, ::5].swapaxes(0, 1):
        placed = [
            affinity.translate(
                affinity.rotate(outline, yaw, origin=(0, 0), use_radians=True), x, y
            )
            for outline, (x, y, yaw) in zip(outlines, both[:, :3], strict=True)
        ]
        least = min(least, placed[0].distance(placed[1]))
    return least


def planned_apart_m(scene: Scene, plan: Plan) -> float:
    return apart_m(scene, np.stack([item.state for item in plan.trajectories]))


@pytest.fixture(scope="module", params=model_names())
def mission(
    request: pytest.FixtureRequest, driving: SimpleNamespace
) -> tuple[Scene, Plan]:
    """r1 weaves east, r2 crosses its way from the south as close behind as it may."""
    scene = driving.open_ground(
        [(-10.0, 0.0, 0.0), (-4.5, -5.0, np.pi / 2)], models=[request.param]
    )
    model = scene.robots[0].model
    plans = (
        driving.plan_of(scene, [weaving(model, 16.0), crossing(model, 16.0, wait)])
        for wait in range(60, 0, -2)
    )
    *_, plan = takewhile(lambda plan: planned_apart_m(scene, plan) > CLOSE_M, plans)
    return scene, plan


@pytest.fixture(scope="module", params=controller_names())
def log(request: pytest.FixtureRequest, mission: tuple[Scene, Plan]) -> ExecutionLog:
    """A dragging brake lets r1 speed up but slowly."""
    scene, plan = mission
    model = scene.robots[0].model
    dragging = DRAG.get(model.name, OTHERS) / model.rolling_coefficient - 1.0
    disturbance = Disturbance(
        seed=0,
        robots=(
            RobotDisturbance(robot="r1", rolling=dragging),
            RobotDisturbance(robot="r2"),
        ),
    )
    return simulate(scene, plan, controller=request.param, disturbance=disturbance)


def test_the_fleet_waits_for_the_slow_one(
    mission: tuple[Scene, Plan], log: ExecutionLog
) -> None:
    scene, plan = mission
    late = 1.08 if scene.robots[0].model.name in DRAG else 1.2
    assert log.completed
    assert log.time_s[-1] > late * plan.makespan_s


def test_it_cuts_no_corner(mission: tuple[Scene, Plan], log: ExecutionLog) -> None:
    _, plan = mission
    way = LineString(plan.trajectories[0].state[:, :2])
    assert max(way.distance(Point(at)) for at in log.state[0, :, :2]) < 0.15


def test_it_meets_nobody(mission: tuple[Scene, Plan], log: ExecutionLog) -> None:
    scene, plan = mission
    assert log.contacts == ()
    planned = planned_apart_m(scene, plan)
    assert CLOSE_M < planned < 2.0 * CLOSE_M
    assert apart_m(scene, log.state) > planned - LOST_M


def test_commands_stay_within_the_limits(
    mission: tuple[Scene, Plan], log: ExecutionLog
) -> None:
    limits = mission[0].robots[0].model.limits
    v, w = np.moveaxis(log.command, -1, 0)
    assert v.min() >= limits.v_min_m_s
    assert v.max() <= limits.v_max_m_s
    assert np.abs(w).max() <= limits.w_max
