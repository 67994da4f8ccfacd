"""Figures for papers: every kind in every format, equal for equal runs."""

from __future__ import annotations

from pathlib import Path

import pytest

from mrmg.errors import RunFolderError, UsageError
from mrmg.runs import pipeline
from mrmg.viz.figure import KINDS, draw_figure

STARTS = {".pdf": b"%PDF", ".svg": b"<?xml", ".png": b"\x89PNG"}


@pytest.mark.quick(".pdf-map", ".svg-energy", ".png-timeline")
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("suffix", STARTS)
def test_every_kind_in_every_format_twice_the_same(
    kind: str, suffix: str, quickstart_run: Path, tmp_path: Path
) -> None:
    one, other = tmp_path / f"one{suffix}", tmp_path / f"other{suffix}"
    draw_figure(quickstart_run, kind, one)
    draw_figure(quickstart_run, kind, other)
    assert one.read_bytes().startswith(STARTS[suffix])
    assert one.read_bytes() == other.read_bytes()


def test_text_stays_text(quickstart_run: Path, tmp_path: Path) -> None:
    draw_figure(quickstart_run, "timeline", tmp_path / "t.svg")
    words = (tmp_path / "t.svg").read_text()
    for name in ("r1", "r2", "g1", "⚡s1", "driving", "waiting", "at a station"):
        assert name in words
    draw_figure(quickstart_run, "timeline", tmp_path / "t.pdf")
    pdf = (tmp_path / "t.pdf").read_bytes()
    assert b"/TrueType" in pdf or b"/CIDFontType2" in pdf
    assert b"/Type3" not in pdf


def test_unknown_kinds_and_suffixes_are_refused(
    quickstart_run: Path, tmp_path: Path
) -> None:
    with pytest.raises(UsageError, match="map, energy, timeline"):
        draw_figure(quickstart_run, "tree", tmp_path / "x.pdf")
    with pytest.raises(UsageError, match=r"\.pdf, \.svg, \.png"):
        draw_figure(quickstart_run, "map", tmp_path / "x.docx")


def test_a_run_without_a_plan_says_why(walled_scene: Path, tmp_path: Path) -> None:
    pipeline.run(walled_scene, out=tmp_path / "run", video=None)
    with pytest.raises(RunFolderError, match="no plan to draw"):
        draw_figure(tmp_path / "run", "map", tmp_path / "x.pdf")
