"""Driving whole plans: tracking, energy, contacts, determinism, all ways to end."""

from __future__ import annotations

from dataclasses import fields, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import shapely

import mrmg
from mrmg.energy.metering import TimedStates, step_energy_parts
from mrmg.errors import RunFolderError, UsageError
from mrmg.plans import Plan
from mrmg.scene.types import Scene, TerrainArea
from mrmg.shipped import model_names
from mrmg.simulation.contacts import ContactWatch
from mrmg.simulation.controller import controller_names
from mrmg.simulation.disturbance import DisturbanceRanges
from mrmg.simulation.log import ExecutionLog
from mrmg.simulation.simulation import simulate

STRIPES = [
    {"id": "two", "polygon": [[8, -9], [18, -9], [18, 9], [8, 9]], "multiplier": 2},
    {"id": "four", "polygon": [[18, -9], [50, -9], [50, 9], [18, 9]], "multiplier": 4},
]


def off_m(log: ExecutionLog) -> np.ndarray:
    """Distance to the reference, shape (R, n)."""
    return np.hypot(*np.moveaxis((log.state - log.reference)[..., :2], -1, 0))


def measured_J(scene: Scene, log: ExecutionLog, index: int) -> float:
    """Battery energy of the driving work; braking feeds nothing back here."""
    model = scene.robots[index].model
    return float(log.work_J[index, :, 0].sum() / model.drive_efficiency)


def metered_J(scene: Scene, log: ExecutionLog, index: int) -> float:
    motion = TimedStates(
        robot=log.robots[index], time_s=log.time_s, state=log.state[index]
    )
    return float(step_energy_parts(scene, motion).sum())


@pytest.fixture(scope="module", params=["car", "mixed"])
def wild(
    request: pytest.FixtureRequest, driving: SimpleNamespace
) -> tuple[Scene, Plan]:
    """Two robots apart from each other under switching controls for half a minute."""
    models = ["diffdrive", "hauler"] if request.param == "mixed" else ["car"]
    scene = driving.open_ground([(-25.0, 0.0, 0.0), (25.0, 0.0, 1.0)], models=models)
    controls = [driving.bang_bang(scene, name, 30.0, 7) for name in ("r1", "r2")]
    return scene, driving.plan_of(scene, controls)


@pytest.fixture(scope="module")
def wild_log(wild: tuple[Scene, Plan]) -> ExecutionLog:
    return simulate(*wild)


@pytest.fixture(scope="module")
def wild_again(wild: tuple[Scene, Plan]) -> tuple[ExecutionLog, list[float]]:
    """The same once more, and the progress that it told."""
    seen: list[float] = []
    return simulate(*wild, on_progress=lambda share, _: seen.append(share)), seen


def test_switching_controls_are_tracked(wild_log: ExecutionLog) -> None:
    assert wild_log.completed
    assert wild_log.contacts == ()
    assert np.sqrt((off_m(wild_log) ** 2).mean(axis=1)).max() <= 0.05
    assert off_m(wild_log).max() <= 0.25
    assert wild_log.clock_s[-1] == pytest.approx(30.0)


def test_energy_of_switching_controls(
    driving: SimpleNamespace, wild: tuple[Scene, Plan], wild_log: ExecutionLog
) -> None:
    scene, plan = wild
    for index, robot in enumerate(scene.robots):
        planned = driving.planned_J(scene, plan, robot.id)
        assert metered_J(scene, wild_log, index) == pytest.approx(planned, rel=0.03)
        assert measured_J(scene, wild_log, index) == pytest.approx(planned, rel=0.05)


def test_log_has_the_documented_shapes(wild_log: ExecutionLog) -> None:
    n = len(wild_log.time_s)
    assert wild_log.clock_s.shape == (n,)
    assert wild_log.state.shape == wild_log.reference.shape == (2, n, 5)
    assert wild_log.command.shape == (2, n, 2)
    assert wild_log.multiplier.shape == (2, n)
    assert wild_log.force_N.shape == (2, n - 1)
    assert wild_log.work_J.shape == (2, n - 1, 2)
    assert wild_log.qpos.shape[0] == n
    np.testing.assert_allclose(np.diff(wild_log.time_s), wild_log.control_period_s)
    assert (wild_log.work_J[..., 0] >= 0).all()
    assert (wild_log.work_J[..., 1] <= 0).all()


