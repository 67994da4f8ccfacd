"""From the files of other tools to a drive, audited and exported, in five commands."""

from __future__ import annotations

import json
import shlex
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mrmg.cli import main

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


@pytest.mark.slow
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
def test_elevation_model(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, write_tiff: Any
) -> None:
    """A field of 80 x 80 m at 430 m above the sea, in degrees."""
    monkeypatch.chdir(tmp_path)
    row, column = np.mgrid[0:80, 0:110]
    heights = 430 + 1.5 * np.sin(column / 20) + np.cos(row / 15)
    heights[60:66, 20:30] = -9999
    keys = {"crs": "EPSG:4326", "nodata": -9999, "corner": (8.33, 47.85)}
    write_tiff(Path("field.tif"), heights.astype("float32"), cell=9e-6, **keys)
    run("""
    mrmg scene import field.tif -o field.yaml
    mrmg scene populate field.yaml --goals 4 --stations 2 -o mission.yaml
    mrmg scene check mission.yaml
    mrmg run mission.yaml --no-video --out runs/field
    mrmg export runs/field --format geojson
    """)
    check(tmp_path / "runs" / "field", 4)
    back = tmp_path / "runs" / "field" / "export" / "mission.geojson"
    run(f"mrmg scene import {back} -o again.yaml")
