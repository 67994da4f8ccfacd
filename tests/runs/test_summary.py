"""summary.json against its schema, at every point where a run can end."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import jsonschema
import pytest

from mrmg import storage
from mrmg.energy.audit import audit
from mrmg.errors import RunFolderError
from mrmg.planning.statistics import Bounds, Improvement
from mrmg.plans import PlanStatus
from mrmg.runs.summary import summarize, summary_of
from mrmg.runs.summary_model import summary_schema
from mrmg.simulation.disturbance import DEFAULT_RANGES, Disturbance
from mrmg.verification.verify import verify

SECTIONS = {
    "plan": {
        "cost_J",
        "bound_J",
        "gap",
        "makespan_s",
        "bound_s",
        "time_limit_s",
        "objective",
        "margins",
        "margins_kept",
        "narrow_passages",
        "improvements",
        "path_following_plans",
        "vertices",
        "groups",
        "router_calls",
        "time_s",
    },
    "verdict": {
        "ok",
        "min_obstacle_clearance_m",
        "min_robot_distance_m",
        "violations",
    },
    "execution": {
        "goals_visited",
        "contacts",
        "gave_up",
        "disturbance",
        "realtime_factor",
        "controller_ms",
        "bounded_solves",
        "tracking",
        "events",
        "replans",
    },
    "energy": {
        "planned_J",
        "metered_J",
        "measured_J",
        "metered_error_pct",
        "measured_error_pct",
        "balance_residual_pct",
        "min_charge_fraction",
        "recharges",
    },
}
TOP = {
    "skipped_goals",
    "hints",
    "status",
    "mission_ok",
    "scene",
    "seed",
    "robots",
    "goals",
    "stations",
}
STATISTICS = {
    "path_following_plans": 2,
    "vertices": 100,
    "groups": 7,
    "router_calls": 3,
    "improvements": [
        Improvement(
            time_s=time_s, cost_J=cost_J, makespan_s=9.0, bounds=Bounds(energy_J=2.0)
        ).to_json()
        for time_s, cost_J in ((0.5, 3.0), (0.7, 2.5))
    ],
    "bound_J": 2.0,
    "bound_s": None,
    "bound": 2.0,
    "gap": 0.25,
    "time_s": {"init": 0.1, "routing": 0.2, "first_solution": 0.5, "total": 0.5},
}


@pytest.fixture
def parts(make_scene: Any, make_plan: Any, make_log: Any, straight: Any) -> Any:
    """Scene, planning outcome, plan, verdict, log and audit of one mission."""
    scene = make_scene()
    plan = make_plan(scene, {"r1": straight(12.0)}, {"r1": ("g",)})
    log = make_log(scene, plan)
    planning = {"status": "solved", "reason": "", "statistics": STATISTICS}
    return scene, planning, plan, verify(scene, plan), log, audit(scene, plan, log)


def check(summary: dict[str, Any]) -> None:
    jsonschema.validate(summary, summary_schema(), cls=jsonschema.Draft202012Validator)


def test_schema_is_a_schema_and_describes_every_key() -> None:
    schema = summary_schema()
    jsonschema.Draft202012Validator.check_schema(schema)
    sections = [schema, *schema["$defs"].values()]
    assert all(len(section["description"]) > 5 for section in sections)
    keys = [key for section in sections for key in section["properties"].values()]
    assert all("$ref" in key or len(key["description"]) > 5 for key in keys)


def test_whole_run_has_exactly_the_promised_keys(parts: Any) -> None:
    scene, planning, plan, verdict, log, account = parts
    summary = summary_of(
        scene, planning, seed=3, plan=plan, verdict=verdict, log=log, audit=account
    )
    check(summary)
    assert set(summary) == TOP | set(SECTIONS) | {"versions"}
    for section, keys in SECTIONS.items():
        assert set(summary[section]) == keys
    assert summary["mission_ok"]
    assert summary["execution"]["goals_visited"] == summary["goals"] == 1
    assert summary["energy"]["planned_J"] == plan.cost_J
    assert summary["versions"]["mujoco"] == "none"


def test_fleet_figures_do_not_average_a_robot_away(parts: Any) -> None:
    scene, planning, plan, _, log, account = parts
    (robot,) = account.robots
    good = replace(
        robot,
        metered_error_pct=1.0,
        measured_error_pct=2.0,
        tracking_rms_m=0.03,
        tracking_max_m=0.1,
        min_charge_fraction=0.5,
    )
    bad = replace(
        robot,
        metered_error_pct=-3.0,
        measured_error_pct=-6.0,
        tracking_rms_m=0.04,
        tracking_max_m=0.3,
        min_charge_fraction=0.2,
    )
    summary = summary_of(
        scene,
        planning,
        seed=3,
        plan=plan,
        log=log,
        audit=replace(account, robots=(good, bad)),
    )
    assert summary["energy"]["metered_error_pct"] == -3.0
    assert summary["energy"]["measured_error_pct"] == -6.0
    assert summary["energy"]["min_charge_fraction"] == 0.2
    tracking = summary["execution"]["tracking"]
    assert tracking["rms_m"] == pytest.approx((0.0025 / 2) ** 0.5)
    assert tracking["max_m"] == 0.3


@pytest.mark.parametrize("reached", range(5))
def test_summary_is_valid_however_far_the_run_came(parts: Any, reached: int) -> None:
    scene, planning, *rest = parts
    names = ("plan", "verdict", "log", "audit")
    made = dict(zip(names[:reached], rest[:reached], strict=True))
    summary = summary_of(scene, planning, seed=3, **made)
    check(summary)
    assert summary["mission_ok"] == (reached == 4)
    assert (summary["plan"] is None) == (reached < 1)
    assert (summary["verdict"] is None) == (reached < 2)
    assert (summary["energy"] is None) == (reached < 4)


@pytest.mark.parametrize("status", PlanStatus)
def test_every_status_is_in_the_schema(parts: Any, status: PlanStatus) -> None:
    planning = {"status": status.value, "reason": "why", "statistics": {}}
    check(summary_of(parts[0], planning, seed=0))


def test_invalid_plan_makes_no_mission_however_well_it_was_driven(
    parts: Any, make_scene: Any
) -> None:
    scene, planning, plan, _, log, account = parts
    verdict = verify(make_scene(bounds=[0, 0, 18, 20]), plan)
    summary = summary_of(
        scene, planning, seed=3, plan=plan, verdict=verdict, log=log, audit=account
    )
    check(summary)
    assert not summary["mission_ok"]
    assert summary["verdict"]["violations"] == len(verdict.violations) > 0


def test_a_model_mismatch_is_a_status_of_its_own(parts: Any) -> None:
    scene, planning, plan, verdict, log, _ = parts
    driven = replace(log, work_J=1.5 * log.work_J)
    account = audit(scene, plan, driven)
    summary = summary_of(
        scene, planning, seed=3, plan=plan, verdict=verdict, log=driven, audit=account
    )
    check(summary)
    assert summary["status"] == "model_mismatch"
    assert not summary["mission_ok"]


def test_unknown_keys_are_refused(parts: Any) -> None:
    summary = summary_of(parts[0], parts[1], seed=0)
    with pytest.raises(jsonschema.ValidationError):
        check({**summary, "extra": 1})


def test_folder_gives_the_same_summary(parts: Any, tmp_path: Path) -> None:
    scene, planning, plan, verdict, log, account = parts
    storage.write_json(tmp_path / "planning.json", planning)
    for part in (plan, verdict, log, account):
        part.save(tmp_path)
    assert summarize(scene, tmp_path) == summary_of(
        scene, planning, seed=3, plan=plan, verdict=verdict, log=log, audit=account
    )


def test_folder_of_an_infeasible_run_passes_over_files_of_older_ones(
    parts: Any, tmp_path: Path
) -> None:
    scene, _, plan, verdict, *_ = parts
    plan.save(tmp_path)
    verdict.save(tmp_path)
    planning = {"status": "infeasible", "reason": "goal g", "statistics": {}}
    storage.write_json(tmp_path / "planning.json", planning)
    storage.write_json(tmp_path / "run.json", {"arguments": {"seed": 11}})
    summary = summarize(scene, tmp_path)
    check(summary)
    assert (summary["seed"], summary["plan"], summary["verdict"]) == (11, None, None)


def test_empty_folder_names_the_cure(parts: Any, tmp_path: Path) -> None:
    with pytest.raises(RunFolderError, match="mrmg plan"):
        summarize(parts[0], tmp_path)


def test_disturbed_execution_says_how(parts: Any) -> None:
    scene, planning, plan, verdict, log, account = parts
    disturbance = DEFAULT_RANGES.draw(4, ["r1"])
    disturbed = replace(log, disturbance=disturbance, gave_up="lost", completed=False)
    summary = summary_of(
        scene,
        planning,
        seed=3,
        plan=plan,
        verdict=verdict,
        log=disturbed,
        audit=account,
    )
    check(summary)
    stated = summary["execution"]["disturbance"]
    assert storage.typed(Disturbance, stated) == disturbance
    assert summary["execution"]["gave_up"] == "lost"
