"""Run folders and capsules carry models of the user's own, and need no other folder."""

from __future__ import annotations

import shutil
import zipfile
from dataclasses import replace
from pathlib import Path

import mujoco
import pytest

from mrmg import shipped
from mrmg.cli.main import main
from mrmg.errors import ExitCode, FileError, SceneError
from mrmg.runs import pipeline
from mrmg.runs.capsule import CAPSULE_FILE, Capsule
from mrmg.runs.reproduction import reproduce
from mrmg.scene.loading import load_scene
from mrmg.scene.loading.carrying import carried_files, safe_path
from mrmg.scene.model_files import ModelFiles

PYRAMID = """\
v 0 0 0
v 1 0 0
v 0 1 0
v 0 0 1
f 1 3 2
f 1 2 4
f 1 4 3
f 2 3 4
"""


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a scene, and a car whose MJCF includes a file that names a mesh."""
    folder = tmp_path_factory.mktemp("site")
    own = folder / "bots" / "mine"
    shutil.copytree(shipped.models_folder() / "car", own)
    xml = own / "car.xml"
    include = '<include file="parts.xml"/></mujoco>'
    xml.write_text(xml.read_text().replace("</mujoco>", include))
    (own / "parts.xml").write_text(
        '<mujoco><asset><mesh name="box" file="../meshes/box.obj"/></asset></mujoco>'
    )
    (own / "notes.txt").write_text("not a part of the model")
    meshes = folder / "bots" / "meshes"
    meshes.mkdir()
    (meshes / "box.obj").write_text(PYRAMID)
    (folder / "field.yaml").write_text(
        "format: 1\nbounds: [0, 0, 24, 14]\n"
        "goals:\n  - {id: g1, circle: {center: [16, 7], radius: 1.5}}\n"
        "battery: {capacity_m: 100, reserve: 0.05}\n"
        "robots:\n  - {id: r1, model: ./bots/mine, pose: [4, 7, 0]}\n"
    )
    return folder


@pytest.fixture(scope="module")
def moved(site: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A failed run of that scene in another place, without what it was made from."""
    copy = Path(shutil.copytree(site, tmp_path_factory.mktemp("gone") / "site"))
    pipeline.run(
        copy / "field.yaml",
        out=copy / "run",
        video=None,
        disturb="capacity=-90%",
        disturb_seed=3,
    )
    place = tmp_path_factory.mktemp("elsewhere") / "run"
    shutil.move(copy / "run", place)
    shutil.rmtree(copy)
    return place


def test_what_mujoco_reads_is_what_is_carried(site: Path) -> None:
    own = site / "bots" / "mine" / "car.xml"
    read = mujoco.mju_getXMLDependencies(str(own))
    known = {file.path.resolve() for file in ModelFiles.of(own).files}
    assert {Path(name).resolve() for name in read} == known
    assert len(known) == 3


@pytest.mark.parametrize("verb", ["verify", "audit", "report"])
def test_verbs_need_the_run_folder_alone(
    moved: Path, tmp_path: Path, verb: str
) -> None:
    folder = shutil.copytree(moved, tmp_path / "run")
    codes = (ExitCode.OK, ExitCode.MISSION_FAILED)
    assert main([verb, str(folder)]) in codes


def test_a_capsule_replays_without_the_models_folder(
    moved: Path, tmp_path: Path
) -> None:
    outcome = reproduce(moved / CAPSULE_FILE, tmp_path / "again")
    assert outcome.same_bits
    repeated = (tmp_path / "again" / CAPSULE_FILE).read_bytes()
    assert repeated == (moved / CAPSULE_FILE).read_bytes()


def test_only_what_belongs_to_the_model_is_carried(moved: Path) -> None:
    carried = [path for path in (moved / "models").rglob("*") if path.is_file()]
    names = sorted(path.relative_to(moved).as_posix() for path in carried)
    assert names == [
        "models/mine/meshes/box.obj",
        "models/mine/mine/car.xml",
        "models/mine/mine/parts.xml",
        "models/mine/mine/robot.yaml",
    ]


def test_a_carried_scene_is_the_same_scene(site: Path, moved: Path) -> None:
    scene = load_scene(site / "field.yaml")
    assert load_scene(moved / "scene.yaml") == scene
    again = carried_files(load_scene(moved / "scene.yaml"))
    assert again == carried_files(scene)


def test_two_models_of_one_name_are_kept_apart(site: Path, tmp_path: Path) -> None:
    other = tmp_path / "mine"
    shutil.copytree(shipped.models_folder() / "diffdrive", other)
    scene = load_scene(site / "field.yaml")
    both = scene.with_(
        robots=[
            *scene.robots,
            {
                "id": "r2",
                "model": {"like": str(other), "idle_power": 2},
                "pose": [5, 3, 0],
            },
            {"id": "r3", "model": "car", "pose": [5, 10, 0]},
        ]
    )
    for name, data in carried_files(both).items():
        path = tmp_path / "copy" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)
    assert load_scene(tmp_path / "copy" / "scene.yaml") == both
    assert (tmp_path / "copy" / "models" / "mine-2" / "robot.yaml").exists()
    assert not (tmp_path / "copy" / "models" / "car").exists()


def test_an_edited_model_makes_results_stale(site: Path, tmp_path: Path) -> None:
    folder = Path(shutil.copytree(site, tmp_path / "site"))
    scene = load_scene(folder / "field.yaml")
    run = folder / "run"
    pipeline.run(scene, out=run, video=None)
    before = (run / "plan.json").read_bytes()
    mesh = folder / "bots" / "meshes" / "box.obj"
    mesh.write_text(mesh.read_text().replace("v 0 0 1", "v 0 0 2"))
    with pytest.raises(SceneError, match=r"box.obj: has changed since the scene was"):
        pipeline.run(scene, out=tmp_path / "other", video=None)
    pipeline.run(folder / "field.yaml", out=run, video=None, overwrite=True)
    assert (run / "plan.json").read_bytes() != before
    carried = run / "models" / "mine" / "meshes" / "box.obj"
    assert carried.read_bytes() == mesh.read_bytes()


def test_a_run_is_made_anew_from_its_own_folder(moved: Path, tmp_path: Path) -> None:
    """What is written last is read before it is removed."""
    folder = Path(shutil.copytree(moved, tmp_path / "run"))
    scene = load_scene(folder / "scene.yaml")
    changed = replace(scene, time_limit_s=500.0)
    pipeline.run(changed, out=folder, video=None, overwrite=True)
    assert load_scene(folder / "scene.yaml") == changed


@pytest.mark.parametrize(
    "name",
    [
        "models/../run.json",
        "/models/x",
        "models",
        "models/",
        "models//x",
        "models/./x",
        "models\\x",
        "models/C:x",
        "../models/x",
        "other/x",
    ],
)
def test_no_path_leaves_the_folder(moved: Path, tmp_path: Path, name: str) -> None:
    assert not safe_path(name)
    path = Path(shutil.copy(moved / CAPSULE_FILE, tmp_path / "capsule.zip"))
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr(zipfile.ZipInfo(name), b"x")
    with pytest.raises(FileError, match="is no file of a capsule"):
        Capsule.load(path)
