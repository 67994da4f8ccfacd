"""Energies in closed form, on motions written down by hand."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mrmg.energy.metering import (
    TimedStates,
    battery_content,
    battery_profile,
    find_visits,
    leg_entries,
    plan_ledger,
    step_energy_parts,
)
from mrmg.energy.model import PARTS
from mrmg.plans import Visit
from mrmg.scene.loading import scene_from_document
from mrmg.scene.types import Scene

ROLLING, TURNING, INERTIA, GRADE, IDLE, DEVICE = range(len(PARTS))


def make_scene(**changes: Any) -> Scene:
    """A 100 m strip; mud of multiplier 3 from x = 50, deeper mud of 5 from x = 80."""
    document = {
        "format": 1,
        "name": "strip",
        "bounds": [0, -50, 100, 50],
        "goals": [
            {"id": "g1", "circle": {"center": [20, 0], "radius": 1}},
            {"id": "g2", "circle": {"center": [60, 0], "radius": 1}},
        ],
        "stations": [{"id": "s", "circle": {"center": [40, 0], "radius": 2}}],
        "terrain": [
            {"id": "mud", "polygon": _stripe(50, 100), "multiplier": 3.0},
            {"id": "deep", "polygon": _stripe(80, 100), "multiplier": 5.0},
        ],
        "battery": {"capacity_J": 30000, "reserve": 0.1},
        "robots": [{"id": "r", "model": "car", "pose": [5, 0, 0]}],
    }
    return scene_from_document({**document, **changes}, source="strip")


def _stripe(low: float, high: float) -> list[list[float]]:
    return [[low, -50], [high, -50], [high, 50], [low, 50]]


@pytest.fixture
def scene() -> Scene:
    return make_scene()


def along(
    x_m: np.ndarray,
    v_m_s: np.ndarray,
    time_s: np.ndarray,
    psi_rad: float = 0.0,
) -> TimedStates:
    """Return a motion along the strip's middle line."""
    state = np.zeros((len(time_s), 5))
    state[:, 0], state[:, 3], state[:, 4] = x_m, v_m_s, psi_rad
    return TimedStates(robot="r", time_s=time_s, state=state)


def cruise(start_m: float, end_m: float, speed_m_s: float = 1.0) -> TimedStates:
    time_s = np.arange(0.0, (end_m - start_m) / speed_m_s + 0.05, 0.1)
    return along(start_m + speed_m_s * time_s, np.full(len(time_s), speed_m_s), time_s)


def test_cruise_on_plain_ground_costs_rolling_alone(scene: Scene) -> None:
    model = scene.robots[0].model.energy_model
    energy_J = step_energy_parts(scene, cruise(5, 45)).sum(axis=0)
    assert energy_J[ROLLING] == pytest.approx(40 * model.plain_ground_J_per_m())
    assert np.abs(energy_J[[TURNING, INERTIA, GRADE, IDLE, DEVICE]]).max() < 1e-9


def test_terrain_multiplies_and_the_later_area_counts(scene: Scene) -> None:
    per_m_J = scene.robots[0].model.energy_model.plain_ground_J_per_m()
    energy_J = step_energy_parts(scene, cruise(45, 95)).sum()
    assert energy_J == pytest.approx((5 * 1 + 30 * 3 + 15 * 5) * per_m_J)


def test_turning_costs_by_the_tangent_of_the_steering_angle(scene: Scene) -> None:
    model = scene.robots[0].model.energy_model
    time_s = np.arange(0.0, 4.05, 0.1)
    motion = along(10 + time_s, np.ones(len(time_s)), time_s, psi_rad=-0.4)
    energy_J = step_energy_parts(scene, motion)[:, TURNING].sum()
    expected_J = model.turning_force_N * np.tan(0.4) * 4.0 / model.drive_efficiency
    assert energy_J == pytest.approx(expected_J)


def test_a_unicycle_turns_by_its_yaw_rate_even_on_the_spot(scene: Scene) -> None:
    model = replace(scene.robots[0].model, motion_model="unicycle")
    unicycle = replace(scene, robots=(replace(scene.robots[0], model=model),))
    time_s = np.arange(0.0, 4.05, 0.1)
    motion = along(np.full(41, 10.0), np.zeros(41), time_s, psi_rad=-0.4)
    energy_J = step_energy_parts(unicycle, motion).sum(axis=0)
    force_N = model.energy_model.turning_force_N / model.drive_efficiency
    assert energy_J[TURNING] == pytest.approx(force_N * model.track_m * 0.4 * 4.0)
    assert energy_J[ROLLING] == 0.0


