"""The command `export`, its table of formats, and the plain formats."""

from __future__ import annotations

import csv
import json
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest

import mrmg
from mrmg.cli.main import main
from mrmg.errors import ExitCode
from mrmg.export.exporting import export_run
from mrmg.export.table import format_names
from mrmg.plans import Plan
from mrmg.runs.folder import RunFolder, Step
from mrmg.scene.importing.importing import import_files
from mrmg.scene.loading import load_scene, scene_from_document
from mrmg.simulation.log import ExecutionLog


@pytest.fixture
def planned_run(own_run: Path) -> Path:
    """A copy of the run before it was driven."""
    for name in ("log.json", "log.npz", "timing.json", "summary.json", "audit.json"):
        (own_run / name).unlink(missing_ok=True)
    return own_run


@pytest.mark.parametrize("name", format_names())
def test_every_format_writes_drives_and_plans(
    name: str, planned_run: Path, quickstart_run: Path, tmp_path: Path
) -> None:
    for run in (planned_run, quickstart_run):
        files = export_run(run, name, out=tmp_path / run.name)
        assert all(path.stat().st_size > 100 for path in files)
        again = export_run(run, name, out=tmp_path / run.name / "again")
        assert [a.read_bytes() for a in files] == [b.read_bytes() for b in again]


def test_a_new_format_is_one_new_module(
    monkeypatch: pytest.MonkeyPatch, quickstart_run: Path, tmp_path: Path
) -> None:
    from mrmg.export import formats, table

    code = (
        "from mrmg.export.table import Format\n"
        "def files(mission, versions):\n"
        "    return {'mission.txt': mission.scene.name.encode()}\n"
        "FORMAT = Format(suffix='.txt', files=files)\n"
    )
    folder = tmp_path / "formats"
    shutil.copytree(Path(formats.__file__).parent, folder)
    (folder / "name.py").write_text(code)
    monkeypatch.setattr(formats, "__path__", [str(folder)])
    assert "name" in table.format_names()
    try:
        (path,) = export_run(quickstart_run, "name", out=tmp_path / "out.txt")
    finally:
        sys.modules.pop("mrmg.export.formats.name", None)
    assert path.read_text() == "quickstart"


def test_the_table_holds_what_was_driven(quickstart_run: Path, tmp_path: Path) -> None:
    (path,) = export_run(quickstart_run, "csv", out=tmp_path)
    log = ExecutionLog.load(quickstart_run)
    rows = list(csv.DictReader(path.open()))
    for index, robot in enumerate(log.robots):
        own = [row for row in rows if row["robot"] == robot]
        names = ("time_s", "x_m", "y_m", "theta_rad", "v_m_s")
        found = np.array([[float(row[name]) for name in names] for row in own])
        expected = np.column_stack([log.time_s, log.state[index, :, :4]])
        assert found == pytest.approx(expected, abs=1e-6)
        targets = [row["target"] for row in own]
        course = list(dict.fromkeys(targets))
        assert course == [*Plan.load(quickstart_run).tours[robot], ""]
        charge = np.array([float(row["charge"]) for row in own])
        assert (charge >= 0.0).all()
        assert charge[0] == charge.max() == 1.0


def test_geojson_is_read_back_as_the_same_scene(
    quickstart_run: Path, tmp_path: Path
) -> None:
    (path,) = export_run(quickstart_run, "geojson", out=tmp_path / "x.geojson")
    before = load_scene(quickstart_run / "scene.yaml")
    document = import_files([path]).document
    after = scene_from_document(document, source=str(path))
    assert {goal.id: goal.region for goal in after.goals} == {
        goal.id: goal.region for goal in before.goals
    }
    poses = [[robot.pose for robot in scene.robots] for scene in (after, before)]
    assert np.array(poses[0]) == pytest.approx(np.array(poses[1]))
    for one, other in zip(after.obstacles, before.obstacles, strict=True):
        assert one.shape.symmetric_difference(other.shape).area < 1e-3
    paths = {
        feature["properties"]["robot"]: feature["geometry"]["coordinates"]
        for feature in json.loads(path.read_text())["features"]
        if "motion" in feature["properties"]
    }
    log = ExecutionLog.load(quickstart_run)
    for index, robot in enumerate(log.robots):
        assert paths[robot][0] == pytest.approx(log.state[index, 0, :2])
        assert paths[robot][-1] == pytest.approx(log.state[index, -1, :2])


def test_the_command_prints_its_files_and_replaces_only_if_asked(
    own_run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["export", str(own_run), "--format", "csv"]
    assert main([*command, "--json"]) == ExitCode.OK
    files = [Path(name) for name in json.loads(capsys.readouterr().out)]
    assert files == [own_run / "export/mission.csv"]
    files[0].write_text("mine")
    assert main(command) == ExitCode.USAGE
    assert "--overwrite" in capsys.readouterr().err
    assert files[0].read_text() == "mine"
    assert main([*command, "--overwrite"]) == ExitCode.OK
    assert files[0].read_text().startswith("robot,")
    RunFolder(own_run).begin(Step.EXECUTE, {})
    assert not (own_run / "export").exists()


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (["nowhere", "--format", "csv"], ExitCode.INVALID_FILE, "no such folder"),
        (["RUN", "--format", "csv", "--version", "2"], ExitCode.USAGE, "leave"),
        (["RUN", "--format", "vda5050", "--version", "2"], ExitCode.USAGE, "2.1.0"),
    ],
)
def test_mistakes_are_refused_with_a_remedy(
    arguments: list[str],
    code: ExitCode,
    words: str,
    own_run: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    given = [str(own_run) if word == "RUN" else word for word in arguments]
    assert main(["export", *given]) == code
    assert words in capsys.readouterr().err
    assert not (own_run / "export").exists()


def test_an_unknown_format_is_refused(own_run: Path) -> None:
    with pytest.raises(mrmg.errors.UsageError, match=r"did you mean 'mcap'"):
        export_run(own_run, "mcab")


def test_a_run_without_a_plan_is_refused(
    walled_scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = tmp_path / "run"
    assert main(["plan", str(walled_scene), "--out", str(run)]) == ExitCode.INFEASIBLE
    assert main(["export", str(run), "--format", "csv"]) == ExitCode.INVALID_FILE
    assert "no plan to export" in capsys.readouterr().err


@pytest.mark.parametrize("module", ["mcap.writer", "rosbags.typesys"])
def test_a_missing_package_is_named_with_its_extra(
    module: str,
    own_run: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setitem(sys.modules, module, None)
    code = main(["export", str(own_run), "--format", "mcap"])
    assert code == ExitCode.MACHINE
    assert "pip install 'mrmg[ros]'" in capsys.readouterr().err
    assert not (own_run / "export").exists()


def test_all_formats_are_found() -> None:
    assert {"csv", "geojson", "mcap", "vda5050"} <= {*format_names()}
