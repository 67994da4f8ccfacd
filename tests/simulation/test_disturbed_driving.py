"""Driving under each disturbance: its effect is that of physics, its log tells it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from mrmg.errors import UsageError
from mrmg.plans import Plan
from mrmg.scene.types import Scene
from mrmg.simulation.disturbance import DEFAULT_RANGES, Disturbance, RobotDisturbance
from mrmg.simulation.disturbed_world import disturb_world
from mrmg.simulation.log import ExecutionLog
from mrmg.simulation.simulation import simulate
from mrmg.simulation.world_model import build_world


def disturbed(seed: int = 0, **changes: float) -> Disturbance:
    return Disturbance(seed=seed, robots=(RobotDisturbance(robot="r1", **changes),))


def off_m(log: ExecutionLog) -> np.ndarray:
    """Distance to the reference, shape (R, n)."""
    return np.hypot(*np.moveaxis((log.state - log.reference)[..., :2], -1, 0))


@pytest.fixture(scope="module")
def mission(driving: SimpleNamespace) -> tuple[Scene, Plan]:
    """Straight on for 16 m, so that the work is C_rr m g s in closed form."""
    scene = driving.open_ground([(-10.0, 0.0, 0.0)])
    return scene, driving.plan_of(scene, [driving.straight(12.0, 1.5)])


def test_what_is_no_disturbance_of_the_fleet_is_refused(
    mission: tuple[Scene, Plan],
) -> None:
    text: Any = "lag=50ms"
    with pytest.raises(UsageError, match="expected Disturbance, got 'lag=50ms'"):
        simulate(*mission, disturbance=text)
    for robots in (["r2"], ["r1", "r2"], []):
        other = DEFAULT_RANGES.draw(0, robots)
        with pytest.raises(UsageError, match=r"the scene has \['r1'\]; draw one"):
            simulate(*mission, disturbance=other)


@pytest.fixture(scope="module")
def undisturbed(mission: tuple[Scene, Plan]) -> ExecutionLog:
    return simulate(*mission)


def test_the_undisturbed_disturbance_changes_nothing(
    mission: tuple[Scene, Plan], undisturbed: ExecutionLog
) -> None:
    log = simulate(*mission, disturbance=disturbed())
    assert log.qpos.tobytes() == undisturbed.qpos.tobytes()
    assert log.disturbance == disturbed()
    assert undisturbed.disturbance is None


@pytest.mark.parametrize(
    ("changes", "factor"),
    [
        ({"rolling": 0.3}, 1.3),
        ({"rolling": -0.1}, 0.9),
        ({"mass": 0.2}, 1.2),
        ({"mass": 0.2, "rolling": 0.3}, 1.56),
        ({"drive_gain": -0.1}, 1.0),
        ({"lag_s": 0.05}, 1.0),
        ({"friction": -0.5}, 1.0),
    ],
    ids=str,
)
def test_work_is_what_the_ground_really_takes(
    mission: tuple[Scene, Plan], changes: dict[str, float], factor: float
) -> None:
    """The meter counts the force that arrived, not the one that was commanded."""
    scene, plan = mission
    log = simulate(scene, plan, disturbance=disturbed(**changes))
    assert log.completed
    way_m = log.state[0, -1, 0] - log.state[0, 0, 0]
    rolling_N = scene.robots[0].model.energy_model.rolling_force_N
    assert log.work_J.sum() == pytest.approx(factor * rolling_N * way_m, rel=0.01)
    assert off_m(log).max() < 0.1


def test_mass_and_grip_of_one_robot_alone_are_changed(
    driving: SimpleNamespace,
) -> None:
    scene = driving.open_ground([(0.0, 0.0, 0.0), (0.0, 9.0, 0.0)])
    plain, changed = build_world(scene).model, build_world(scene)
    robots = (
        RobotDisturbance(robot="r1"),
        RobotDisturbance(robot="r2", mass=0.1, friction=-0.2),
    )
    disturb_world(changed, Disturbance(seed=0, robots=robots))
    model = changed.model
    for name, mass, grip in (("r1", 1.0, 1.0), ("r2", 1.1, 0.8)):
        chassis = model.body(f"{name}/chassis").id
        assert model.body_subtreemass[chassis] == pytest.approx(
            mass * plain.body_subtreemass[chassis]
        )
        np.testing.assert_allclose(
            model.body_inertia[chassis], mass * plain.body_inertia[chassis]
        )
        tyre = model.geom(f"{name}/tyre_rl").id
        assert model.geom_friction[tyre, 0] == pytest.approx(
            grip * plain.geom_friction[tyre, 0]
        )
    np.testing.assert_array_equal(
        model.geom_friction[model.geom("floor").id],
        plain.geom_friction[plain.geom("floor").id],
    )


def test_a_robot_starts_where_it_was_moved_to_and_finds_its_way(
    mission: tuple[Scene, Plan],
) -> None:
    moved = disturbed(start_x_m=0.1, start_y_m=-0.2, start_heading_rad=0.1)
    log = simulate(*mission, disturbance=moved)
    offset = log.state[0, 0, :3] - log.reference[0, 0, :3]
    np.testing.assert_allclose(offset, (0.1, -0.2, 0.1), atol=1e-3)
    assert off_m(log)[0, -1] < 0.03
    assert log.completed


@pytest.mark.parametrize("steering_gain", [-0.1, 0.1])
def test_steering_that_is_off_is_corrected(
    driving: SimpleNamespace, steering_gain: float
) -> None:
    scene = driving.open_ground([(0.0, 0.0, 0.0)])
    plan = driving.plan_of(scene, [driving.bang_bang(scene, "r1", 15.0, 3)])
    log = simulate(scene, plan, disturbance=disturbed(steering_gain=steering_gain))
    assert log.completed
    assert off_m(log).max() < 0.25


def test_the_control_does_not_see_the_truth(mission: tuple[Scene, Plan]) -> None:
    """The log keeps the truth: noise shows in what is driven, smoothly."""
    noisy = simulate(*mission, disturbance=disturbed(position_noise_m=0.05))
    assert noisy.completed
    assert 0.001 < off_m(noisy).max() < 0.08
    step_m = np.abs(np.diff(noisy.state[0, :, 1]))
    assert step_m.max() < 0.005


@pytest.mark.quick("mpc")
@pytest.mark.parametrize("controller", ["mpc", "pure_pursuit", "tvlqr"])
def test_every_controller_survives_everything_at_once(
    driving: SimpleNamespace, controller: str
) -> None:
    scene = driving.open_ground([(-25.0, 0.0, 0.0), (25.0, 0.0, 1.0)])
    controls = [driving.bang_bang(scene, name, 15.0, 7) for name in ("r1", "r2")]
    ranges = replace(DEFAULT_RANGES, delay_s=DEFAULT_RANGES.lag_s)
    log = simulate(
        scene,
        driving.plan_of(scene, controls),
        controller=controller,
        disturbance=ranges.draw(3, ["r1", "r2"]),
    )
    assert log.completed
    assert off_m(log).max() < 0.6


def test_equal_seeds_give_equal_logs(
    mission: tuple[Scene, Plan], tmp_path: Path
) -> None:
    one, same, other = (
        simulate(*mission, disturbance=DEFAULT_RANGES.draw(seed, ["r1"]))
        for seed in (4, 4, 5)
    )
    assert one.qpos.tobytes() == same.qpos.tobytes()
    assert one.qpos.tobytes() != other.qpos.tobytes()
    one.save(tmp_path)
    assert ExecutionLog.load(tmp_path).disturbance == one.disturbance


@pytest.mark.parametrize(
    ("broken", "why"),
    [({"friction": -0.9}, "lost"), ({"drive_gain": -0.9}, "stalled")],
    ids=["ice", "no force"],
)
def test_the_log_says_why_a_mission_was_given_up(
    driving: SimpleNamespace, broken: dict[str, Any], why: str
) -> None:
    """On ice a robot slides out of its turns; with a dead drive it does not get on."""
    scene = driving.open_ground([(0.0, 0.0, 0.0)])
    circle = np.zeros((150, 2))
    circle[:20], circle[20:26] = (0.85, 0.0), (0.0, 0.85)
    log = simulate(
        scene, driving.plan_of(scene, [circle]), disturbance=disturbed(**broken)
    )
    assert not log.completed
    assert log.gave_up == why
