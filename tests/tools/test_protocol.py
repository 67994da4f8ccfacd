"""Seeds as they are given to benches, and what makes figures comparable."""

from __future__ import annotations

import argparse
import json
import platform
import re
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
