"""Run folders and capsules of older versions stay readable.

`run_of_0.1.0` was made by version 0.1.0 (commit 52de54a); its scene names its model by
a relative path, so that it may lie anywhere.
"""

from __future__ import annotations

import json
import shutil
import zipfile
from dataclasses import replace
from pathlib import Path

import pytest

import mrmg
from mrmg.cli.main import main
from mrmg.errors import ExitCode, IdentityError
from mrmg.plans import Plan
from mrmg.runs.capsule import Capsule, Failure
from mrmg.runs.reproduction import reproduce
from mrmg.scene.loading import load_scene
from mrmg.simulation.log import ExecutionLog, require_same_mission

OLD = Path(__file__).parents[1] / "run_of_0.1.0"


@pytest.fixture
def old(tmp_path: Path) -> Path:
    return Path(shutil.copytree(OLD, tmp_path / "old"))


@pytest.mark.parametrize(
    "words", [["verify"], ["audit"], ["report"], ["execute", "--overwrite"]]
)
def test_verbs_take_an_old_run(old: Path, words: list[str]) -> None:
    verb, *options = words
    assert main([verb, str(old), *options]) == ExitCode.OK


def test_an_old_run_is_drawn(old: Path, tmp_path: Path) -> None:
    out = tmp_path / "map.pdf"
    assert main(["figure", str(old), "--kind", "map", "-o", str(out)]) == ExitCode.OK
    assert out.exists()


def test_the_old_digest_holds_for_what_it_was_taken_of() -> None:
    scene, plan = load_scene(OLD / "scene.yaml"), Plan.load(OLD)
    assert plan.scene_digest != scene.digest
    require_same_mission(scene, plan, ExecutionLog.load(OLD))
    for other in (
        replace(scene, time_limit_s=100.0),
        scene.with_(battery={"capacity_m": 90}),
        scene.with_robot("r1", model={"like": "./car", "device_power": 1.0}),
    ):
        assert not mrmg.verify(other, plan).ok
        with pytest.raises(IdentityError, match="plan of another scene"):
            require_same_mission(other, plan)


def test_the_old_digest_holds_for_a_scene_written_anew(tmp_path: Path) -> None:
    from mrmg.scene.loading.carrying import carried_files

    for name, data in carried_files(load_scene(OLD / "scene.yaml")).items():
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)
    assert load_scene(tmp_path / "scene.yaml").is_named(Plan.load(OLD).scene_digest)


def test_a_capsule_of_format_1_is_replayed(
    quickstart_run: Path, tmp_path: Path
) -> None:
    arguments = json.loads((quickstart_run / "run.json").read_text())["arguments"]
    failure = Failure.of(ExecutionLog.load(quickstart_run), ("contact",), ("touched",))
    new = tmp_path / "new.zip"
    Capsule.of_run(quickstart_run, arguments, failure, {}).save(new)
    path = tmp_path / "old.zip"
    with zipfile.ZipFile(new) as source, zipfile.ZipFile(path, "w") as target:
        for name in source.namelist():
            data = source.read(name)
            if name == "capsule.json":
                data = json.dumps(json.loads(data) | {"format": 1}).encode()
            target.writestr(name, data)
    assert reproduce(path, tmp_path / "again").after is None
