"""What people see of the package: its verbs, its types, and columns by name."""

from __future__ import annotations

import pickle
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mrmg
from mrmg.energy.audit_record import EnergyAudit
from mrmg.errors import MachineError, UsageError
from mrmg.planning import PlannerParams
from mrmg.plans import Plan, Trajectory
from mrmg.simulation.log import ExecutionLog

VERBS = {"load_scene", "plan", "verify", "execute", "drive", "audit", "render", "run"}
TYPES = {"Scene", "Plan", "PlannerParams", "Verdict", "ExecutionLog", "EnergyAudit"}


def test_the_package_shows_its_verbs_and_types_and_nothing_else() -> None:
    assert set(dir(mrmg)) == set(mrmg.__all__) == {*VERBS, *TYPES, "__version__"}
    assert all(callable(getattr(mrmg, name)) for name in {*VERBS, *TYPES})
    assert all(isinstance(getattr(mrmg, name), type) for name in TYPES)


def test_importing_the_package_imports_nothing_heavy() -> None:
    code = "import mrmg, sys; dir(mrmg); print(*sys.modules)"
    ended = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert {"numpy", "mujoco", "casadi", "numba"}.isdisjoint(ended.stdout.split())


@pytest.mark.parametrize(
    ("motion", "fifth", "control"),
    [
        ("car", ("psi_rad", "rad"), ("u2_rad_s", "rad/s")),
        ("unicycle", ("omega_rad_s", "rad/s"), ("u2_rad_s2", "rad/s^2")),
        ("custom", ("w", "SI"), ("u2", "SI")),
        ("", ("w", "SI"), ("u2", "SI")),
    ],
)
def test_a_trajectory_names_its_columns(
    motion: str, fifth: tuple[str, str], control: tuple[str, str]
) -> None:
    state, held = np.arange(15.0).reshape(3, 5), np.arange(4.0).reshape(2, 2)
    trajectory = Trajectory(
        robot="r1", dt_s=0.1, state=state, control=held, motion=motion
    )
    columns = list(trajectory.columns.items())
    assert columns[0] == ("time_s", "s")
    assert (columns[5], columns[7]) == (fifth, control)
    arrays = trajectory.to_arrays()
    assert list(arrays) == list(trajectory.columns)
    assert {len(values) for values in arrays.values()} == {3}
    np.testing.assert_array_equal(arrays["time_s"], trajectory.time_s)
    np.testing.assert_array_equal(arrays[fifth[0]], state[:, 4])
    np.testing.assert_array_equal(arrays[control[0]], [1.0, 3.0, np.nan])


def test_a_trajectory_keeps_no_array_of_its_maker() -> None:
    states, controls = np.zeros((9, 5)), np.zeros((9, 2))
    made = Trajectory(robot="r1", dt_s=0.1, state=states[:3], control=controls[:2])
    states += 1.0
    controls += 1.0
    assert not made.state.any() and not made.control.any()
    with pytest.raises(ValueError, match="read-only"):
        made.state[0] = 1.0


