"""Work is what MuJoCo's actuators did, whatever the drives of a robot are."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import mujoco
import numpy as np
import pytest

from mrmg.energy.metering import measured_energy_parts
from mrmg.errors import FileError
from mrmg.scene.types import Scene
from mrmg.simulation import fleet as fleet_module
from mrmg.simulation.fleet import Fleet
from mrmg.simulation.simulation import simulate
from mrmg.simulation.world_model import build_world

CAR = '<motor name="drive" tendon="axle" gear="1"/>'
CARS = {
    "as shipped": CAR,
    "gear 2": '<motor name="drive" tendon="axle" gear="2"/>',
    "gear -0.4": '<motor name="drive" tendon="axle" gear="-0.4"/>',
    "gain 7": '<general name="drive" tendon="axle" gainprm="7"/>',
    "filter": '<general name="drive" tendon="axle" gear="3" dyntype="filterexact" '
    'dynprm="0.05" gainprm="2" biasprm="0 0 0"/>',
    "damped": '<general name="drive" tendon="axle" gainprm="2" biastype="affine" '
    'biasprm="5 0 -30"/>',
    "weak control": '<motor name="drive" tendon="axle" ctrlrange="-200 200"/>',
    "weak force": '<motor name="drive" tendon="axle" gear="0.5" '
    'forcerange="-400 400"/>',
    "hub motors": '<motor name="drive" joint="spin_rl" gear="0.25"/>'
    '<motor name="drive_2" joint="spin_rr" gear="0.5"/>',
    "four wheels": f'{CAR}<motor name="drive_fl" joint="spin_fl" gear="0.25"/>'
    '<motor name="drive_fr" joint="spin_fr" gear="0.1"/>',
    "dragging": f'{CAR}<velocity name="drag" joint="spin_rl" kv="1.5"/>',
}
"""Drives of the shipped car, in the place of its own."""

WEAK = ("weak control", "weak force")

DIFFDRIVES = {
    "as shipped": "",
    "gears": 'gear="0.6"',
    "filter": 'gear="0.15" dyntype="filter" dynprm="0.04"',
    "weak": 'gear="0.3" ctrlrange="-40 40"',
}


def with_drives(scene: Scene, folder: Path, change: Callable[[str], str]) -> Scene:
    """The scene with the MJCF of its only robot changed."""
    robot = scene.robots[0]
    assert robot.model.mjcf is not None
    text = robot.model.mjcf.read_text()
    mjcf = folder / "robot.xml"
    mjcf.write_text(change(text))
    return replace(
        scene, robots=(replace(robot, model=replace(robot.model, mjcf=mjcf)),)
    )


def car_with(driving: SimpleNamespace, folder: Path, drives: str) -> Scene:
    scene = driving.open_ground([(-30.0, 0.0, 0.0)])
    return with_drives(scene, folder, lambda text: text.replace(CAR, drives))


def diffdrive_with(driving: SimpleNamespace, folder: Path, motor: str) -> Scene:
    scene = driving.open_ground([(-30.0, 0.0, 0.0)], models=["diffdrive"])

    def change(text: str) -> str:
        for side in "lr":
            own = f'<motor name="drive_{side}" joint="spin_{side}" gear="0.15"/>'
            assert own in text
            new = own.replace('gear="0.15"', motor).replace("motor", "general")
            text = text.replace(own, new if motor else own)
        return text

    return with_drives(scene, folder, change)


def integrals(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> tuple[float, float]:
    """Work by the drives, and its oracle: generalised forces over mean velocities."""
    world = build_world(scene)
    data = mujoco.MjData(world.model)
    robots = Fleet(world, data)
    spins = [
        joint.dofadr[0]
        for joint in map(world.model.joint, range(world.model.njnt))
        if "/spin_" in joint.name
    ]
    exact = [0.0]
    step = mujoco.mj_step

    def watched(model: mujoco.MjModel, data: mujoco.MjData) -> None:
        before = data.qvel.copy()
        step(model, data)
        power_W = data.qfrc_actuator * 0.5 * (before + data.qvel)
        exact[0] += power_W[spins].sum() * model.opt.timestep

    monkeypatch.setattr(fleet_module.mujoco, "mj_step", watched)
    robots.set_resistance(np.array([20.0]), np.array([5.0]))
    rng, w = np.random.default_rng(4), np.zeros(1)
    for steps in (1, 5, 10, *[5] * 60):
        force = rng.uniform(-1.0, 3.0, 1) * scene.robots[0].model.mass_kg
        following = rng.uniform(-0.2, 0.2, 1)
        robots.drive(force, w, following, steps)
        w = following
    done = robots.work.work_J()[:, 0].sum(axis=0)
    assert done[0] > 30.0
    assert done[1] < -0.1
    return float(done.sum()), exact[0]


@pytest.mark.parametrize("drives", CARS)
def test_work_of_a_car_is_that_of_its_actuators(
    driving: SimpleNamespace,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    drives: str,
) -> None:
    scene = car_with(driving, tmp_path, CARS[drives])
    done, exact = integrals(scene, monkeypatch)
    assert done == pytest.approx(exact, rel=1e-9)


@pytest.mark.parametrize("motor", DIFFDRIVES)
def test_work_of_a_differential_drive_is_that_of_its_actuators(
    driving: SimpleNamespace,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    motor: str,
) -> None:
    scene = diffdrive_with(driving, tmp_path, DIFFDRIVES[motor])
    done, exact = integrals(scene, monkeypatch)
    assert done == pytest.approx(exact, rel=1e-9)


@pytest.mark.parametrize("drives", [name for name in CARS if name != "dragging"])
def test_any_drive_is_driven_and_metered_as_planned(
    driving: SimpleNamespace, tmp_path: Path, drives: str
) -> None:
    """Closed form: rolling resistance times the way, and no gear in it.

    A drive too weak for the plan's acceleration falls behind, but does that work, too.
    """
    scene = car_with(driving, tmp_path, CARS[drives])
    plan = driving.plan_of(scene, [driving.straight(20.0, 1.5, 0.5)])
    log = simulate(scene, plan)
    assert log.completed
    way_m = log.state[0, -1, 0] - log.state[0, 0, 0]
    net_J = log.work_J.sum()
    rolling_N = scene.robots[0].model.energy_model.rolling_force_N
    assert net_J == pytest.approx(rolling_N * way_m, rel=0.01)
    if drives not in WEAK:
        assert way_m == pytest.approx(1.5 * 17.0, abs=0.02)
        planned_J = driving.planned_J(scene, plan, "r1")
        measured_J = measured_energy_parts(scene.robots[0], log.work_J[0], log.time_s)
        assert measured_J.sum() == pytest.approx(planned_J, rel=0.02)


def test_a_second_actuator_that_brakes_costs_what_it_takes(
    driving: SimpleNamespace, tmp_path: Path
) -> None:
    """Driving work pays for rolling and drag; the drag's own work is braking."""
    logs = []
    for drives in ("as shipped", "dragging"):
        scene = car_with(driving, tmp_path, CARS[drives])
        plan = driving.plan_of(scene, [driving.straight(20.0, 1.5, 0.5)])
        logs.append(simulate(scene, plan))
    # kv w^2 over the drive, w = v / r; the ramps count a third of their time.
    drag_J = 1.5 * (1.5 / 0.25) ** 2 * (14.0 + 6.0 / 3.0)
    more_J = logs[1].work_J[0, :, 0].sum() - logs[0].work_J[0, :, 0].sum()
    assert more_J == pytest.approx(drag_J, rel=0.05)


@pytest.mark.parametrize(
    ("drives", "message"),
    [
        ('<position name="drive" tendon="axle" kp="50"/>', "bias.*make it a motor"),
        ('<motor name="drive" tendon="axle" gear="0"/>', "moves no wheel"),
        (
            '<general name="drive" tendon="axle" dyntype="integrator" gainprm="5"/>',
            "dynamics other than none, filter",
        ),
        ('<general name="drive" tendon="axle" gainprm="0"/>', "no constant gain"),
        ('<adhesion name="drive" body="chassis" ctrlrange="0 1"/>', "neither on a"),
    ],
)
def test_a_drive_that_gives_no_commanded_force_is_named(
    driving: SimpleNamespace, tmp_path: Path, drives: str, message: str
) -> None:
    world = build_world(car_with(driving, tmp_path, drives))
    with pytest.raises(FileError, match=f"robot.xml.*\n.*actuator 'drive' .*{message}"):
        Fleet(world, mujoco.MjData(world.model))
