"""The three meters on a perfectly driven plan, and every way a mission can fail."""

from __future__ import annotations

import shlex
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mrmg.energy.audit import audit
from mrmg.energy.audit_record import MODEL_MISMATCH, EnergyAudit
from mrmg.energy.ledger import EnergyLedger
from mrmg.energy.mission_failures import AT_REST, over_s
from mrmg.errors import RunFolderError
from mrmg.plans import Plan
from mrmg.scene.types import Scene
from mrmg.shipped import models_folder
from mrmg.simulation.disturbance import DEFAULT_RANGES
from mrmg.simulation.log import Contact, ExecutionLog
from mrmg.simulation.supervision import Event

STATION = {"id": "s", "circle": {"center": [10, 10], "radius": 1}}
TWO_ROBOTS = [
    {"id": "r1", "model": "car", "pose": [5, 10, 0]},
    {"id": "r2", "model": "car", "pose": [5, 14, 0]},
]
Mission = tuple[Scene, Plan, ExecutionLog]


@pytest.fixture
def mission(
    make_scene: Any, make_plan: Any, make_log: Any, straight: Any
) -> Callable[..., Mission]:
    """Return a maker of missions: r1 by the station to the goal, r2 stays parked."""

    def make(**changes: Any) -> Mission:
        scene = make_scene(**{"stations": [STATION], "robots": TWO_ROBOTS, **changes})
        controls = {"r1": straight(12.0), "r2": [(0.0, 0.0)]}
        plan = make_plan(scene, controls, {"r1": ("s", "g"), "r2": ()})
        return scene, plan, make_log(scene, plan)

    return make


def test_perfect_execution_agrees_by_all_meters(mission: Any) -> None:
    account = audit(*mission())
    assert account.mission_ok
    assert account.reasons == ()
    driver = account.robot("r1")
    assert driver.planned_J > 1000.0
    assert driver.metered_J == pytest.approx(driver.planned_J, rel=1e-9)
    assert driver.measured_J == pytest.approx(driver.planned_J, rel=1e-9)
    assert abs(driver.metered_error_pct) < 1e-6
    assert abs(driver.measured_error_pct) < 1e-6
    assert driver.tracking_max_m == 0.0


def test_parked_robot_has_finite_errors(mission: Any) -> None:
    parked = audit(*mission()).robot("r2")
    assert parked.planned_J == 0.0
    assert parked.metered_error_pct == 0.0
    assert parked.measured_error_pct == 0.0


def test_work_of_a_parked_robot_counts_against_one_metre(mission: Any) -> None:
    scene, plan, log = mission()
    work_J = log.work_J.copy()
    model = scene.robot("r2").model.energy_model
    work_J[1, 0, 0] = 0.5 * model.rolling_force_N
    parked = audit(scene, plan, replace(log, work_J=work_J)).robot("r2")
    assert parked.measured_error_pct == pytest.approx(50.0)


def test_ledgers_share_legs_and_parts(mission: Any) -> None:
    account = audit(*mission())
    legs = {
        name: {(e.robot, e.leg, e.target) for e in getattr(account, name).entries}
        for name in ("planned", "metered", "measured")
    }
    assert legs["planned"] == legs["metered"] == legs["measured"]
    assert account.metered.parts() == account.planned.parts()
    assert account.measured.parts() == ("drive", "idle", "device")
    for part in account.planned.parts():
        assert account.metered.total_J(part=part) == pytest.approx(
            account.planned.total_J(part=part), abs=1e-6
        )


def test_visits_and_recharges_are_those_of_the_simulation(mission: Any) -> None:
    account = audit(*mission())
    assert [(visit.target, visit.kind) for visit in account.visits] == [
        ("s", "station"),
        ("g", "goal"),
    ]
    (recharge,) = account.recharges
    assert recharge.robot == "r1"
    assert recharge.energy_J < 20000.0
    assert account.goals_visited == ("g",)


def test_least_charge_is_found_on_arrival_at_the_station(mission: Any) -> None:
    account = audit(*mission())
    arrival = account.recharges[0].energy_J
    assert account.robot("r1").min_charge_fraction == pytest.approx(
        min(arrival, 20000 - account.measured.total_J() + 20000 - arrival) / 20000
    )


