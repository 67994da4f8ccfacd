"""The paper's figures from a bench, by the tools themselves."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


def tool(name: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, str(ROOT / "tools" / name), *arguments],
        capture_output=True,
        text=True,
        check=False,
        cwd=ROOT,
    )


@pytest.mark.slow
def test_figures_and_captions_come_from_a_bench(tmp_path: Path) -> None:
    bench, out = tmp_path / "bench.jsonl", tmp_path / "figures"
    run = "--scenes quickstart --seeds 0 --profile default paper --output"
    measured = tool("bench.py", *run.split(), str(bench))
    assert measured.returncode == 0, measured.stderr
    ratios = measured.stdout.partition("paper / default")[2]
    assert "quickstart | 1 | " in ratios
    made = tool("figures.py", str(bench), "-o", str(out), "--profile", "default")
    assert made.returncode == 0, made.stderr
    names = [f"figure{number}.pdf" for number in range(1, 5)]
    names += ["captions.md", "table1.tex"]
    assert made.stdout.split() == [str(out / name) for name in names]
    assert sorted(path.name for path in out.iterdir()) == sorted(names)
    captions = (out / "captions.md").read_text()
    assert "| quickstart | 2 | 4 | 1 | 1 |" in captions
    assert "2 runs,\nseeds 0-0, profiles default, paper" in captions
    assert "mujoco" in captions
    assert (out / "table1.tex").read_text().count(r"\\") == 3


def test_a_file_that_is_none_is_refused_in_words(tmp_path: Path) -> None:
    answer = tool("figures.py", str(tmp_path / "absent.jsonl"))
    assert answer.returncode == 3
    assert answer.stderr.startswith("tools/figures: ")
    assert "Traceback" not in answer.stderr
