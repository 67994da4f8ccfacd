"""The verifier's account of energy against the planner's, on motions nobody planned."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mrmg.energy import metering
from mrmg.energy.visits import crowded_stations, is_at, runs
from mrmg.plans import Trajectory
from mrmg.scene.elevation import Elevation
from mrmg.scene.types import Robot, Scene, TerrainArea
from mrmg.verification import energy
from mrmg.verification.energy import account_of, longest_stay_s, shared_stays

BOUNDS = (0.0, 0.0, 40.0, 20.0)
TARGETS = {
    "goals": [
        {"id": "a", "circle": {"center": [10, 10], "radius": 4}},
        {"id": "b", "circle": {"center": [24, 12], "radius": 5}, "dwell": 0.7},
        {
            "id": "c",
            "circle": {"center": [20, 10], "radius": 6},
            "heading": 3.0,
            "heading_tolerance": 1.0,
        },
    ],
    "stations": [
        {"id": "s", "circle": {"center": [18, 8], "radius": 5}, "dwell": 0.4},
        {"id": "t", "circle": {"center": [30, 10], "radius": 6}},
    ],
}


def longest_by_planner(target, time_s: np.ndarray, poses: np.ndarray) -> float:
    stays = runs(is_at(target, poses))
    return max(
        (float(time_s[end - 1] - time_s[first]) for first, end in stays),
        default=-np.inf,
    )


def random_scene(make_scene: Any, rng: np.random.Generator) -> Scene:
    """A scene of overlapping terrain, perhaps slopes, and robots of any parameters."""
    kinds = ("car", "diffdrive", "hauler")
    robots = [
        {"id": f"r{i}", "model": str(rng.choice(kinds)), "pose": [5, 5 + 8 * i, 0]}
        for i in range(2)
    ]
    scene = make_scene(**TARGETS, robots=robots)
    terrain = tuple(
        TerrainArea(
            id=f"t{i}",
            shape=shapely.Point(rng.uniform([0, 0], [40, 20])).buffer(6.0, 3),
            multiplier=float(rng.uniform(0.5, 4.0)),
            turning_multiplier=float(rng.uniform(0.5, 4.0)),
        )
        for i in range(rng.integers(0, 5))
    )
    elevation = None
    if rng.random() < 0.5:
        height_m = rng.uniform(-1.0, 1.0, rng.integers(2, 7, 2))
        elevation = Elevation(bounds=BOUNDS, height_m=height_m)
    owned = tuple(random_robot(robot, rng) for robot in scene.robots)
    return replace(scene, terrain=terrain, elevation=elevation, robots=owned)


def random_robot(robot: Robot, rng: np.random.Generator) -> Robot:
    model = replace(
        robot.model,
        energy_preset=str(rng.choice(["full", "paper"])),
        regeneration_efficiency=float(rng.choice([0.0, 0.6])),
        idle_power_W=float(rng.choice([0.0, 12.0])),
        device_power_W=float(rng.choice([0.0, 30.0])),
        turning_coefficient=float(rng.uniform(0.0, 0.2)),
    )
    battery = replace(
        robot.battery,
        capacity_J=float(rng.uniform(500.0, 20_000.0)),
        start_J=400.0,
        charging_power_W=float(rng.choice([math.inf, 300.0])),
    )
    return replace(robot, model=model, battery=battery)


def random_motion(robot: Robot, rng: np.random.Generator) -> Trajectory:
    """Any states whatever: neither account asks how they came about."""
    dt_s = float(rng.choice([0.1, 0.1, 0.03, 0.25]))
    steps = int(rng.integers(1, 160))
    walk = rng.normal(0.0, [1.0, 0.5, 0.3, 0.6, 0.4], (steps + 1, 5)).cumsum(axis=0)
    state = walk * 0.6 + [5.0, 9.0, 0.0, 0.0, 0.0]
    state[:, 0] += np.linspace(0.0, 30.0, steps + 1)
    state[rng.random(steps + 1) < 0.2, 3] = 0.0
    state[:, 4] = np.clip(state[:, 4], -1.2, 1.2)
    return Trajectory(
        robot=robot.id, dt_s=dt_s, state=state, control=np.zeros((steps, 2))
    )


@settings(
    max_examples=120,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
@given(seed=st.integers(0, 2**32 - 1))
def test_both_accounts_agree(make_scene: Any, seed: int) -> None:
    """Two ways to write one rule: nothing but rounding lies between them."""
    rng = np.random.default_rng(seed)
    scene = random_scene(make_scene, rng)
    robot = scene.robots[0]
    motion = random_motion(robot, rng)
    tour = tuple(map(str, rng.choice(list("abcst"), rng.integers(0, 6))))
    own = account_of(scene, motion, tour)
    visits = metering.find_visits(scene, motion, tour)
    places = [(visit.target, visit.kind, visit.step) for visit in own.visits]
    assert places == [(visit.target, visit.kind, visit.step) for visit in visits]
    close = {"rel": 1e-9, "abs": 1e-8}
    arrivals = [visit.energy_J for visit in own.visits]
    assert arrivals == pytest.approx([visit.energy_J for visit in visits], **close)
    content_J = metering.battery_profile(scene, motion, visits)
    np.testing.assert_allclose(own.content_J, content_J, rtol=1e-9, atol=1e-8)
    entries = {
        (entry.leg, entry.target, entry.part): entry.energy_J
        for entry in metering.plan_ledger(scene, [motion], visits).entries
    }
    assert dict(own.entries()) == pytest.approx(entries, **close)


@settings(
    max_examples=40,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
@given(seed=st.integers(0, 2**32 - 1))
def test_both_see_the_same_stays(make_scene: Any, seed: int) -> None:
    rng = np.random.default_rng(seed)
    scene = make_scene(
        **{
            **TARGETS,
            "stations": [{**item, "capacity": 1} for item in TARGETS["stations"]],
            "robots": [
                {"id": "r0", "model": "car", "pose": [5, 5, 0]},
                {"id": "r1", "model": "car", "pose": [5, 13, 0]},
            ],
        }
    )
    one = random_motion(scene.robots[0], rng)
    other = replace(
        one, robot="r1", state=one.state + rng.normal(0.0, 2.0, one.state.shape)
    )
    for target in scene.targets():
        theirs = longest_by_planner(target, one.time_s, one.state)
        assert longest_stay_s(target, one) == pytest.approx(theirs)
    parts, last = energy.INSTANTS, len(one.state) - 1
    fine = np.arange(parts * last + 1) / parts
    ways = {
        item.robot: np.stack(
            [np.interp(fine, np.arange(last + 1), item.state[:, i]) for i in (0, 1)],
            axis=1,
        )
        for item in (one, other)
    }
    theirs = {
        (item.station, instant // parts)
        for item in crowded_stations(scene, ways)
        for instant in range(item.first, item.end)
    }
    own = {
        (station.id, step)
        for station in scene.stations
        for _, _, run in shared_stays(station, [one, other])
        for step in range(*run)
    }
    assert own == theirs


def test_who_crosses_a_narrow_station_between_two_states_is_seen(
    make_scene: Any,
) -> None:
    """Both cars cross a strip 0.14 m wide at 2 m/s within one step."""
    strip = [[10.03, 5], [10.17, 5], [10.17, 15], [10.03, 15]]
    scene = make_scene(stations=[{"id": "s", "polygon": strip, "capacity": 1}])
    state = np.zeros((11, 5))
    state[:, 0] = 9.0 + 0.2 * np.arange(11)
    one, other = (
        Trajectory(
            robot=name, dt_s=0.1, state=state + [0, y, 0, 2, 0], control=state[1:, :2]
        )
        for name, y in (("r1", 7.0), ("r2", 12.0))
    )
    (found,) = shared_stays(scene.stations[0], [one, other])
    assert found[2] == (5, 6)
    late = replace(other, state=other.state - [0.2, 0, 0, 0, 0])
    assert not list(shared_stays(scene.stations[0], [one, late]))


def test_a_straight_drive_costs_what_its_closed_form_says(case: Any) -> None:
    scene, plan = case()
    model = scene.robots[0].model
    account = account_of(scene, plan.trajectories[0], ("g",))
    sums_J = dict(zip(energy.PARTS, account.parts_J.sum(axis=0), strict=True))
    weight_N = model.mass_kg * 9.81
    rolled_J = model.rolling_coefficient * weight_N * 12.0 / model.drive_efficiency
    # Braking from 1 m/s gives less than rolling takes: the rest of it is paid for.
    assert sums_J["rolling"] == pytest.approx(rolled_J, rel=1e-9)
    assert sums_J["turning"] == sums_J["grade"] == sums_J["idle"] == 0.0
    assert account.content_J[0] - account.content_J[-1] == pytest.approx(
        sum(sums_J.values())
    )