@given(st.floats(0.1, 1.5), st.integers(1, 40))
def test_speeding_up_costs_its_kinetic_energy(accel: float, n: int) -> None:
    """However finely the same motion is logged."""
    scene = make_scene()
    model = scene.robots[0].model.energy_model
    time_s = np.linspace(0.0, 1.0, n + 1)
    motion = along(10 + accel * time_s**2 / 2, accel * time_s, time_s)
    energy_J = step_energy_parts(scene, motion).sum(axis=0)
    kinetic_J = model.effective_mass_kg * accel**2 / 2
    assert energy_J[INERTIA] == pytest.approx(kinetic_J / model.drive_efficiency)
    rolling_J = model.plain_ground_J_per_m() * accel / 2
    assert energy_J[ROLLING] == pytest.approx(rolling_J)


@pytest.mark.parametrize("multiplier", [1.0, 2.0, 4.0])
def test_a_straight_line_costs_by_the_terrain(multiplier: float) -> None:
    field = {"id": "field", "polygon": _stripe(0, 100), "multiplier": multiplier}
    scene = make_scene(terrain=[field])
    energy_J = step_energy_parts(scene, cruise(5, 45)).sum()
    per_m_J = scene.robots[0].model.energy_model.plain_ground_J_per_m()
    assert energy_J == pytest.approx(multiplier * 40 * per_m_J)


@pytest.mark.parametrize("regeneration", [0.0, 0.5])
def test_a_drive_cycle_pays_for_its_top_speed_once(regeneration: float) -> None:
    """Speed up at 1 m/s^2 to 1.5 m/s, go on for 8 s, brake at 1 m/s^2."""
    scene = with_model(make_scene(terrain=[]), regeneration_efficiency=regeneration)
    model = scene.robots[0].model
    time_s = np.arange(0.0, 11.05, 0.1)
    v_m_s = np.minimum(np.minimum(time_s, 1.5), np.maximum(11.0 - time_s, 0.0))
    x_m = 5 + np.concatenate([[0.0], np.cumsum(0.05 * (v_m_s[1:] + v_m_s[:-1]))])
    energy_J = step_energy_parts(scene, along(x_m, v_m_s, time_s)).sum()
    kinetic_J = 0.5 * model.effective_mass_kg * 1.5**2
    rolling_N = model.energy_model.rolling_force_N
    pulled_J = kinetic_J + rolling_N * (x_m[-1] - 5 - 1.125)
    braked_J = kinetic_J - rolling_N * 1.125
    expected_J = pulled_J / model.drive_efficiency - regeneration * braked_J
    assert energy_J == pytest.approx(expected_J)


def with_model(scene: Scene, **changes: float) -> Scene:
    model = replace(scene.robots[0].model, **changes)  # type: ignore[arg-type]
    return replace(scene, robots=(replace(scene.robots[0], model=model),))


def sloping(grade: float, **changes: float) -> Scene:
    """The strip without mud, rising evenly from west to east."""
    ramp = {"grid": [[0.0, 100.0 * grade]] * 2}
    return with_model(make_scene(terrain=[], elevation=ramp), **changes)


@pytest.mark.parametrize("grade", [0.04, 0.15])
def test_climbing_a_ramp_costs_its_height(grade: float) -> None:
    scene = sloping(grade)
    model = scene.robots[0].model.energy_model
    energy_J = step_energy_parts(scene, cruise(5, 45)).sum(axis=0)
    assert energy_J[ROLLING] == pytest.approx(40 * model.plain_ground_J_per_m())
    expected_J = model.weight_N * 40 * grade / model.drive_efficiency
    assert energy_J[GRADE] == pytest.approx(expected_J)
    assert np.abs(energy_J[[TURNING, INERTIA, IDLE, DEVICE]]).max() < 1e-6


@pytest.mark.parametrize("regeneration", [0.0, 0.6])
@pytest.mark.parametrize("grade", [-0.04, -0.15])
def test_rolling_down_a_ramp_never_earns_more_than_is_fed_back(
    grade: float, regeneration: float
) -> None:
    """4 % down still pulls; 15 % down brakes."""
    scene = sloping(grade, regeneration_efficiency=regeneration)
    model = scene.robots[0].model.energy_model
    energy_J = step_energy_parts(scene, cruise(5, 45)).sum(axis=0)
    mechanical_J = 40 * (model.rolling_force_N + model.weight_N * grade)
    expected_J = (
        mechanical_J / model.drive_efficiency
        if mechanical_J > 0.0
        else regeneration * mechanical_J
    )
    assert energy_J.sum() == pytest.approx(expected_J, abs=1e-6)
    assert energy_J[ROLLING] == pytest.approx(40 * model.plain_ground_J_per_m())