def test_commands_stay_within_the_limits(
    wild: tuple[Scene, Plan], wild_log: ExecutionLog
) -> None:
    for robot, command in zip(wild[0].robots, wild_log.command, strict=True):
        limits = robot.model.limits
        v, w = command.T
        assert v.min() >= limits.v_min_m_s
        assert v.max() <= limits.v_max_m_s
        assert np.abs(w).max() <= limits.w_max
        change = np.abs(np.diff(command, axis=0)) / wild_log.control_period_s
        assert change[:, 0].max() <= limits.u1_max_m_s2 + 1e-9
        assert change[:, 1].max() <= limits.u2_max + 1e-9


def test_logged_states_are_those_of_qpos(
    wild: tuple[Scene, Plan], wild_log: ExecutionLog
) -> None:
    coordinates = {"car": 13, "hauler": 13, "diffdrive": 9}
    start = 0
    for robot, state in zip(wild[0].robots, wild_log.state, strict=True):
        np.testing.assert_array_equal(wild_log.qpos[:, start : start + 2], state[:, :2])
        start += coordinates[robot.model.name]
    assert start == wild_log.qpos.shape[1]


def test_equal_runs_give_equal_logs(
    wild_log: ExecutionLog, wild_again: tuple[ExecutionLog, list[float]]
) -> None:
    again, _ = wild_again
    for field in fields(ExecutionLog):
        first, second = (getattr(log, field.name) for log in (wild_log, again))
        if isinstance(first, np.ndarray):
            assert first.tobytes() == second.tobytes(), field.name
        elif field.name != "timing":
            assert first == second, field.name


def test_log_survives_the_disk(wild_log: ExecutionLog, tmp_path: Path) -> None:
    wild_log.save(tmp_path)
    loaded = ExecutionLog.load(tmp_path)
    for field in fields(ExecutionLog):
        saved, read = (getattr(log, field.name) for log in (wild_log, loaded))
        np.testing.assert_equal(read, saved)


def test_a_missing_log_is_named(tmp_path: Path) -> None:
    with pytest.raises(RunFolderError, match="no readable log.*run 'mrmg execute'"):
        ExecutionLog.load(tmp_path)


def test_timing_is_reported(wild_log: ExecutionLog) -> None:
    timing = wild_log.timing
    assert timing["wall_s"] > 0
    assert timing["realtime_factor"] == pytest.approx(
        wild_log.time_s[-1] / timing["wall_s"]
    )
    assert 0 < timing["controller_ms"]["median"] <= timing["controller_ms"]["p99"]
    riccati, qp = timing["controller_ms"]["riccati"], timing["controller_ms"]["qp"]
    assert riccati["calls"] > 0
    assert 0 < riccati["median"] <= riccati["p99"]
    assert (qp is None) == (sum(wild_log.bounded_solves) == 0)


@pytest.mark.quick("plain-mpc", "two-pure_pursuit", "four-tvlqr")
@pytest.mark.parametrize("controller", controller_names())
@pytest.mark.parametrize(
    ("start_m", "multiplier"),
    [(-40.0, 1.0), (8.5, 2.0), (18.5, 4.0)],
    ids=["plain", "two", "four"],
)
def test_work_on_a_straight_line_in_closed_form(
    driving: SimpleNamespace, controller: str, start_m: float, multiplier: float
) -> None:
    """Net work is k C_rr m g s; driving work in addition holds the kinetic energy."""
    scene = driving.open_ground([(start_m, 0.0, 0.0)], terrain=STRIPES)
    plan = driving.plan_of(scene, [driving.straight(7.0, 1.5)])
    log = simulate(scene, plan, controller=controller)
    model = scene.robots[0].model
    way_m = plan.trajectories[0].state[-1, 0] - start_m
    assert way_m == pytest.approx(8.25)
    lost_J = multiplier * model.energy_model.rolling_force_N * way_m
    assert log.work_J.sum() == pytest.approx(lost_J, rel=0.01)
    planned = driving.planned_J(scene, plan, "r1")
    assert measured_J(scene, log, 0) == pytest.approx(planned, rel=0.01)


def test_work_across_terrains_in_closed_form(driving: SimpleNamespace) -> None:
    """7 m of plain ground, 10 m twice as heavy, 8.25 m four times."""
    scene = driving.open_ground([(1.0, 0.0, 0.0)], terrain=STRIPES)
    plan = driving.plan_of(scene, [driving.straight(18.333, 1.5)])
    log = simulate(scene, plan)
    end_m = plan.trajectories[0].state[-1, 0]
    rolling = scene.robots[0].model.energy_model.rolling_force_N
    lost_J = rolling * (7.0 + 2 * 10.0 + 4 * (end_m - 18.0))
    assert end_m > 22.0
    assert log.work_J.sum() == pytest.approx(lost_J, rel=0.01)


