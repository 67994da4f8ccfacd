"""The paper's figures from a bench, by the tools themselves."""

from __future__ import annotations

import sys
from pathlib import Path

import bench
import figures
import pytest


@pytest.mark.slow
def test_figures_and_captions_come_from_a_bench(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    rows, out = tmp_path / "bench.jsonl", tmp_path / "figures"
    run = "--scenes quickstart --seeds 0 --profile default paper --output"
    monkeypatch.setattr(sys, "argv", ["bench", *run.split(), str(rows)])
    assert bench.main() == 0
    ratios = capsys.readouterr().out.partition("paper / default")[2]
    assert "quickstart | 1 | " in ratios
    draw = [str(rows), "-o", str(out)]
    monkeypatch.setattr(sys, "argv", ["figures", *draw])
    assert figures.main() == 0
    names = [f"figure{number}.pdf" for number in range(1, 5)]
    names += ["captions.md", "table1.tex"]
    assert capsys.readouterr().out.split() == [str(out / name) for name in names]
    assert sorted(path.name for path in out.iterdir()) == sorted(names)
    captions = (out / "captions.md").read_text()
    assert "| quickstart | 2 | 4 | 1 | 1 |" in captions
    assert "2 runs,\nseeds 0-0, profiles default, paper" in captions
    assert "mujoco" in captions
    assert (out / "table1.tex").read_text().count(r"\\") == 3


def test_the_method_is_drawn_of_no_profile_but_the_papers(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Only its tree can be drawn."""
    monkeypatch.setattr(sys, "argv", ["figures", "rows", "--profile", "default"])
    with pytest.raises(SystemExit) as ended:
        figures.main()
    assert ended.value.code == 2


def test_a_file_that_is_none_is_refused_in_words(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", ["figures", str(tmp_path / "absent.jsonl")])
    assert figures.main() == 3
    assert capsys.readouterr().err.startswith("tools/figures: ")
