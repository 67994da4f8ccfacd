"""What slopes cost: potentials, floors and the lower bound of climbing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from shapely.geometry import Point, box

from mrmg.planning.roadmap.slopes import (
    DESCENT_SHARE,
    SlopeCost,
    climb_J,
    height_span_m,
)
from mrmg.scene.loading import scene_from_document
from mrmg.scene.robot_model import RobotModel
from mrmg.scene.types import Scene


def make_scene(**parts: object) -> Scene:
    document = {
        "format": 1,
        "name": "ramp",
        "bounds": [0, 0, 40, 20],
        "robots": [{"id": "r1", "model": "car", "pose": [5, 10, 0]}],
        **parts,
    }
    return scene_from_document(document, source="ramp")


RAMP = make_scene(elevation={"grid": [[0, 1, 4], [0, 1, 4]]})


def car(**changes: float) -> RobotModel:
    return replace(RAMP.robots[0].model, **changes)  # type: ignore[arg-type]


@given(
    st.floats(0.0, 1.0),
    st.floats(0.05, 10.0),
    st.floats(-2.0, 2.0),
)
def test_reduced_costs_are_the_batterys_less_a_potential(
    regeneration: float, way_m: float, rise_m: float
) -> None:
    """Where the floor for descents does not count."""
    model = car(regeneration_efficiency=regeneration)
    slope = SlopeCost.of(RAMP, model)
    energy = model.energy_model
    mechanical_J = energy.rolling_force_N * way_m + energy.weight_N * rise_m
    battery_J = (
        mechanical_J / energy.drive_efficiency
        if mechanical_J > 0.0
        else mechanical_J * regeneration
    )
    exact_m = battery_J / energy.plain_ground_J_per_m()
    reduced_m = max(way_m + slope.price * rise_m, slope.floor * way_m)
    assert reduced_m > 0.0
    told_m = reduced_m + slope.refund * rise_m
    assert told_m >= exact_m - 1e-9
    if (
        regeneration * energy.drive_efficiency >= DESCENT_SHARE
        or mechanical_J >= 0.1 * (energy.rolling_force_N * way_m)
    ):
        assert told_m == pytest.approx(exact_m, abs=1e-9)


def test_flat_ground_is_the_same_for_all_and_the_paper_knows_no_slopes() -> None:
    flat = make_scene()
    assert SlopeCost.of(flat, car()) == SlopeCost.of(flat, car(mass_kg=10.0))
    assert SlopeCost.of(RAMP, car()).price == pytest.approx(1.0 / 0.06)
    paper = replace(car(), energy_preset="paper")
    assert SlopeCost.of(RAMP, paper).price == 0.0
    assert climb_J(replace(RAMP.robots[0], model=paper), 2.0) == 0.0


def test_heights_of_places_take_the_load_ahead_into_account() -> None:
    robot = RAMP.robots[0]
    low_m, high_m = height_span_m(RAMP, robot, Point(20.0, 10.0))
    reach_m = robot.model.center_of_mass_m
    assert low_m <= 1.0 - 0.05 * reach_m
    assert high_m >= 1.0 + 0.15 * reach_m
    assert height_span_m(RAMP, robot, box(0, 0, 40, 20)) == (0.0, 4.0)
    assert height_span_m(make_scene(), robot, box(0, 0, 40, 20)) == (0.0, 0.0)


def test_climbing_a_metre_takes_the_weight_over_the_efficiency() -> None:
    robot = RAMP.robots[0]
    assert climb_J(robot, 1.0) == pytest.approx(180.0 * 9.81 / 0.85)
    assert climb_J(robot, -2.0) == -2.0 * climb_J(robot, 1.0)
    assert np.isclose(climb_J(robot, 0.0), 0.0)