def resisting_turns(scene: Scene, factor: float) -> Scene:
    """The scene all on ground whose resistance to turning differs by `factor`."""
    ground = TerrainArea(
        id="ground",
        shape=shapely.box(*scene.bounds),
        multiplier=1.0,
        turning_multiplier=factor,
    )
    return replace(scene, terrain=(ground,))


@pytest.mark.parametrize("factor", [1.0, 2.5])
@pytest.mark.parametrize("model", model_names())
def test_turning_costs_what_the_model_says(
    driving: SimpleNamespace, model: str, factor: float
) -> None:
    """A long steady circle: rolling plus scrub by |v tan psi|, or by T |omega|."""
    plain = driving.open_ground([(0.0, 0.0, 0.0)], models=[model])
    scene = resisting_turns(plain, factor)
    model_of = scene.robots[0].model
    limits = model_of.limits.scaled(model_of.planning_share)
    ramp = (min(1.0, limits.u1_max_m_s2), min(0.4, limits.u2_max, limits.w_max))
    control = np.zeros((300, 2))
    control[:10], control[-10:] = ramp, tuple(-value for value in ramp)
    plan = driving.plan_of(scene, [control])
    log = simulate(scene, plan)
    assert off_m(log).max() < 0.05
    planned = driving.planned_J(scene, plan, "r1")
    turning, on_plain = (
        step_energy_parts(ground, plan.trajectories[0])[:, 1].sum()
        for ground in (scene, plain)
    )
    assert turning > 0.05 * planned
    assert turning == pytest.approx(factor * on_plain)
    assert measured_J(scene, log, 0) == pytest.approx(planned, rel=0.02)


@pytest.mark.parametrize("factor", [1.0, 2.5])
def test_turning_on_the_spot(driving: SimpleNamespace, factor: float) -> None:
    """There and back: no way along, and nothing but what turning takes."""
    plain = driving.open_ground([(0.0, 0.0, 0.0)], models=["diffdrive"])
    scene = resisting_turns(plain, factor)
    turn = np.repeat([1.0, 0.0, -1.0], [8, 40, 8])
    control = np.zeros((112, 2))
    control[:, 1] = np.concatenate([turn, -turn])
    plan = driving.plan_of(scene, [control])
    log = simulate(scene, plan)
    assert log.completed
    assert np.ptp(plan.trajectories[0].state[:, 2]) > 3.0
    assert off_m(log).max() < 0.01
    heading = (log.state - log.reference)[0, :, 2]
    assert np.abs(heading).max() < 0.03
    planned = driving.planned_J(scene, plan, "r1")
    assert metered_J(scene, log, 0) == pytest.approx(planned, rel=0.03)
    model = scene.robots[0].model
    turned = np.abs(np.diff(plan.trajectories[0].state[:, 2])).sum()
    way_m = model.track_m * turned
    assert planned == pytest.approx(
        factor * model.energy_model.turning_force_N * way_m / model.drive_efficiency
    )
    # The model leaves out what it takes to set the robot turning: 1 J each time.
    assert measured_J(scene, log, 0) == pytest.approx(planned, abs=2.5)


@pytest.mark.parametrize("model", model_names())
def test_a_standing_robot_does_no_work(driving: SimpleNamespace, model: str) -> None:
    scene = driving.open_ground([(0.0, 0.0, 0.0)], models=[model])
    log = simulate(scene, driving.plan_of(scene, [np.zeros((30, 2))]))
    assert np.abs(log.work_J).sum() < 1e-3
    assert off_m(log).max() < 1e-3


@pytest.mark.quick("car-1e-16", "diffdrive-0.0")
@pytest.mark.parametrize(
    ("model", "rounding"),
    [("car", 0.0), ("car", 1e-16), ("car", -1e-9), ("diffdrive", 0.0)],
)
def test_waiting_costs_nothing(
    driving: SimpleNamespace, model: str, rounding: float
) -> None:
    """A short hop between two long waits, as robots that make way for others do.

    The planned speed may come to rest at a rounding error instead of zero.
    """
    scene = driving.open_ground([(0.0, 0.0, 0.0)], models=[model])
    hop = np.array([[1.2, 0.0]] * 8 + [[0.0, 0.0]] * 5 + [[-1.2, 0.0]] * 8)
    wait = np.zeros((150, 2))
    exact = driving.plan_of(scene, [np.concatenate([wait, hop, wait])])
    state = exact.trajectories[0].state.copy()
    state[-150:, 3] = rounding
    driven = replace(exact.trajectories[0], state=state)
    plan = replace(exact, trajectories=(driven,))
    log = simulate(scene, plan)
    planned = driving.planned_J(scene, plan, "r1")
    assert log.clock_s[-1] == plan.makespan_s
    assert planned < 400.0
    assert off_m(log).max() < 0.02
    assert metered_J(scene, log, 0) == pytest.approx(planned, rel=0.02)
    assert measured_J(scene, log, 0) == pytest.approx(planned, rel=0.03)


