"""Objectives: what they weigh, what they are called, and when a mission is late."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mrmg.scene.loading import scene_from_document
from mrmg.scene.objective import ENERGY, MAKESPAN, Objective, overtime_s

DOCUMENT = {"format": 1, "name": "map", "bounds": [0, 0, 9, 9]}


@pytest.mark.parametrize(
    ("given", "expected", "name", "unit"),
    [
        ({}, ENERGY, "energy", "J"),
        ({"objective": "energy"}, ENERGY, "energy", "J"),
        ({"objective": "makespan"}, MAKESPAN, "makespan", "s"),
        (
            {"objective": {"energy": 2, "makespan": 0}},
            Objective(energy_weight=2.0),
            "energy",
            "J",
        ),
        (
            {"objective": {"energy": 1, "makespan": 50}},
            Objective(energy_weight=1.0, makespan_weight=50.0),
            "blend",
            "1",
        ),
    ],
)
def test_scene_files_say_what_is_to_be_small(
    given: dict, expected: Objective, name: str, unit: str
) -> None:
    scene = scene_from_document({**DOCUMENT, **given}, source="map")
    assert scene.objective == expected
    assert (scene.objective.name, scene.objective.unit) == (name, unit)
    assert scene.time_limit_s == math.inf
    again = scene_from_document(scene.document, source="map")
    assert again.digest == scene.digest


def test_a_time_limit_is_kept_and_belongs_to_the_digest() -> None:
    scene = scene_from_document({**DOCUMENT, "time_limit": 90}, source="map")
    free = scene_from_document(DOCUMENT, source="map")
    assert scene.time_limit_s == 90.0
    assert scene.digest != free.digest
    assert scene_from_document(scene.document, source="map").time_limit_s == 90.0


@given(
    st.floats(0.0, 1e6), st.floats(0.0, 1e6), st.floats(0.0, 1e3), st.floats(0.0, 1e3)
)
def test_the_value_is_the_weighted_sum(
    energy_J: float, makespan_s: float, first: float, second: float
) -> None:
    objective = Objective(energy_weight=first, makespan_weight=second)
    expected = first * energy_J + second * makespan_s
    assert objective.value(energy_J, makespan_s) == pytest.approx(expected)


def test_what_has_no_weight_does_not_count_even_if_it_is_infinite() -> None:
    assert ENERGY.value(3.0, math.inf) == 3.0
    assert MAKESPAN.value(math.inf, 4.0) == 4.0


@pytest.mark.parametrize(
    ("limit_s", "over_s", "late_s"),
    [(math.inf, 1e9, 0.0), (5.0, 5.0, 0.0), (5.0, 5.0 + 1e-9, 0.0), (5.0, 7.5, 2.5)],
)
def test_a_mission_is_late_by_what_it_takes_too_long(
    limit_s: float, over_s: float, late_s: float
) -> None:
    assert overtime_s(limit_s, over_s) == pytest.approx(late_s)
