"""Figures of many trials: against scipy, by hand, and through the disk."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import binomtest

from mrmg.energy.audit import audit
from mrmg.errors import RunFolderError
from mrmg.plans import Plan
from mrmg.scene.types import Scene
from mrmg.simulation.disturbance import Disturbance, RobotDisturbance
from mrmg.simulation.log import Contact, ExecutionLog
from mrmg.studies.outcomes import (
    Study,
    Trial,
    assess_trial,
    load_studies,
    save_study,
    wilson_interval,
)

GOOD = Trial(
    seed=0,
    feasible=True,
    causes=(),
    reasons=(),
    goals_visited=3,
    charge_fraction=0.2,
    charge_J=200.0,
    charge_robot="r1",
    obstacle_clearance_m=0.5,
    robot_distance_m=2.0,
    tracking_max_m=0.03,
    duration_s=60.0,
    log_digest="0",
)
EMPTY = replace(
    GOOD,
    seed=7,
    feasible=False,
    causes=("battery empty",),
    reasons=("r1's battery ran empty, 10 J short",),
    charge_fraction=-0.01,
    charge_J=-10.0,
)


@given(st.integers(1, 300).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n))))
def test_the_interval_is_wilsons(counts: tuple[int, int]) -> None:
    successes, trials = counts
    expected = binomtest(successes, trials).proportion_ci(0.95, method="wilson")
    assert wilson_interval(successes, trials) == pytest.approx(
        (expected.low, expected.high), abs=1e-9
    )


def assessed(scene: Scene, plan: Plan, log: ExecutionLog) -> Trial:
    return assess_trial(scene, log, audit(scene, plan, log))


@pytest.fixture
def driven(
    make_scene: Callable[..., Scene],
    make_plan: Callable[..., Plan],
    make_log: Callable[..., ExecutionLog],
    straight: Callable[[float], Any],
) -> tuple[Scene, Plan, ExecutionLog]:
    """Ten metres from (5, 10) to a goal at (15, 10), 10 m from the walls."""
    scene = make_scene()
    plan = make_plan(scene, {"r1": straight(10.0)}, {"r1": ("g",)})
    disturbance = Disturbance(seed=4, robots=(RobotDisturbance(robot="r1"),))
    return scene, plan, replace(make_log(scene, plan), disturbance=disturbance)


def test_a_trial_that_went_well(driven: tuple[Scene, Plan, ExecutionLog]) -> None:
    scene, plan, log = driven
    trial = assessed(scene, plan, log)
    assert (trial.seed, trial.feasible, trial.causes) == (4, True, ())
    assert trial.goals_visited == 1
    # The rear overhang of 0.3 m starts 5 m from the wall behind.
    assert trial.obstacle_clearance_m == pytest.approx(4.7)
    assert trial.robot_distance_m is None
    model = scene.robots[0].model
    spent_J = log.work_J[0, :, 0].sum() / model.drive_efficiency
    assert trial.charge_J == pytest.approx(20000.0 - spent_J)
    assert trial.charge_fraction == pytest.approx(trial.charge_J / 20000.0)


def test_the_reserve_is_kept_under_disturbances_too(
    driven: tuple[Scene, Plan, ExecutionLog],
) -> None:
    scene, plan, log = driven
    spent = 1.0 - assessed(scene, plan, log).charge_fraction

    def with_capacity(factor: float) -> Trial:
        weak = RobotDisturbance(robot="r1", capacity=factor - 1.0)
        disturbance = Disturbance(seed=4, robots=(weak,))
        return assessed(scene, plan, replace(log, disturbance=disturbance))

    # The reserve is 1000 J, whatever the battery really holds.
    kept = with_capacity(spent * 1.01 + 0.05)
    assert kept.feasible
    assert kept.charge_J > 1000.0
    used = with_capacity(spent * 1.01)
    assert (used.feasible, used.causes) == (False, ("below reserve",))
    assert 0.0 < used.charge_J < 1000.0
    assert "reserve of 1000 J" in used.reasons[0]
    flat = with_capacity(spent * 0.99)
    assert (flat.feasible, flat.causes) == (False, ("battery empty",))
    assert "ran empty" in flat.reasons[0]


def test_failures_are_told_apart(driven: tuple[Scene, Plan, ExecutionLog]) -> None:
    scene, plan, log = driven
    touch = Contact(time_s=1.0, robot="r1", other="wall", x_m=0.0, y_m=0.0)
    touched = assessed(scene, plan, replace(log, contacts=(touch,)))
    assert touched.causes == ("contact",)
    stuck = assessed(
        scene,
        plan,
        replace(
            log,
            completed=False,
            gave_up="stalled",
            state=log.state[:, :1] + 0.0 * log.state,
        ),
    )
    assert stuck.causes == ("stalled", "goal missed")


def test_a_drive_without_disturbance_is_judged_by_the_scene_s_batteries(
    driven: tuple[Scene, Plan, ExecutionLog],
) -> None:
    scene, plan, log = driven
    account = audit(scene, plan, replace(log, disturbance=None))
    trial = assess_trial(scene, replace(log, disturbance=None), account)
    robot = account.robot(trial.charge_robot)
    assert trial.charge_fraction == robot.min_charge_fraction
    battery = scene.robot(robot.robot).battery
    assert trial.charge_J == trial.charge_fraction * battery.capacity_J


def test_a_study_adds_its_trials_up() -> None:
    trials = tuple(
        replace(GOOD, seed=seed, charge_fraction=0.1 * (seed + 1)) for seed in range(4)
    )
    study = Study(options={"disturb": "rolling=+30%"}, trials=(*trials, EMPTY))
    figures = study.to_json()
    assert (figures["trials"], figures["feasible"]) == (5, 4)
    assert figures["probability"] == 0.8
    assert figures["failures"] == {"battery empty": 1}
    assert figures["margins"]["charge_fraction"] == pytest.approx(
        {"worst": -0.01, "p05": 0.012, "median": 0.2, "p95": 0.38}
    )
    assert figures["margins"]["tracking_max_m"]["worst"] == 0.03
    assert figures["worst"]["seed"] == 7
    assert figures["worst"]["execute"] == [
        "--disturb",
        "rolling=+30%",
        "--disturb-seed",
        "7",
    ]


def test_one_robot_has_no_distance_to_others() -> None:
    lone = replace(GOOD, robot_distance_m=None)
    study = Study(options={"disturb": ""}, trials=(lone,))
    assert "robot_distance_m" not in study.to_json()["margins"]
    assert study.replay_options(lone) == ["--disturb", "--disturb-seed", "0"]


def test_the_worst_trial_failed_or_came_closest_to_it() -> None:
    close = replace(GOOD, seed=1, charge_fraction=0.01)
    assert Study(options={}, trials=(GOOD, close)).worst == close
    touched = replace(GOOD, seed=2, feasible=False, causes=("contact",))
    assert Study(options={}, trials=(GOOD, close, touched)).worst == touched


def test_studies_of_one_plan_lie_side_by_side(
    driven: tuple[Scene, Plan, ExecutionLog], tmp_path: Path
) -> None:
    scene, plan, _ = driven
    soft = Study(options={"disturb": ""}, trials=(GOOD,))
    hard = Study(options={"disturb": "rolling=+30%"}, trials=(EMPTY,))
    assert load_studies(tmp_path, plan) == ()
    save_study(tmp_path, scene, plan, hard)
    save_study(tmp_path, scene, plan, soft)
    assert load_studies(tmp_path, plan) == (soft, hard)
    larger = replace(soft, trials=(GOOD, replace(GOOD, seed=1)))
    save_study(tmp_path, scene, plan, larger)
    assert load_studies(tmp_path, plan) == (larger, hard)


def test_studies_of_another_plan_are_not_this_ones(
    driven: tuple[Scene, Plan, ExecutionLog], tmp_path: Path
) -> None:
    scene, plan, _ = driven
    save_study(tmp_path, scene, plan, Study(options={"disturb": ""}, trials=(GOOD,)))
    assert load_studies(tmp_path, replace(plan, seed=plan.seed + 1)) == ()


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"format": 99}', "{", "\x00"])
def test_a_damaged_file_is_named(
    text: str, driven: tuple[Scene, Plan, ExecutionLog], tmp_path: Path
) -> None:
    (tmp_path / "robustness.json").write_text(text)
    with pytest.raises(RunFolderError, match="robustness.json: not readable"):
        load_studies(tmp_path, driven[1])
