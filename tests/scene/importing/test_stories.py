"""From the files of other tools to a drive, audited and exported, in five commands."""

from __future__ import annotations

import json
import shlex
from pathlib import Path

import pytest
from pictures.stories import stories, write_field, write_hall

from mrmg.cli.main import main

NAV2 = Path(__file__).parents[4] / "shared" / "nav2"


def run(commands: str) -> None:
    for line in commands.strip().splitlines():
        assert main(shlex.split(line)[1:]) == 0, line


def check(folder: Path, goals: int) -> None:
    summary = json.loads((folder / "summary.json").read_text())
    assert summary["mission_ok"]
    assert summary["execution"]["goals_visited"] == goals
    assert summary["execution"]["contacts"] == 0
    assert abs(summary["energy"]["measured_error_pct"]) < 5.0
    assert (folder / "export").is_dir()


@pytest.mark.ci
def test_occupancy_map(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    if not NAV2.exists():
        pytest.skip("no shared maps")
    monkeypatch.chdir(tmp_path)
    files = f"{NAV2}/depot.yaml --keepout {NAV2}/depot_keepout.yaml"
    counts = "--goals 3 --stations 2"
    run(f"""
    mrmg scene import {files} -o depot.yaml
    mrmg scene populate depot.yaml --model diffdrive {counts} -o mission.yaml
    mrmg scene check mission.yaml
    mrmg run mission.yaml --no-video --out runs/depot
    mrmg export runs/depot --format mcap
    """)
    check(tmp_path / "runs" / "depot", 3)


@pytest.mark.slow
@pytest.mark.parametrize(
    "number",
    [
        pytest.param(0, id="hall"),
        pytest.param(1, id="field", marks=pytest.mark.ci),
    ],
)
def test_stories_of_the_readme(
    number: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each is of five commands, from a map to a recording."""
    monkeypatch.chdir(tmp_path)
    (write_hall, write_field)[number](tmp_path)
    story = stories()[number]
    assert len(story) == 5
    assert story[-1].endswith("--format mcap")
    run(
        "\n".join(f"mrmg {line}" for line in story).replace("--out", "--no-video --out")
    )
    (folder,) = (tmp_path / "runs").iterdir()
    check(folder, 6)
    assert (folder / "export" / "mission.mcap").stat().st_size > 10_000
    assert main(["export", str(folder), "--format", "geojson"]) == 0
    back = str(folder / "export" / "mission.geojson")
    assert main(["scene", "import", back, "-o", "again.yaml"]) == 0