def test_low_battery_just_before_a_recharge_counts(mission: Any) -> None:
    made = mission()
    work_J = made[2].work_J.copy()
    work_J[0, 10, 0] += 0.85 * 19500.0
    scene, plan, log = made
    account = audit(scene, plan, replace(log, work_J=work_J))
    least = account.robot("r1").min_charge_fraction
    assert least == account.recharges[0].energy_J / 20000 < 0.05


def asked(scene: Scene, plan: Plan, log: ExecutionLog, **changes: Any) -> Any:
    """Return a changed scene, with plan and log as if they had been made for that."""
    changed = replace(scene, **changes)
    plan = replace(plan, scene_digest=changed.digest)
    log = replace(log, scene_digest=changed.digest, plan_digest=plan.digest)
    return changed, plan, log


def test_idle_power_is_drawn_at_all_times(mission: Any) -> None:
    scene, plan, log = mission()
    model = replace(scene.robots[1].model, idle_power_W=7.0)
    parked = replace(scene.robots[1], model=model)
    account = audit(*asked(scene, plan, log, robots=(scene.robots[0], parked)))
    idle_J = account.measured.total_J(robot="r2", part="idle")
    assert idle_J == pytest.approx(7.0 * log.time_s[-1])
    assert account.robot("r2").measured_J == pytest.approx(idle_J)
    assert account.robot("r2").metered_J == pytest.approx(idle_J)


def test_braking_feeds_back_by_the_regeneration_efficiency(mission: Any) -> None:
    scene, plan, log = mission()
    model = replace(scene.robots[0].model, regeneration_efficiency=0.5)
    robots = (replace(scene.robots[0], model=model), scene.robots[1])
    kinder = asked(scene, plan, log, robots=robots)
    braking_J = log.work_J[0, :, 1].sum()
    difference_J = (
        audit(*kinder).robot("r1").measured_J
        - audit(scene, plan, log).robot("r1").measured_J
    )
    assert braking_J < -10.0
    assert difference_J == pytest.approx(0.5 * braking_J)


def test_tracking_error_is_the_distance_to_the_reference(mission: Any) -> None:
    scene, plan, log = mission()
    reference = log.reference.copy()
    reference[0, :, 0] += 0.03
    reference[0, :, 1] -= 0.04
    reference[1, 0, 1] += 0.5
    account = audit(scene, plan, replace(log, reference=reference))
    assert account.robot("r1").tracking_rms_m == pytest.approx(0.05)
    assert account.robot("r1").tracking_max_m == pytest.approx(0.05)
    assert account.robot("r2").tracking_max_m == pytest.approx(0.5)
    assert account.robot("r2").tracking_rms_m == pytest.approx(
        0.5 / np.sqrt(len(log.time_s))
    )


def test_jitter_of_the_speed_does_not_add_up(mission: Any) -> None:
    """Kinetic energy that goes to and fro while driving costs the battery nothing."""
    scene, plan, log = mission()
    state = log.state.copy()
    cruising = np.abs(np.gradient(state[0, :, 3])) < 1e-9
    cruising &= state[0, :, 3] > 0.5
    jitter = 2e-4 * (-1.0) ** np.arange(cruising.sum())
    state[0, cruising, 3] += jitter
    account = audit(scene, plan, replace(log, state=state))
    assert abs(account.robot("r1").metered_error_pct) < 0.2


def failed(mission: Mission, **changes: Any) -> EnergyAudit:
    scene, plan, log = mission
    account = audit(scene, plan, replace(log, **changes))
    assert not account.mission_ok
    return account


def test_goal_not_entered_fails_the_mission(mission: Any) -> None:
    made = mission()
    state = made[2].state.copy()
    state[0, :, 1] += 1.2
    account = failed(made, state=state)
    assert account.goals_visited == ()
    assert account.reasons == ("goal g was visited by no robot",)


def test_goal_may_be_entered_by_another_robot(mission: Any) -> None:
    scene, plan, log = mission()
    swapped = replace(log, state=log.state[::-1].copy())
    assert audit(scene, plan, swapped).goals_visited == ("g",)


