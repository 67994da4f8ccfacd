"""The set-up script on machines that lack something, and on one that lacks nothing."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
from packaging.version import Version

ROOT = Path(__file__).parents[2]
SCRIPTS = [ROOT / "tools/environment", ROOT / "tools/demo", ROOT / "tools/test"]
BASICS = ("bash", "cat", "cut", "dirname", "env", "id", "sha256sum")


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """A checkout with nothing but what the script reads."""
    (tmp_path / "tools").mkdir()
    for name in ("pyproject.toml", "constraints.txt", "tools/environment"):
        shutil.copy(ROOT / name, tmp_path / name)
    return tmp_path


def set_up(
    checkout: Path, *python: str, **variables: str
) -> subprocess.CompletedProcess[str]:
    """Run the script where only the basic commands and `python` are installed."""
    bare = checkout / "bin"
    bare.mkdir()
    for name in BASICS:
        (bare / name).symlink_to(str(shutil.which(name)))
    for name in python:
        (bare / name).write_text(f'#!{bare}/bash\nexec {sys.executable} "$@"\n')
        (bare / name).chmod(0o755)
    return subprocess.run(
        [str(checkout / "tools/environment"), "test"],
        capture_output=True,
        text=True,
        env={"PATH": str(bare), **variables},
        check=False,
    )


@pytest.mark.parametrize("script", [*SCRIPTS, ROOT / ".ci/run"], ids=lambda p: p.name)
def test_scripts_are_executable_and_stop_at_the_first_error(script: Path) -> None:
    assert os.access(script, os.X_OK)
    assert "set -euo pipefail" in script.read_text()
    subprocess.run(["bash", "-n", str(script)], check=True)


def test_without_python_the_packages_are_named(checkout: Path) -> None:
    ended = set_up(checkout)
    assert ended.returncode == 7
    assert "sudo apt-get install python3 python3-venv" in ended.stderr
    assert not (checkout / ".venv").exists()


def test_without_ensurepip_the_package_is_named(checkout: Path) -> None:
    hidden = checkout / "hidden"
    hidden.mkdir()
    (hidden / "ensurepip.py").write_text("raise ImportError('left out by Debian')\n")
    ended = set_up(checkout, "python3", PYTHONPATH=str(hidden))
    version = f"{sys.version_info.major}.{sys.version_info.minor}"
    assert ended.returncode == 7
    assert (
        f"apt-get install --no-install-recommends python{version}-venv" in ended.stderr
    )
    assert not (checkout / ".venv").exists()


def test_an_environment_that_is_up_to_date_is_left_alone(checkout: Path) -> None:
    (checkout / ".venv").mkdir()
    state = subprocess.run(
        "{ pwd && cat pyproject.toml constraints.txt tools/environment; } | sha256sum",
        shell=True,
        cwd=checkout,
        capture_output=True,
        check=True,
    )
    (checkout / ".venv/mrmg-installed-test").write_bytes(state.stdout)
    ended = set_up(checkout)
    assert (ended.returncode, ended.stderr) == (0, "")


def test_dependencies_are_ranges_that_hold_the_locked_versions() -> None:
    locked = {
        canonicalize_name(line.split("==")[0]): Version(line.split("==")[1])
        for line in (ROOT / "constraints.txt").read_text().splitlines()
        if not line.startswith("#")
    }
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert {"geo", "ros", "view", "cluster", "test"} <= {
        *project["optional-dependencies"]
    }
    for lines in (project["dependencies"], *project["optional-dependencies"].values()):
        for line in map(Requirement, lines):
            if line.name == "mrmg":
                continue
            assert locked[canonicalize_name(line.name)] in line.specifier, line
            assert "==" not in str(line.specifier), "exact pins are in constraints.txt"
            assert re.match(r">=|.*,>=", str(line.specifier)), "--lowest reads it"


def test_a_python_that_is_not_there_is_named(checkout: Path) -> None:
    shutil.copy(ROOT / "tools/test", checkout / "tools/test")
    ended = subprocess.run(
        [str(checkout / "tools/test"), "--python", "3.99"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert ended.returncode == 7
    assert "No Python 3.99 was found on PATH or in" in ended.stderr
    assert not [*checkout.glob(".venv*")]
