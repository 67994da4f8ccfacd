"""Every shipped scene: planned, judged, driven, and planned against simulated energy.

The quickstart is driven in every test run, the scenes of the table in continuous
integration (CI=true), where all of them are.
"""

from __future__ import annotations

import pytest

import mrmg
from mrmg.energy.audit_record import EnergyAudit
from mrmg.energy.model import PARTS
from mrmg.plans import Plan, PlanStatus
from mrmg.scene.types import Scene
from mrmg.shipped import scene_names
from mrmg.simulation.log import ExecutionLog
from mrmg.verification.verdict import Verdict

ENERGY_PCT = {"hills": 2.0}
"""Largest errors of energy on scenes with slopes ..."""

FLAT_ENERGY_PCT = 0.5
"""... and on flat ground, metered and measured."""

BALANCE_PCT = 0.5
TRACKING_RMS_M = 0.05
TRACKING_MAX_M = 0.25

MISSIONS = [
    pytest.param(("quickstart", 0), id="quickstart"),
    *(
        pytest.param((name, 0), id=name, marks=pytest.mark.ci)
        for name in scene_names()
        if name != "quickstart"
    ),
]


Drive = tuple[Scene, Plan, Verdict, ExecutionLog, EnergyAudit]


@pytest.fixture(scope="module", params=MISSIONS)
def drive(request: pytest.FixtureRequest) -> Drive:
    """One mission, from scene to audit."""
    name, seed = request.param
    scene = mrmg.load_scene(name)
    result = mrmg.plan(scene, seed=seed)
    assert result.status is PlanStatus.SOLVED, result.reason
    assert result.plan is not None
    verdict = mrmg.verify(scene, result.plan)
    log = mrmg.execute(scene, result.plan)
    return scene, result.plan, verdict, log, mrmg.audit(scene, result.plan, log)


def test_the_plan_passes_the_independent_verifier(drive: Drive) -> None:
    _, _, verdict, _, _ = drive
    assert [violation.message for violation in verdict.violations] == []


def test_the_fleet_does_the_mission_in_simulation(drive: Drive) -> None:
    scene, _, _, log, account = drive
    assert log.completed
    assert log.contacts == ()
    assert account.reasons == ()
    assert set(account.goals_visited) == {goal.id for goal in scene.goals}


def test_the_cars_stay_near_their_reference(drive: Drive) -> None:
    _, _, _, _, account = drive
    for robot in account.robots:
        assert robot.tracking_rms_m <= TRACKING_RMS_M
        assert robot.tracking_max_m <= TRACKING_MAX_M


def test_the_charge_never_falls_below_the_reserve(drive: Drive) -> None:
    scene, _, _, _, account = drive
    for robot in account.robots:
        reserve = scene.robot(robot.robot).battery.reserve_fraction
        assert robot.min_charge_fraction >= reserve


def test_simulated_energy_is_near_the_plan_per_robot(drive: Drive) -> None:
    scene, plan, _, _, account = drive
    largest = ENERGY_PCT.get(scene.name, FLAT_ENERGY_PCT) / 100.0
    for robot in plan.tours:
        planned = pytest.approx(plan.ledger.total_J(robot=robot), rel=largest)
        assert account.metered.total_J(robot=robot) == planned
        assert account.measured.total_J(robot=robot) == planned


def test_the_work_of_every_robot_is_accounted_for(drive: Drive) -> None:
    _, _, _, _, account = drive
    for robot in account.robots:
        assert robot.balance is not None
        assert abs(robot.balance.residual_pct) <= BALANCE_PCT


def test_simulated_energy_is_near_the_plan_per_part(drive: Drive) -> None:
    """Each part is held to the same share of the robot's whole energy."""
    scene, plan, _, _, account = drive
    largest_pct = ENERGY_PCT.get(scene.name, FLAT_ENERGY_PCT)
    for robot in plan.tours:
        whole = plan.ledger.total_J(robot=robot)
        for part in PARTS:
            planned = plan.ledger.total_J(robot=robot, part=part)
            metered = account.metered.total_J(robot=robot, part=part)
            assert abs(metered - planned) <= largest_pct / 100.0 * whole, part
