"""The energy model against hand calculation, and its two forms against each other."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mrmg.energy.model import PARTS, EnergyModel, battery_power

ROLLING, TURNING, INERTIA, GRADE, IDLE, DEVICE = range(len(PARTS))

MODEL = EnergyModel(
    rolling_force_N=100.0,
    turning_force_N=30.0,
    effective_mass_kg=200.0,
    weight_N=1900.0,
    drive_efficiency=0.8,
    regeneration_efficiency=0.5,
    idle_power_W=7.0,
    device_power_W=3.0,
)

motions = st.tuples(
    st.floats(-2.0, 2.0),  # speed
    st.floats(-1.5, 1.5),  # acceleration
    st.floats(0.0, 1.5),  # turn speed
    st.floats(0.2, 5.0),  # multiplier
    st.floats(-0.4, 0.4),  # climb
)


def parts_of(motion: tuple[float, ...], model: EnergyModel = MODEL) -> np.ndarray:
    return model.power_parts(*(np.array([value]) for value in motion))[0]


def test_every_part_of_pulling_uphill_by_hand() -> None:
    watts = parts_of((2.0, 0.5, 0.4, 3.0, 0.1))
    assert watts == pytest.approx([750.0, 15.0, 250.0, 237.5, 7.0, 3.0])


def test_braking_downhill_shares_what_is_fed_back() -> None:
    """600 + 12 - 200 - 760 = -348 W at the wheels feed 174 W back."""
    watts = parts_of((2.0, -0.5, 0.4, 3.0, -0.4))
    assert watts.sum() == pytest.approx(-174.0 + 10.0)
    assert watts[[ROLLING, TURNING]] == pytest.approx([750.0, 15.0])
    assert watts[GRADE] / watts[INERTIA] == pytest.approx(760.0 / 200.0)


@given(motions, st.floats(0.0, 1.0))
def test_parts_add_up_to_what_the_kernels_charge(
    motion: tuple[float, ...], regeneration: float
) -> None:
    model = replace(MODEL, regeneration_efficiency=regeneration)
    watts = parts_of(motion, model)
    assert watts.sum() == pytest.approx(
        battery_power(*motion, model.coefficients()), abs=1e-9
    )


@given(motions)
def test_stored_energy_never_comes_back_dearer_than_it_was_bought(
    motion: tuple[float, ...],
) -> None:
    """Inertia and grade are charged between regeneration and 1 / efficiency."""
    speed, acceleration, _, _, climb = motion
    watts = parts_of(motion)
    low, high = MODEL.regeneration_efficiency, 1.0 / MODEL.drive_efficiency
    for part, stored in (
        (INERTIA, MODEL.effective_mass_kg * acceleration * speed),
        (GRADE, MODEL.weight_N * climb),
    ):
        assert low * abs(stored) - 1e-9 <= abs(watts[part]) <= high * abs(stored) + 1e-9
        assert watts[part] * stored >= -1e-9


@given(motions)
def test_no_motion_draws_less_than_its_mechanical_power_over_the_efficiency(
    motion: tuple[float, ...],
) -> None:
    """What lower bounds rest on."""
    speed, acceleration, turn, multiplier, climb = motion
    mechanical = (
        100.0 * multiplier * abs(speed)
        + 30.0 * turn
        + 200.0 * acceleration * speed
        + 1900.0 * climb
    )
    assert parts_of(motion).sum() >= mechanical / 0.8 - 1e-9


@given(motions)
def test_the_papers_cost_is_distance_times_terrain_plus_turning(
    motion: tuple[float, ...],
) -> None:
    speed, _, turn, multiplier, _ = motion
    watts = parts_of(motion, MODEL.with_preset("paper"))
    assert watts[ROLLING] == pytest.approx(125.0 * multiplier * abs(speed))
    assert watts[TURNING] == pytest.approx(37.5 * turn)
    assert np.abs(watts[[INERTIA, GRADE, IDLE, DEVICE]]).max() < 1e-9


def test_presets_agree_on_plain_ground() -> None:
    paper = MODEL.with_preset("paper")
    assert paper.plain_ground_J_per_m() == MODEL.plain_ground_J_per_m()
    assert MODEL.with_preset("full") is MODEL


def test_standing_costs_the_consumers_alone() -> None:
    assert parts_of((0.0, 0.0, 0.0, 3.0, 0.0)).tolist() == [0, 0, 0, 0, 7.0, 3.0]
