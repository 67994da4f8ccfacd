"""The energy of every simulated robot balances, and what escapes the meter is seen."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from mrmg.energy.audit import audit
from mrmg.energy.audit_record import ENERGY_IMBALANCE, EnergyAudit
from mrmg.scene.types import Scene
from mrmg.simulation.log import ExecutionLog
from mrmg.simulation.simulation import simulate
from mrmg.simulation.work import BALANCE_TERMS

DRIVE = '<motor name="drive" tendon="axle" gear="1"/>'
SITE = '<site name="nose" pos="0.35 0 0.25"/><geom name="floor_pan"'
THRUST = (
    '<general name="jet" site="nose" gear="1 0 0 0 0 0" biastype="affine" '
    'biasprm="{} 0 0"/>'
)
HILL = {"grid": [[0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0]] * 2}
"""A ridge across the way, 2 m high at x = 0, down to 0 within 20 m."""
Change = Callable[[str], str]


def own_car(scene: Scene, folder: Path, change: Change) -> Scene:
    """The scene, its robots with a changed MJCF."""
    robots = []
    for robot in scene.robots:
        assert robot.model.mjcf is not None
        mjcf = folder / robot.model.mjcf.name
        mjcf.write_text(change(robot.model.mjcf.read_text()))
        robots.append(replace(robot, model=replace(robot.model, mjcf=mjcf)))
    return replace(scene, robots=tuple(robots))


def residuals_pct(log: ExecutionLog) -> np.ndarray:
    """Residual of each robot's balance over the work of its drives."""
    assert log.balance_J is not None
    terms = dict(zip(BALANCE_TERMS, log.balance_J.T, strict=True))
    work_J = log.work_J.sum(axis=(1, 2))
    became_J = sum(terms[name] for name in BALANCE_TERMS[1:])
    return np.asarray(100.0 * (work_J + terms["steering"] - became_J) / work_J)


DAMPED: dict[str, Change] = {
    "as shipped": lambda text: text,
    "gear 2 and damped wheels": lambda text: text.replace(
        DRIVE, '<motor name="drive" tendon="axle" gear="2"/>'
    ).replace('<joint damping="0"', '<joint damping="0.8"'),
    "slow drive": lambda text: text.replace(
        DRIVE,
        '<general name="drive" tendon="axle" gear="3" dyntype="filterexact" '
        'dynprm="0.05" gainprm="2"/>',
    ),
    "sliding tyres": lambda text: text.replace('friction="1.0 ', 'friction="0.12 '),
}


@pytest.mark.parametrize("change", DAMPED)
def test_all_work_of_a_car_is_accounted_for(
    driving: SimpleNamespace, tmp_path: Path, change: str
) -> None:
    scene = driving.open_ground([(0.0, 0.0, 0.3)])
    scene = own_car(scene, tmp_path, DAMPED[change])
    plan = driving.plan_of(scene, [driving.bang_bang(scene, "r1", 12.0, seed=2)])
    log = simulate(scene, plan)
    assert np.abs(residuals_pct(log)).max() < 0.2
    assert log.balance_J is not None
    _, _, _, joints_J, contacts_J = log.balance_J[0]
    assert contacts_J > 0.0
    assert (contacts_J > 0.1 * joints_J) == (change == "sliding tyres")


def test_the_work_of_fleets_is_accounted_for_robot_by_robot(
    driving: SimpleNamespace,
) -> None:
    """Each alone and both together have the same balance."""
    poses = [(-10.0, -20.0, 0.0), (5.0, 20.0, 1.0)]
    kinds = ["car", "diffdrive"]
    both = driving.open_ground(poses, models=kinds)
    controls = [driving.bang_bang(both, robot, 8.0, seed=5) for robot in ("r1", "r2")]
    together = simulate(both, driving.plan_of(both, controls))
    assert together.balance_J is not None
    assert np.abs(residuals_pct(together)).max() < 0.1
    alone = driving.open_ground(poses[1:], models=kinds[1:])
    single = simulate(alone, driving.plan_of(alone, controls[1:]))
    np.testing.assert_allclose(single.balance_J[0], together.balance_J[1], atol=0.05)
    # Joints of cars rub, tendons of differential drives; contacts lose a little.
    for *_, joints_J, contacts_J in together.balance_J:
        assert 0.0 < contacts_J < 0.1 * joints_J


