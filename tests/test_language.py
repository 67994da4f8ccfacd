"""Words that the field does not use in their sense here stay out of the project."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
RETIRED = re.compile(
    r"errand|encounter|\bdraft(s|able|ed|ing)?\b(?!-0)|_drafts?\b|\bhasty?\b|\bhaste|\bhurried\b"
    r"|\bdearer\b|SURELY|ROOMY"
)
OLD_RUNS = {"runs/summary.py", "bench_record.py", "runs/test_old_runs.py"}
"""What reads keys of runs made by version 0.1.0."""
PLACES = ("mrmg", "tools", "tests", "scenes", "models")
FILES = sorted(
    path
    for place in PLACES
    for path in (ROOT / place).rglob("*")
    if path.suffix in {".py", ".md", ".yaml", ".html", ".js", ".css"}
    and "run_of_0.1.0" not in path.parts
    and path != Path(__file__)
)


@pytest.mark.parametrize("path", [*FILES, ROOT / "README.md", ROOT / "BENCHMARKS.md"])
def test_retired_words_stay_out(path: Path) -> None:
    if any(str(path).endswith(name) for name in OLD_RUNS):
        return
    lines = path.read_text().splitlines()
    assert [line for line in lines if RETIRED.search(line)] == []