def test_over_a_hill_what_is_not_braked_away_comes_back() -> None:
    """On gentle slopes a way over a hill costs what it costs on the flat."""
    hill = {"hills": [{"center": [30, 0], "height": 0.5, "radius": 20}]}
    scene = make_scene(terrain=[], elevation=hill)
    per_m_J = scene.robots[0].model.energy_model.plain_ground_J_per_m()
    energy_J = step_energy_parts(scene, cruise(5, 55)).sum(axis=0)
    assert energy_J.sum() == pytest.approx(50 * per_m_J)
    assert energy_J[GRADE] == pytest.approx(0.0, abs=1e-6)


def test_on_slopes_shaking_within_a_step_does_not_count() -> None:
    """Down 5 %, speed shakes by 1 cm/s from tick to tick."""
    scene = sloping(-0.05)
    steady = cruise(5, 45)
    fine_s = np.arange(0.0, 40.001, 0.02)
    shaking = np.ones(len(fine_s))
    shaking[1::2] += 0.01
    shaking[::5] = 1.0
    motion = along(5 + fine_s, shaking, fine_s)
    expected_J = step_energy_parts(scene, steady).sum()
    assert step_energy_parts(scene, motion).sum() == pytest.approx(expected_J, rel=1e-3)
    assert len(step_energy_parts(scene, motion)) == len(fine_s) - 1


def test_hard_braking_costs_nothing_without_regeneration(scene: Scene) -> None:
    time_s = np.linspace(0.0, 1.0, 11)
    motion = along(10 + 1.2 * time_s - 0.6 * time_s**2, 1.2 - 1.2 * time_s, time_s)
    assert step_energy_parts(scene, motion).sum(axis=1) == pytest.approx(0.0, abs=1e-9)


def test_energy_is_power_times_duration_of_uneven_steps(scene: Scene) -> None:
    """At a steady speed on one ground the power is the same throughout."""
    time_s = np.array([0.0, 0.1, 0.4, 0.41])
    motion = along(10 + time_s, np.ones(4), time_s)
    energy_J = step_energy_parts(scene, motion)
    power_W = energy_J.sum(axis=0) / 0.41
    assert power_W.sum() > 0.0
    assert energy_J == pytest.approx(power_W * np.array([[0.1], [0.3], [0.01]]))


def test_visits_are_first_states_inside_in_order_of_the_tour(scene: Scene) -> None:
    motion = cruise(5, 65)
    visits = find_visits(scene, motion, ("g1", "s", "g2"))
    assert [(visit.target, visit.kind) for visit in visits] == [
        ("g1", "goal"),
        ("s", "station"),
        ("g2", "goal"),
    ]
    for visit, edge_m in zip(visits, (19.0, 38.0, 59.0), strict=True):
        x_m = motion.state[visit.step, 0]
        assert edge_m - 1e-9 <= x_m < edge_m + 0.1 + 1e-9
        assert visit.time_s == pytest.approx(0.1 * visit.step)


def test_target_that_is_passed_too_early_is_left_out(scene: Scene) -> None:
    visits = find_visits(scene, cruise(5, 65), ("s", "g1", "g2"))
    assert [visit.target for visit in visits] == ["s", "g2"]


def test_one_state_may_serve_overlapping_targets() -> None:
    overlapping = [
        {"id": "g1", "circle": {"center": [20, 0], "radius": 1}},
        {"id": "g2", "circle": {"center": [20, 0], "radius": 1}},
    ]
    visits = find_visits(make_scene(goals=overlapping), cruise(5, 30), ("g1", "g2"))
    assert visits[0].step == visits[1].step


def test_unknown_target_is_an_error(scene: Scene) -> None:
    with pytest.raises(KeyError, match="nowhere"):
        find_visits(scene, cruise(5, 30), ("nowhere",))


def test_battery_falls_by_the_draw_and_is_full_after_the_station(scene: Scene) -> None:
    motion = cruise(5, 65)
    visits = find_visits(scene, motion, ("g1", "s", "g2"))
    content_J = battery_profile(scene, motion, visits)
    per_m_J = scene.robots[0].model.energy_model.plain_ground_J_per_m()
    station = visits[1]
    travelled_m = motion.state[:, 0] - 5
    before = slice(0, station.step)
    assert content_J[before] == pytest.approx(30000 - per_m_J * travelled_m[before])
    assert content_J[station.step] == 30000
    assert station.energy_J == pytest.approx(
        30000 - per_m_J * travelled_m[station.step]
    )
    spent_J = step_energy_parts(scene, motion)[station.step :].sum()
    assert content_J[-1] == pytest.approx(30000 - spent_J)


