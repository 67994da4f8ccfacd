"""Ranges: what is in them, and how they are named."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from mrmg import PlannerParams
from mrmg.errors import UsageError
from mrmg.ranges import Range


@pytest.mark.parametrize(
    ("allowed", "inside", "outside", "named"),
    [
        (Range(), [0, 0.0, 7.5], [-1e-9, math.inf], "a number of at least 0"),
        (Range(ends="(]"), [1e-9], [0, 0.0], "a positive number"),
        (
            Range(0, 1, ends="[)"),
            [0, 0.99],
            [1, 1.0],
            "a number of at least 0 and below 1",
        ),
        (
            Range(0, 0.2, ends="(]"),
            [0.2],
            [0.0, 0.3],
            "a number above 0 and at most 0.2",
        ),
        (
            Range(1, 9, whole=True),
            [1, 9],
            [0, 10, 2.0],
            "a whole number of at least 1 and at most 9",
        ),
        (Range(optional=True), [None, 0], [-1], "a number of at least 0, or None"),
    ],
)
def test_what_is_in_a_range_and_how_it_is_named(
    allowed: Range, inside: list[object], outside: list[object], named: str
) -> None:
    assert all(value in allowed for value in inside)
    assert not any(value in allowed for value in [*outside, math.nan, "1", True, [1]])
    assert str(allowed) == named


def test_numbers_of_any_kind_and_size_are_numbers() -> None:
    assert np.float32(0.5) in Range(0.0, 1.0)
    assert np.int64(3) in Range(whole=True)
    assert 10**400 in Range(whole=True)
    assert np.float64(3.0) not in Range(whole=True)


def test_each_parameter_is_named_with_what_it_may_be() -> None:
    wrong: dict[str, Any] = {"samples": "many", "dt_s": 0.5, "budget_s": math.nan}
    message = (
        "planner parameters: samples = 'many' must be a whole number of at least 0; "
        "dt_s = 0.5 must be a number above 0 and at most 0.2; budget_s = nan must be a "
        "positive number, or None"
    )
    with pytest.raises(UsageError) as refused:
        PlannerParams(**wrong)
    assert str(refused.value) == message