def test_height_and_speed_are_what_the_closed_form_says(
    driving: SimpleNamespace,
) -> None:
    """Up a ridge of 2 m, and at rest there: m g h, and no speed."""
    scene = driving.open_ground([(-25.0, 0.0, 0.0)], elevation=HILL)
    plan = driving.plan_of(scene, [driving.straight(17.0, 1.5, 0.5)])
    log = simulate(scene, plan)
    assert log.balance_J is not None
    _, kinetic_J, potential_J, joints_J, _ = log.balance_J[0]
    model = scene.robots[0].model
    lead_m = model.center_of_mass_m
    start, end = (
        np.interp(x + lead_m, [-20.0, 0.0, 20.0], [0.0, 2.0, 0.0])
        for x in log.state[0, [0, -1], 0]
    )
    climbed_J = model.energy_model.weight_N * float(end - start)
    assert climbed_J > 2000.0
    # The floor's facets round the ridge; the wheels settle by a millimetre.
    assert potential_J == pytest.approx(climbed_J, rel=0.02)
    assert abs(kinetic_J) < 10.0
    way_m = log.state[0, -1, 0] - log.state[0, 0, 0]
    rolling_N = model.energy_model.rolling_force_N
    assert joints_J == pytest.approx(rolling_N * way_m, rel=0.01)
    assert np.abs(residuals_pct(log)).max() < 0.2


def audited(driving: SimpleNamespace, folder: Path, push_N: float) -> EnergyAudit:
    """The audit of a straight drive under a push that no drive gives."""
    scene = driving.open_ground([(-30.0, 0.0, 0.0)])
    jet = DRIVE + THRUST.format(push_N)
    scene = own_car(
        scene,
        folder,
        lambda text: text.replace(DRIVE, jet).replace('<geom name="floor_pan"', SITE),
    )
    plan = driving.plan_of(scene, [driving.straight(20.0, 1.5, 0.5)])
    return audit(scene, plan, simulate(scene, plan), energy_tolerance_pct=1e6)


def test_an_actuator_that_is_not_metered_fails_the_balance(
    driving: SimpleNamespace, tmp_path: Path
) -> None:
    account = audited(driving, tmp_path, push_N=20.0)
    balance = account.robots[0].balance
    assert balance is not None
    assert balance.residual_J == pytest.approx(-20.0 * 1.5 * 17.0, rel=0.02)
    assert account.causes[0] == ENERGY_IMBALANCE
    assert "the energy of r1 does not balance" in account.reasons[0]
    assert "tolerance 2 %" in account.reasons[0]
    assert not account.mission_ok


def test_a_small_residual_is_forgiven_and_reported(
    driving: SimpleNamespace, tmp_path: Path
) -> None:
    account = audited(driving, tmp_path, push_N=1.0)
    balance = account.robots[0].balance
    assert balance is not None
    assert -1.5 < balance.residual_pct < -0.5
    assert account.mission_ok


def test_work_that_was_not_done_fails_the_balance(
    driving: SimpleNamespace, tmp_path: Path
) -> None:
    """The balance and the ledger judge the same work; an audit keeps both."""
    scene = driving.open_ground([(-30.0, 0.0, 0.0)])
    plan = driving.plan_of(scene, [driving.straight(20.0, 1.5, 0.5)])
    log = simulate(scene, plan)
    fair = audit(scene, plan, log, energy_tolerance_pct=1e6)
    assert fair.mission_ok
    padded = replace(log, work_J=1.05 * log.work_J)
    account = audit(scene, plan, padded, energy_tolerance_pct=1e6)
    assert account.causes[0] == ENERGY_IMBALANCE
    account.save(tmp_path)
    assert EnergyAudit.load(tmp_path) == account
    old = audit(scene, plan, replace(padded, balance_J=None), energy_tolerance_pct=1e6)
    assert old.mission_ok
    assert old.robots[0].balance is None
    old.save(tmp_path)
    assert EnergyAudit.load(tmp_path) == old