def test_one_robot_waits_while_another_drives(driving: SimpleNamespace) -> None:
    """The waiting one is not touched; the driving one is corrected as ever."""
    scene = driving.open_ground([(0.0, 0.0, 0.0), (0.0, 20.0, 0.0)])
    controls = [np.zeros((120, 2)), driving.straight(12.0, 1.5)]
    log = simulate(scene, driving.plan_of(scene, controls))
    assert log.completed
    assert np.abs(log.work_J[0]).sum() < 1e-3
    assert off_m(log).max() < 0.02
    assert log.timing["controller_ms"]["median"] > 0


def test_a_plan_without_steps_ends_at_once(driving: SimpleNamespace) -> None:
    scene = driving.open_ground([(0.0, 0.0, 0.0)])
    log = simulate(scene, driving.plan_of(scene, [np.empty((0, 2))]))
    assert log.completed
    assert log.time_s[-1] == pytest.approx(1.0, abs=0.05)


def test_fleet_is_at_rest_at_the_end(wild_log: ExecutionLog) -> None:
    assert np.abs(wild_log.state[:, -1, 3]).max() < 0.005
    assert wild_log.time_s[-1] - 30.0 >= 1.0 - 1e-6


def wall_across(driving: SimpleNamespace, **wall: Any) -> tuple[Scene, Plan]:
    """A plan straight into a wall 6 m ahead of r1; r2 parks far away."""
    obstacle = {
        "id": "wall",
        "polygon": [[6, -3], [7, -3], [7, 3], [6, 3]],
        "height": 0.6,
        **wall,
    }
    scene = driving.open_ground(
        [(0.0, 0.0, 0.0), (0.0, 30.0, 0.0)], obstacles=[obstacle]
    )
    controls = [driving.straight(12.0, 1.5), np.zeros((120, 2))]
    return scene, driving.plan_of(scene, controls)


def test_driving_into_a_wall_is_recorded_and_ends_early(
    driving: SimpleNamespace,
) -> None:
    log = simulate(*wall_across(driving))
    assert not log.completed
    first = log.contacts[0]
    assert (first.robot, first.other) == ("r1", "wall")
    assert first.x_m == pytest.approx(6.0, abs=0.1)
    assert np.isfinite(log.state).all()


def test_a_wall_for_others_is_driven_through(driving: SimpleNamespace) -> None:
    log = simulate(*wall_across(driving, blocks=["r2"]))
    assert log.completed
    assert log.contacts == ()
    assert off_m(log).max() < 0.05


def test_the_fleet_waits_for_a_robot_that_is_held_up(driving: SimpleNamespace) -> None:
    """r1 pushes against a wall: the clock stops, and r2 with it."""
    scene, plan = wall_across(driving)
    both = [driving.straight(12.0, 1.5)] * 2
    log = simulate(scene, driving.plan_of(scene, both))
    assert not log.completed
    hit = np.searchsorted(log.time_s, log.contacts[0].time_s)
    assert log.clock_s[-1] < log.clock_s[hit] + 3.0
    late = log.time_s > log.contacts[0].time_s + 5.0
    assert np.abs(log.state[1, late, 3]).max() < 0.05
    assert off_m(log)[1].max() < 0.25


def test_two_robots_that_meet_are_both_named(driving: SimpleNamespace) -> None:
    scene = driving.open_ground([(-4.0, 0.0, 0.0), (4.0, 0.0, np.pi)])
    both = [driving.straight(6.0, 1.0)] * 2
    log = simulate(scene, driving.plan_of(scene, both))
    assert (log.contacts[0].robot, log.contacts[0].other) == ("r1", "r2")


def test_leaving_the_bounds_is_a_contact(driving: SimpleNamespace) -> None:
    scene = driving.open_ground([(0.0, 0.0, 0.0)], half_m=6.0)
    log = simulate(scene, driving.plan_of(scene, [driving.straight(8.0, 1.0)]))
    assert (log.contacts[0].robot, log.contacts[0].other) == ("r1", "bounds")