def test_battery_never_holds_more_than_its_capacity(scene: Scene) -> None:
    still = TimedStates(robot="r", time_s=np.arange(4.0), state=np.zeros((4, 5)))
    content_J, _ = battery_content(scene, still, np.array([-50.0, 20.0, -50.0]), [])
    assert content_J.tolist() == [30000.0, 30000.0, 29980.0, 30000.0]


DRAWS_J = st.floats(-3000.0, 3000.0)


@given(
    st.lists(DRAWS_J, min_size=1, max_size=40),
    st.dictionaries(st.integers(0, 40), st.floats(0.0, 30000.0), max_size=3),
    st.sets(st.integers(0, 40), max_size=3),
)
def test_battery_is_reckoned_step_by_step(
    draws_J: list[float], reckoned_J: dict[int, float], stops: set[int]
) -> None:
    scene, n = make_scene(), len(draws_J)
    reckoned_J = {step: held_J for step, held_J in reckoned_J.items() if step <= n}
    stops = {step for step in stops if step <= n}
    motion = TimedStates(
        robot="r", time_s=np.arange(n + 1.0), state=np.zeros((n + 1, 5))
    )
    visits = [Visit("r", "s", "station", at, float(at), 0.0) for at in sorted(stops)]
    found = battery_content(scene, motion, np.array(draws_J), visits, reckoned_J)
    content_J, arrival_J, held_J = [], [], 30000.0
    for step, draw_J in enumerate([*draws_J, 0.0]):
        held_J = reckoned_J.get(step, held_J)
        if step in stops:
            arrival_J.append(held_J)
            held_J = 30000.0
        content_J.append(held_J)
        held_J = min(held_J - draw_J, 30000.0)
    assert found[0].tolist() == content_J
    assert found[1] == arrival_J


def test_visits_of_other_robots_do_not_recharge() -> None:
    robots = [
        {"id": "r", "model": "car", "pose": [5, 0, 0]},
        {"id": "q", "model": "car", "pose": [5, 9, 0]},
    ]
    scene = make_scene(robots=robots)
    motion = cruise(5, 65)
    others = find_visits(
        scene,
        TimedStates(robot="q", time_s=motion.time_s, state=motion.state),
        ("s",),
    )
    assert (np.diff(battery_profile(scene, motion, others)) <= 0).all()


def test_ledger_has_every_leg_and_part_and_adds_up(scene: Scene) -> None:
    motion = cruise(5, 65)
    visits = find_visits(scene, motion, ("g1", "s", "g2"))
    ledger = plan_ledger(scene, [motion], visits)
    assert [(e.leg, e.target) for e in ledger.entries[:: len(PARTS)]] == [
        (0, "g1"),
        (1, "s"),
        (2, "g2"),
        (3, ""),
    ]
    assert ledger.parts() == PARTS
    assert ledger.total_J() == pytest.approx(step_energy_parts(scene, motion).sum())


@given(st.lists(st.integers(0, 30), max_size=6), st.integers(0, 2**32 - 1))
def test_legs_share_out_all_intervals(steps: list[int], seed: int) -> None:
    """Wherever visits fall, no joule is lost or counted twice."""
    scene = make_scene()
    (visit,) = find_visits(scene, cruise(5, 30), ("g1",))
    visits = [replace(visit, step=step) for step in sorted(steps)]
    energy_J = np.random.default_rng(seed).integers(-50, 50, (30, 2)).astype(float)
    entries = leg_entries("r", energy_J, ("drive", "idle"), visits)
    assert len(entries) == 2 * (len(steps) + 1)
    assert sum(entry.energy_J for entry in entries) == energy_J.sum()


def test_more_rolling_resistance_is_that_of_another_model(scene: Scene) -> None:
    """A factor over half of the way is the model with it over that half."""
    motion = cruise(5, 95)
    half = (len(motion.time_s) - 1) // 2
    factor = np.where(np.arange(len(motion.time_s) - 1) < half, 1.0, 1.3)
    entry = {"id": "r", "model": "car", "pose": [5, 0, 0], "rolling_factor": 1.3}
    worn = step_energy_parts(make_scene(robots=[entry]), motion)
    plain = step_energy_parts(scene, motion)
    mixed = step_energy_parts(scene, motion, factor)
    np.testing.assert_array_equal(mixed[:half], plain[:half])
    np.testing.assert_allclose(mixed[half:], worn[half:], rtol=1e-12, atol=1e-9)
    ledger = plan_ledger(scene, [motion], [], {"r": factor})
    assert ledger.total_J() == pytest.approx(mixed.sum())
