"""The figure of growth shows every mission, and those without a plan."""

from __future__ import annotations

from pathlib import Path

import pytest
from growth_figure import GrowthPoint, draw_growth

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
