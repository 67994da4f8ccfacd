"""A wheel, installed away from the checkout, does the whole job."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import sysconfig
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    command = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d"]
    subprocess.run([*command, str(folder)], cwd=ROOT, check=True, capture_output=True)
    (built,) = folder.glob("*.whl")
    return built


@pytest.fixture(scope="module")
def command(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The `mrmg` of an environment that holds the wheel and borrows the packages."""
    home = tmp_path_factory.mktemp("install")
    subprocess.run([sys.executable, "-m", "venv", str(home / "env")], check=True)
    python = home / "env/bin/python"
    subprocess.run(
        [str(python), "-m", "pip", "install", "-q", "--no-deps", str(wheel)],
        check=True,
    )
    (site,) = (home / "env/lib").glob("python*/site-packages")
    # A path named in a .pth file is searched, but its own .pth files are not read: the
    # checkout's editable install stays out of sight.
    (site / "borrowed.pth").write_text(sysconfig.get_paths()["purelib"] + "\n")
    return home / "env/bin/mrmg"


def run(command: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    clean = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    return subprocess.run(
        [str(command), *arguments],
        capture_output=True,
        text=True,
        cwd=command.parents[2],
        env=clean,
        check=False,
    )


@pytest.mark.slow
def test_the_wheel_carries_scenes_and_models(wheel: Path) -> None:
    names = set(zipfile.ZipFile(wheel).namelist())
    assert "mrmg/py.typed" in names
    for scene in (ROOT / "scenes").iterdir():
        assert f"mrmg/_shipped/scenes/{scene.name}" in names
    for part in (ROOT / "models").rglob("*.*"):
        assert f"mrmg/_shipped/models/{part.relative_to(ROOT / 'models')}" in names
    assert "mrmg/runs/summary.schema.json" in names
    assert "mrmg/scene/new_scene.yaml" in names
    assert not [name for name in names if name.startswith("tests/")]


@pytest.mark.slow
def test_new_files_name_the_installed_schemas(command: Path) -> None:
    for verb, path in (("scene", "farm.yaml"), ("robot", "buggy/robot.yaml")):
        ended = run(command, verb, "new", path.removesuffix(".yaml").split("/")[0])
        assert ended.returncode == 0, ended.stderr
        text = (command.parents[2] / path).read_text()
        schema = text.partition("$schema=")[2].splitlines()[0]
        assert "_shipped" in schema
        assert json.loads(Path(schema).read_text())["properties"]["format"]


@pytest.mark.ci
def test_the_installed_command_runs_a_whole_mission(command: Path) -> None:
    where = f"{command.parent}/python -c 'import mrmg; print(mrmg.__file__)'"
    home = subprocess.run(
        where, shell=True, capture_output=True, text=True, check=True, cwd="/"
    )
    assert not home.stdout.startswith(str(ROOT))

    ended = run(command, "run", "scene1", "--no-video", "--json")
    assert ended.returncode == 0, ended.stderr
    assert json.loads(ended.stdout)["mission_ok"]
