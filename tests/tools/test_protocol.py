"""Seeds as they are given to benches, and what makes figures comparable."""

from __future__ import annotations

import argparse
import json
import platform
import re
import subprocess
import sys
from pathlib import Path

import protocol
import pytest
from protocol import seed_range, versions


@pytest.mark.parametrize(
    ("text", "seeds"), [("2-4", range(2, 5)), ("7", range(7, 8)), ("0-0", range(1))]
)
def test_seeds_are_read(text: str, seeds: range) -> None:
    assert seed_range(text) == seeds


def test_other_words_are_no_seeds() -> None:
    with pytest.raises(ValueError, match="some"):
        seed_range("some")


def test_no_seeds_are_refused() -> None:
    with pytest.raises(ValueError, match="no seeds from 5 to 3"):
        seed_range("5-3")


def test_versions_name_packages_python_and_processor() -> None:
    output = versions()
    assert "mujoco " in output
    assert f"Python {platform.python_version()}, " in output
    assert not output.endswith(", ")


def test_a_document_names_its_command_and_no_place_of_the_machine(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = tmp_path / "found.json"
    map_file = Path(protocol.__file__).parents[2] / "shared" / "maps" / "a map.txt"
    line = ["bench", str(map_file), "--seeds", "0-1", "--json", str(found)]
    monkeypatch.setattr(sys, "argv", line)
    options = argparse.Namespace(maps=[map_file], seeds=range(2), json=found)
    protocol.write_document(options, "bench_maps", [], True)
    reported = json.loads(found.read_text())["protocol"]
    assert (
        reported["command"] == "tools/bench_maps '../shared/maps/a map.txt' --seeds 0-1"
    )
    assert reported["maps"] == ["../shared/maps/a map.txt"]
    assert str(map_file.parents[2]) not in found.read_text()
    assert reported["load"] >= 0.0
    assert re.fullmatch(r"\d{4}-\d\d-\d\d", reported["date"])


def test_a_commit_is_marked_where_more_than_results_differ(tmp_path: Path) -> None:
    """Results of one bench do not make those of the next one count as changed."""

    def git(*call: str) -> None:
        who = ("-c", "user.name=a", "-c", "user.email=a")
        subprocess.run(["git", *who, *call], cwd=tmp_path, check=True)

    assert protocol.commit(tmp_path) is None
    git("init", "-q")
    for name in ("code.py", "BENCHMARKS.md", "tools/results/one.json"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("1")
    git("add", ".")
    git("commit", "-qm", "all")
    found = protocol.commit(tmp_path)
    assert found is not None
    assert re.fullmatch("[0-9a-f]{12}", found)
    (tmp_path / "BENCHMARKS.md").write_text("2")
    (tmp_path / "tools/results/one.json").write_text("2")
    (tmp_path / "beside.txt").write_text("2")
    assert protocol.commit(tmp_path) == found
    (tmp_path / "code.py").write_text("2")
    assert protocol.commit(tmp_path) == f"{found}-changed"
