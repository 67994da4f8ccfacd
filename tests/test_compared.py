"""Figures in messages differ exactly where what they stand for differs."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mrmg.compared import compared

FIGURES = st.floats(-1e6, 1e6)


@pytest.mark.parametrize(
    ("value", "limit", "digits", "texts"),
    [
        (6.04, 6.0, 0, ("6.04", "6.00")),
        (7.0, 6.0, 0, ("7", "6")),
        (6.0, 6.0, 0, ("6", "6")),
        (299.996, 300.0, 2, ("299.996", "300.000")),
        (12.0, 3.0, 2, ("12.00", "3.00")),
    ],
)
def test_examples(
    value: float, limit: float, digits: int, texts: tuple[str, str]
) -> None:
    assert compared(value, limit, digits) == texts


@given(FIGURES, FIGURES)
def test_texts_compare_like_their_figures(value: float, limit: float) -> None:
    texts = compared(value, limit)
    first, second = map(float, texts)
    if abs(value - limit) > 1e-11:
        assert (first < second) == (value < limit)
        assert (first > second) == (value > limit)
    assert abs(first - value) <= 0.5
    assert len(texts[0].partition(".")[2]) == len(texts[1].partition(".")[2])
