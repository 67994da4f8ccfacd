"""Words that the field does not use in their sense here stay out of the project."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
RETIRED = re.compile(
    r"errand|encounter|\bdraft(s|able|ed|ing)?\b(?!-0)|_drafts?\b|\bhasty?\b|\bhaste|\bhurried\b"
    r"|\bdearer\b|SURELY|ROOMY"
)
OLD_RUNS = ("runs/summary.py", "bench_record.py", "runs/test_old_runs.py")
"""What reads keys of runs made by version 0.1.0."""
PLACES = ("mrmg", "tools", "tests", "scenes", "models")
SUFFIXES = {".py", ".md", ".yaml", ".html", ".jinja", ".js", ".css"}


def texts() -> Iterator[Path]:
    """Yield the files that users and engineers read; the change log has its history."""
    yield from (ROOT / "README.md", ROOT / "BENCHMARKS.md")
    for place in PLACES:
        for path in (ROOT / place).rglob("*"):
            if path.suffix in SUFFIXES and "run_of_0.1.0" not in path.parts:
                yield path


def test_retired_words_stay_out() -> None:
    found = {
        f"{path.relative_to(ROOT)}:{number}": line
        for path in texts()
        if path != Path(__file__) and not str(path).endswith(OLD_RUNS)
        for number, line in enumerate(path.read_text(errors="replace").splitlines(), 1)
        if RETIRED.search(line)
    }
    assert found == {}
