"""Maps that nobody here drew: imported, populated, and driven to the end."""

from __future__ import annotations

from pathlib import Path

import pytest
from places import import_map

from mrmg.errors import ExitCode
from mrmg.runs import pipeline
from mrmg.scene.loading import scene_from_document
from mrmg.scene.populating.populate import populate

MAPS = Path(__file__).parents[3] / "shared/maps"


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    [
        "dense.tri",
        *(
            pytest.param(name, marks=pytest.mark.ci)
            for name in (
                "complex2.txt",
                "geometry-reduced.txt",
                "potholes.txt",
                "warehouse2.txt",
            )
        ),
    ],
)
def test_a_mission_on_a_foreign_map_ends_well(name: str, tmp_path: Path) -> None:
    if not (MAPS / name).exists():
        pytest.skip(f"no map {name} in ../shared/maps")
    document = import_map(MAPS / name, longest_side_m=100.0)
    scene = scene_from_document(document, source=name)
    scene = populate(scene, robots=2, goals=8, stations=4, seed=3)
    result = pipeline.run(scene, out=tmp_path / "run", video=None)
    assert result.exit_code == ExitCode.OK, result.reason
    assert result.summary["energy"]["recharges"] > 0
    assert result.summary["execution"]["goals_visited"] == 8