@pytest.fixture(scope="module")
def mixed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of a differential drive."""
    folder = tmp_path_factory.mktemp("runs")
    scene = folder / "turn.yaml"
    scene.write_text(
        "format: 1\nname: turn\nbounds: [0, 0, 20, 10]\n"
        "goals:\n  - {id: g1, circle: {center: [14, 5], radius: 1.5}}\n"
        "robots:\n  - {id: d1, model: diffdrive, pose: [4, 5, 0]}\n"
    )
    mrmg.run(scene, out=folder / "run", video=None)
    return folder / "run"


def test_plan_and_log_of_a_run_know_their_motion(mixed: Path) -> None:
    trajectory, log = Plan.load(mixed).trajectory("d1"), ExecutionLog.load(mixed)
    assert "omega_rad_s" in trajectory.to_arrays()
    arrays = log.to_arrays("d1")
    assert list(arrays) == list(log.columns("d1"))
    assert {len(values) for values in arrays.values()} == {len(log.time_s)}
    np.testing.assert_array_equal(arrays["omega_rad_s"], log.state[0, :, 4])
    np.testing.assert_array_equal(arrays["command_omega_rad_s"], log.command[0, :, 1])
    np.testing.assert_array_equal(arrays["reference_x_m"], log.reference[0, :, 0])
    np.testing.assert_array_equal(arrays["work_braking_J"][:-1], log.work_J[0, :, 1])
    assert np.isnan(arrays["force_N"][-1])
    assert log.columns("d1")["force_N"] == "N"


def test_an_older_plan_and_log_name_the_fifth_column_without_meaning(
    mixed: Path,
) -> None:
    log = replace(ExecutionLog.load(mixed), motions=())
    assert "w" in log.columns("d1")
    plan = Plan.load(mixed)
    unknown = tuple(replace(each, motion="") for each in plan.trajectories)
    assert replace(plan, trajectories=unknown).digest == plan.digest


def test_an_unknown_robot_is_answered_with_the_known_ones(mixed: Path) -> None:
    name: Any = 9
    for parts in (
        ExecutionLog.load(mixed).to_arrays,
        Plan.load(mixed).trajectory,
        mrmg.load_scene(mixed / "scene.yaml").robot,
        EnergyAudit.load(mixed).robot,
    ):
        with pytest.raises(UsageError, match="robot 'r9' is not known.*allowed: d1"):
            parts("r9")
        with pytest.raises(UsageError, match="robot '9' is not known"):
            parts(name)


def test_results_are_equal_where_their_contents_are(mixed: Path) -> None:
    plan, log = Plan.load(mixed), ExecutionLog.load(mixed)
    again, driven = pickle.loads(pickle.dumps((plan, log)))
    assert (again, driven) == (plan, log)
    assert {again, plan} == {plan} and {driven, log} == {log}
    assert replace(log, timing={}) == log
    assert replace(log, state=log.state + 1.0) != log
    moved = replace(plan.trajectories[0], state=plan.trajectories[0].state + 1.0)
    assert replace(plan, trajectories=(moved,)) != plan


def test_data_frames_need_pandas_only_when_asked_for(
    mixed: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(MachineError, match="pip install pandas.*to_arrays"):
        Plan.load(mixed).trajectories[0].to_dataframe()
    with pytest.raises(MachineError, match="pandas"):
        ExecutionLog.load(mixed).to_dataframe("d1")


def test_values_of_other_types_are_refused_with_where_to_get_them() -> None:
    scene = mrmg.load_scene("quickstart")
    plan = Plan.load(Path(__file__).parent / "run_of_0.1.0")
    none: Any = None
    name: Any = "file.yaml"
    number: Any = 5
    no_plan = r"expected Plan, got None; mrmg.plan\(scene\).plan is one, or None where"
    no_log = r"expected ExecutionLog, got None; mrmg.execute\(scene, plan\) gives one"
    no_scene = r"expected Scene, got 'file.yaml' \(str\); mrmg.load_scene"
    for call, message in (
        (lambda: mrmg.verify(scene, none), no_plan),
        (lambda: mrmg.execute(scene, none), no_plan),
        (lambda: mrmg.drive(scene, none), no_plan),
        (lambda: mrmg.audit(scene, none, none), no_plan),
        (lambda: mrmg.audit(scene, plan, none), no_log),
        (lambda: mrmg.render(scene, plan, none, "mission.mp4"), no_log),
        (lambda: mrmg.plan(name), no_scene),
        (lambda: mrmg.verify(name, plan), no_scene),
        (lambda: mrmg.execute(name, plan), no_scene),
        (lambda: mrmg.plan(scene, params=number), "expected PlannerParams, got 5"),
        (lambda: mrmg.plan(scene, seed=name), "seed = 'file.yaml'; expected a whole"),
        (lambda: mrmg.plan(scene, workers=none), "workers = None; expected a whole"),
        (lambda: PlannerParams(router=name), "expected RouterParams, got 'file"),
        (lambda: mrmg.run(number), r"expected str or Path, got 5 \(int\); give the"),
    ):
        with pytest.raises(UsageError, match=message):
            call()


def test_a_tolerance_is_a_number(mixed: Path) -> None:
    scene = mrmg.load_scene(mixed.with_name("turn.yaml"))
    plan, log = Plan.load(mixed), ExecutionLog.load(mixed)
    wrong: Any
    for wrong in (float("nan"), -1.0, "much", None):
        with pytest.raises(
            UsageError, match=r"energy_tolerance_pct = .* must be a num"
        ):
            mrmg.audit(scene, plan, log, energy_tolerance_pct=wrong)