@pytest.mark.parametrize(
    ("finish", "reason"),
    [
        ({"circle": {"center": [17, 10], "radius": 0.5}}, ""),
        ({"circle": {"center": [17, 12], "radius": 0.5}}, "1.5 m outside its finish"),
        (
            {"circle": {"center": [17, 10], "radius": 0.5}, "heading": 1.5},
            "in its finish with another heading",
        ),
    ],
)
def test_a_missed_finish_fails_the_mission(
    finish: Any, reason: str, mission: Any
) -> None:
    made = mission(robots=[{**TWO_ROBOTS[0], "finish": finish}, TWO_ROBOTS[1]])
    if not reason:
        assert audit(*made).mission_ok
        return
    stop = Event(
        time_s=9.0, cause="rest", robot="", action="end", message="replanning is off"
    )
    account = failed(made, events=(stop,))
    assert account.goals_visited == ("g",)
    assert account.causes == ("ended", "finish missed")
    assert account.reasons[1] == f"r1 ended {reason}"
    broken = replace(stop, cause="fault", robot="r1", action="stop")
    assert audit(*made[:2], replace(made[2], events=(broken,))).mission_ok


def test_contact_fails_the_mission(mission: Any) -> None:
    contact = Contact(time_s=1.5, robot="r1", other="rock", x_m=6.0, y_m=10.0)
    account = failed(mission(), contacts=(contact,))
    assert account.reasons == ("r1 touched rock at 1.50 s near (6.00, 10.00)",)


def test_battery_below_reserve_fails_the_mission(mission: Any) -> None:
    made = mission()
    work_J = made[2].work_J.copy()
    work_J[0, 10, 0] += 0.85 * 19000.0
    account = failed(made, work_J=work_J)
    assert account.causes == ("below reserve", MODEL_MISMATCH)
    reason = account.reasons[0]
    assert "r1's battery fell to" in reason
    assert "reserve of 1000 J" in reason
    assert account.robot("r1").min_charge_fraction < 0.05


def test_an_empty_battery_fails_the_mission_and_is_told_as_such(mission: Any) -> None:
    made = mission()
    work_J = made[2].work_J.copy()
    work_J[0, 10, 0] += 0.85 * 21000.0
    account = failed(made, work_J=work_J)
    assert account.causes == ("battery empty", MODEL_MISMATCH)
    assert "r1's battery ran empty" in account.reasons[0]


def more_work(mission: Mission, factor: float) -> Mission:
    """The mission with r1 having worked `factor` times as much."""
    scene, plan, log = mission
    work_J = log.work_J.copy()
    work_J[0] *= factor
    return scene, plan, replace(log, work_J=work_J)


@pytest.mark.parametrize(("factor", "sign"), [(1.051, "+5.1"), (0.9499, "-5.01")])
def test_energy_off_by_more_than_the_tolerance_fails_the_mission(
    mission: Any, factor: float, sign: str
) -> None:
    scene, plan, log = more_work(mission(), factor)
    account = audit(scene, plan, log)
    assert account.causes == (MODEL_MISMATCH,)
    (reason,) = account.reasons
    assert "'car' does not describe r1" in reason
    assert f"{sign} %, tolerance 5" in reason
    assert "'mrmg calibrate car'" in reason
    assert audit(scene, plan, log, energy_tolerance_pct=5.2).mission_ok


def test_the_remedy_can_be_typed_as_it_is(mission: Any, tmp_path: Path) -> None:
    folder = shutil.copytree(models_folder() / "car", tmp_path / "my car")
    own = [{**robot, "model": str(folder)} for robot in TWO_ROBOTS]
    account = audit(*more_work(mission(robots=own), 2.0))
    assert f"'mrmg calibrate {shlex.quote(str(folder))}'" in account.reasons[0]


@pytest.mark.parametrize("factor", [1.049, 0.951])
def test_energy_within_the_tolerance_is_as_planned(mission: Any, factor: float) -> None:
    scene, plan, log = more_work(mission(), factor)
    assert audit(scene, plan, log).mission_ok
    assert not audit(scene, plan, log, energy_tolerance_pct=4.8).mission_ok


def test_what_a_slope_gives_counts_where_a_deviation_is_judged(mission: Any) -> None:
    """Downhill little is left to pay for, and a joule of it is many percent."""
    scene, plan, log = more_work(mission(), 1.02)
    entries = plan.ledger.entries
    (rolling,) = [entry for entry in entries if entry.part == "rolling"][:1]
    given_J = -0.9 * plan.ledger.total_J(robot="r1")
    downhill = replace(rolling, part="grade", energy_J=given_J)
    changed = replace(plan, ledger=EnergyLedger((*entries, downhill)))
    driven = replace(log, plan_digest=changed.digest)
    work_J = log.work_J.copy()
    work_J[0] *= 0.1
    account = audit(scene, changed, replace(driven, work_J=work_J))
    assert account.mission_ok, account.reasons
    model = scene.robot("r2").model.energy_model
    work_J[1, 0, 0] = 0.5 * model.rolling_force_N
    parked = audit(scene, changed, replace(driven, work_J=work_J))
    assert parked.causes == (MODEL_MISMATCH,)


