"""The numbers behind the report's charts, against audit, verdict and plan."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from mrmg.energy.audit import audit
from mrmg.energy.battery_curves import measured_curves
from mrmg.report.charts import chart_data
from mrmg.report.map import mission_map
from mrmg.simulation.disturbance import Disturbance, RobotDisturbance


@pytest.fixture
def mission(make_scene, make_plan, make_log, straight):
    scene = make_scene(
        stations=[{"id": "s", "circle": {"center": [10, 10], "radius": 1}}],
        robots=[
            {"id": "r1", "model": "car", "pose": [5, 10, 0]},
            {"id": "r2", "model": "car", "pose": [5, 15, 0]},
        ],
    )
    controls = {"r1": straight(12.0), "r2": straight(12.0)}
    plan = make_plan(scene, controls, {"r1": ("s", "g"), "r2": ()})
    return scene, plan, make_log(scene, plan)


def chart(data, name):
    return next(item for item in data["charts"] if item["id"] == name)


def test_every_series_has_a_value_or_null_at_every_time(mission) -> None:
    data = chart_data(*mission)
    json.dumps(data, allow_nan=False)
    times = len(data["time_s"])
    for item in data["charts"]:
        assert {len(series["values"]) for series in item["series"]} == {times}
    for robot in data["robots"]:
        for name in ("x", "y", "turn"):
            assert len(robot[name]) == times


def test_poses_are_those_of_the_map_whose_y_points_down(mission) -> None:
    scene, plan, log = mission
    robot = chart_data(*mission)["robots"][1]
    assert (robot["x"][0], robot["y"][0]) == (5.0, 20.0 - 15.0)
    assert robot["x"][-1] == pytest.approx(log.state[1, -1, 0], abs=0.01)


def test_simulated_charge_ends_where_the_audit_does(mission) -> None:
    scene, plan, log = mission
    account = audit(scene, plan, log)
    curves = measured_curves(scene, plan, log)
    for curve in curves:
        capacity_J = scene.robot(curve.robot).battery.capacity_J
        least_J = min(curve.energy_J.min(), *(v.energy_J for v in curve.visits), 1e9)
        wanted = account.robot(curve.robot).min_charge_fraction
        assert least_J / capacity_J == pytest.approx(wanted)
    shown = chart(chart_data(*mission), "charge-r1")
    assert shown["range"] == (0, 100)  # the page widens it to round numbers
    lines = shown["series"]
    assert [line["label"] for line in lines] == ["planned", "simulated", "reserve"]
    assert lines[1]["values"][0] == 100.0
    last = 100.0 * curves[0].energy_J[-1] / scene.robot("r1").battery.capacity_J
    assert lines[1]["values"][-1] == pytest.approx(last, abs=0.01)
    assert set(lines[2]["values"]) == {5.0}


def test_charge_is_that_of_the_battery_a_robot_really_has(mission) -> None:
    scene, plan, log = mission
    own = tuple(RobotDisturbance(robot=name, capacity=-0.5) for name in log.robots)
    log = replace(log, disturbance=Disturbance(seed=0, robots=own))
    _, simulated, reserve = chart(chart_data(scene, plan, log), "charge-r2")["series"]
    assert simulated["values"][0] == 100.0
    least = 100.0 * audit(scene, plan, log).robot("r2").min_charge_fraction
    assert min(simulated["values"]) == pytest.approx(least, abs=0.01)
    assert set(reserve["values"]) == {10.0}  # it is the same in joules


def test_a_short_peak_of_tracking_error_is_not_lost_between_samples(mission) -> None:
    scene, plan, log = mission
    reference = log.reference.copy()
    reference[0, 137, 1] += 0.25
    data = chart_data(scene, plan, replace(log, reference=reference))
    values = chart(data, "tracking")["series"][0]["values"]
    assert max(values) == pytest.approx(25.0, abs=0.01)
    assert data["time_s"][int(np.argmax(values))] == pytest.approx(
        log.time_s[137], abs=0.1
    )


def test_robots_side_by_side_keep_their_distance(mission) -> None:
    scene, *_ = mission
    width_m = np.ptp(scene.robots[0].model.footprint_m[:, 1])
    for line in chart(chart_data(*mission), "robots")["series"]:
        assert line["values"] == pytest.approx([5.0 - width_m] * len(line["values"]))


def test_a_plan_alone_has_charts_of_the_plan(mission) -> None:
    scene, plan, _ = mission
    data = chart_data(scene, plan, None)
    assert "tracking" not in {item["id"] for item in data["charts"]}
    lines = chart(data, "charge-r1")["series"]
    assert [line["label"] for line in lines] == ["planned", "reserve"]
    visit_s = {visit.target: visit.time_s for visit in plan.visits}
    assert data["visited_s"] == {"g": pytest.approx(visit_s["g"], abs=0.01)}


def test_robots_turn_clockwise_on_a_map_whose_y_points_down(
    make_scene, make_plan, straight
) -> None:
    scene = make_scene(robots=[{"id": "r1", "model": "car", "pose": [5, 5, 0.5]}])
    plan = make_plan(scene, {"r1": straight(4.0)}, {"r1": ()})
    (robot,) = chart_data(scene, plan, None)["robots"]
    assert robot["turn"][0] == pytest.approx(-np.degrees(0.5), abs=0.1)
    assert f"rotate({-np.degrees(0.5):.2f})" in mission_map(scene, plan, None)


def test_where_the_simulation_ended_early_its_lines_end(mission) -> None:
    scene, plan, log = mission
    half = len(log.time_s) // 2
    cut = replace(
        log,
        completed=False,
        time_s=log.time_s[:half],
        clock_s=log.clock_s[:half],
        state=log.state[:, :half],
        reference=log.reference[:, :half],
        work_J=log.work_J[:, : half - 1],
    )
    data = chart_data(scene, plan, cut)
    planned, simulated, _ = chart(data, "charge-r1")["series"]
    assert None not in planned["values"]
    ended = [value is None for value in simulated["values"]]
    after = [time_s > log.time_s[half - 1] for time_s in data["time_s"]]
    assert ended == after
