"""The figure of growth shows every mission, and those without a plan."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from growth_figure import GrowthPoint, draw_growth, exponent

from mrmg.errors import UsageError


def test_panels_and_failures_are_named(tmp_path: Path) -> None:
    path = tmp_path / "growth.svg"
    series = {
        "robots": [GrowthPoint(1, 0.1), GrowthPoint(2, 0.2), GrowthPoint(2, None)],
        "goals": [GrowthPoint(8, None)],
    }
    draw_growth(series, path)
    text = path.read_text()
    for word in ("robots", "goals", "time to the first plan [s]", "1/2", "1/1"):
        assert word in text


def test_other_formats_are_refused(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"must end in one of"):
        draw_growth({"robots": [GrowthPoint(1, 0.1)]}, tmp_path / "growth.gif")


def test_the_exponent_is_that_of_the_median_times() -> None:
    points = [GrowthPoint(n, c * n**1.5) for n in (4, 8, 64) for c in (0.5, 2.0, 9.0)]
    assert exponent([*points, GrowthPoint(128, None)]) == pytest.approx(1.5)
    assert math.isnan(exponent([GrowthPoint(4, 1.0), GrowthPoint(8, None)]))