def test_drives_other_than_modelled_only_report_the_deviation(mission: Any) -> None:
    scene, plan, log = more_work(mission(), 1.3)
    disturbance = DEFAULT_RANGES.draw(0, ["r1", "r2"])
    event = Event(time_s=1.0, cause="fault", robot="r2", action="stop", message="r2")
    factor = {"r1": np.full(plan.trajectories[0].control.shape[0], 1.01)}
    believing = replace(plan, rolling_factor=factor)
    for other, driven in (
        (plan, replace(log, disturbance=disturbance)),
        (plan, replace(log, events=(event,))),
        (believing, replace(log, plan_digest=believing.digest)),
    ):
        account = audit(scene, other, driven)
        assert account.mission_ok, account.reasons
        assert account.robot("r1").measured_error_pct > 25.0
    early = audit(scene, plan, replace(log, completed=False))
    assert MODEL_MISMATCH not in early.causes


def test_early_end_fails_the_mission(mission: Any) -> None:
    account = failed(mission(), completed=False)
    assert "ended early" in account.reasons[0]


@pytest.mark.parametrize(
    ("changes", "remedy"),
    [
        ({"scene_digest": "another"}, "another scene"),
        ({"plan_digest": "another"}, "another plan"),
        ({"robots": ("r2", "r1")}, "log of robots"),
    ],
)
def test_foreign_log_is_refused(mission: Any, changes: Any, remedy: str) -> None:
    scene, plan, log = mission()
    with pytest.raises(RunFolderError, match=remedy):
        audit(scene, plan, replace(log, **changes))


def test_audit_survives_saving(mission: Any, tmp_path: Path) -> None:
    account = audit(*mission())
    account.save(tmp_path)
    assert EnergyAudit.load(tmp_path) == account
    assert [path.name for path in tmp_path.iterdir()] == ["audit.json"]


@pytest.mark.parametrize("content", ["", "[]", "{}", '{"format": 99}'])
def test_unreadable_audit_names_the_cure(content: str, tmp_path: Path) -> None:
    (tmp_path / "audit.json").write_text(content)
    with pytest.raises(RunFolderError, match="mrmg audit"):
        EnergyAudit.load(tmp_path)


def test_a_mission_is_late_from_when_the_last_robot_rests(mission: Any) -> None:
    scene, plan, log = mission()
    (moving,) = np.flatnonzero(np.diff(np.abs(log.state[0, :, 3]) > AT_REST) & True)[
        -1:
    ]
    assert over_s(scene, log) == pytest.approx(log.time_s[moving + 1])
    assert over_s(scene, log) < plan.makespan_s + 0.1
    late = asked(scene, plan, log, time_limit_s=over_s(scene, log) - 0.5)
    account = audit(*late)
    assert account.causes == ("late",)
    assert "0.50 s after its time limit" in account.reasons[0]
    in_time = asked(scene, plan, log, time_limit_s=over_s(scene, log))
    assert audit(*in_time).mission_ok


def test_a_mission_is_not_over_while_a_robot_has_to_stay(mission: Any) -> None:
    scene, plan, log = mission()
    region = replace(scene.goals[0].region, center=log.state[0, -1, :2])
    inside = region.depth(log.state[0, :, :2]) >= 0.0
    arrival_s = float(log.time_s[inside.argmax()])
    later_s = log.time_s[-1] + np.arange(1, 101) * log.control_period_s
    standing = np.repeat(log.state[:, -1:], 100, axis=1)
    longer = replace(
        log,
        time_s=np.concatenate([log.time_s, later_s]),
        state=np.concatenate([log.state, standing], axis=1),
    )
    assert over_s(scene, longer) == over_s(scene, log)
    dwell_s = 0.5 + over_s(scene, log) - arrival_s
    goal = replace(scene.goals[0], region=region, dwell_s=dwell_s)
    found_s = over_s(replace(scene, goals=(goal,)), longer)
    assert found_s == pytest.approx(arrival_s + dwell_s, abs=0.05)