def test_a_plan_that_turns_to_no_number_ends_the_run(
    driving: SimpleNamespace, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And MuJoCo leaves no file of warnings where the command was run."""
    monkeypatch.chdir(tmp_path)
    scene = driving.open_ground([(0.0, 0.0, 0.0)])
    plan = driving.plan_of(scene, [driving.straight(4.0, 1.0)])
    state = plan.trajectories[0].state.copy()
    state[20:] = np.nan
    broken = replace(plan.trajectories[0], state=state)
    log = simulate(scene, replace(plan, trajectories=(broken,)))
    assert not log.completed
    assert log.time_s[-1] < 2.5
    assert list(tmp_path.iterdir()) == []


def test_progress_rises_to_the_end(
    wild_again: tuple[ExecutionLog, list[float]],
) -> None:
    _, seen = wild_again
    assert seen == sorted(seen)
    assert 0.0 < seen[0] < 0.1
    assert seen[-1] == 1.0


def test_another_scenes_plan_is_refused(
    driving: SimpleNamespace, wild: tuple[Scene, Plan]
) -> None:
    scene = driving.open_ground([(0.0, 0.0, 0.0)])
    with pytest.raises(UsageError, match="plan this scene anew"):
        simulate(scene, wild[1])


def test_a_plan_of_another_fleet_is_refused(wild: tuple[Scene, Plan]) -> None:
    scene, plan = wild
    for motions in ((), plan.trajectories[:1], plan.trajectories[::-1]):
        with pytest.raises(UsageError, match="plan of robots .*, the scene has"):
            simulate(scene, replace(plan, trajectories=motions))


def test_an_unknown_controller_is_refused(wild: tuple[Scene, Plan]) -> None:
    with pytest.raises(UsageError, match="allowed: mpc, pure_pursuit, tvlqr"):
        simulate(*wild, controller="none")


def test_a_robot_of_another_kind_is_refused(wild: tuple[Scene, Plan]) -> None:
    scene, plan = wild
    robot = scene.robots[0]
    model = replace(robot.model, motion_model="hovercraft")
    strange = replace(scene, robots=(replace(robot, model=model), *scene.robots[1:]))
    plan = replace(plan, scene_digest=strange.digest)
    with pytest.raises(UsageError, match="r1: model .* but not driven in MuJoCo"):
        mrmg.execute(strange, plan)


@pytest.mark.parametrize("robots", [4, 6])
def test_larger_fleets_use_the_sparse_solver_and_track_as_well(
    driving: SimpleNamespace, robots: int
) -> None:
    poses = [(0.0, 9.0 * index - 25.0, 0.0) for index in range(robots)]
    scene = driving.open_ground(poses)
    plan = driving.plan_of(scene, [driving.straight(6.0, 1.5)] * robots)
    log = simulate(scene, plan)
    assert log.completed
    assert off_m(log).max() < 0.05


def test_solves_with_active_bounds_are_counted_and_timed(
    driving: SimpleNamespace, tmp_path: Path
) -> None:
    """A start a metre off asks for more than the limits; being on the plan does not."""
    scene = driving.open_ground([(-20.0, 0.0, 0.0)])
    plan = driving.plan_of(scene, [driving.straight(12.0, 1.5, 1.0)])
    aside = DisturbanceRanges().draw(0, ["r1"])
    aside = replace(aside, robots=(replace(aside.robots[0], start_x_m=-1.2),))
    log = simulate(scene, plan, disturbance=aside)
    branches = log.timing["controller_ms"]
    assert log.bounded_solves == (branches["qp"]["calls"],)
    assert branches["qp"]["calls"] > 5
    assert branches["qp"]["median"] > branches["riccati"]["median"]
    log.save(tmp_path)
    assert ExecutionLog.load(tmp_path).bounded_solves == log.bounded_solves
    assert simulate(scene, plan, disturbance=aside).bounded_solves == log.bounded_solves
    lqr = simulate(scene, plan, controller="tvlqr")
    assert lqr.bounded_solves == (0,)
    assert lqr.timing["controller_ms"]["qp"] is None
    assert lqr.timing["controller_ms"]["median"] > 0.0


def test_touches_are_looked_for_after_every_step_of_the_physics(
    driving: SimpleNamespace, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A touch may be shorter than a tick, which has five steps of 4 ms."""
    seen_s, look = [], ContactWatch.look

    def noted(watch: ContactWatch, data: Any) -> None:
        seen_s.append(data.time)
        look(watch, data)

    monkeypatch.setattr(ContactWatch, "look", noted)
    scene = driving.open_ground([(0.0, 0.0, 0.0)])
    controls = np.repeat([[0.5, 0.0], [-0.5, 0.0]], 5, axis=0)
    log = simulate(scene, driving.plan_of(scene, [controls]))
    steps = round(log.time_s[-1] / 0.004)
    np.testing.assert_allclose(seen_s, 0.004 * np.arange(1, steps + 1))
