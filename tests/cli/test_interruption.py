"""A stopped run leaves no half-written file, and the same command finishes it."""

from __future__ import annotations

import io
import json
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from PIL import Image

from mrmg import storage
from mrmg.errors import ExitCode

pytestmark = pytest.mark.slow
PATIENCE_S = 120.0
ERRAND = """\
format: 1
name: errand
bounds: [0, 0, 30, 12]
obstacles:
  - {box: {center: [15, 3], size: [4, 3]}}
goals:
  - {id: g1, circle: {center: [24, 6], radius: 1.5}}
robots:
  - {id: r1, model: car, pose: [5, 6, 0]}
"""


def start(scene: Path, out: Path) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "mrmg", "run", str(scene), "--no-video"]
    return subprocess.Popen(
        [*command, "--out", str(out)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One robot on a short errand, so that a run takes few seconds."""
    path = tmp_path_factory.mktemp("scene") / "errand.yaml"
    path.write_text(ERRAND)
    return path


@pytest.fixture(scope="module")
def reference(scene: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a run that nobody stopped."""
    out = tmp_path_factory.mktemp("reference") / "run"
    process = start(scene, out)
    _, told = process.communicate()
    assert process.returncode == ExitCode.OK, told
    return out


def wait_for(path: Path, process: subprocess.Popen[str]) -> None:
    """Return once `path` exists or the process has ended."""
    until = time.monotonic() + PATIENCE_S
    while not path.exists() and process.poll() is None:
        assert time.monotonic() < until, f"{path.name} never came"
        time.sleep(0.002)


def assert_every_file_is_whole(folder: Path) -> None:
    for path in folder.iterdir() if folder.exists() else []:
        if path.name.startswith(".part-"):
            continue
        if path.suffix == ".json":
            json.loads(path.read_text())
        elif path.suffix == ".npz":
            assert storage.read_arrays(path)
        elif path.suffix == ".png":
            Image.open(io.BytesIO(path.read_bytes())).load()
        elif path.suffix == ".html":
            assert path.read_text().rstrip().endswith("</html>")


def assert_finishes_like(scene: Path, out: Path, reference: Path) -> None:
    process = start(scene, out)
    _, told = process.communicate()
    assert process.returncode == ExitCode.OK, told
    assert_every_file_is_whole(out)
    names = {path.name for path in reference.iterdir()}
    assert {path.name for path in out.iterdir()} == names
    for name in ("plan.json", "plan.npz", "log.json", "log.npz", "audit.json"):
        assert (out / name).read_bytes() == (reference / name).read_bytes(), name


@pytest.mark.parametrize(
    "appearing",
    ["plan.npz", "planning.json", "log.npz", "audit.json"],
)
def test_killed_when_a_file_appears(
    appearing: str, tmp_path: Path, scene: Path, reference: Path
) -> None:
    out = tmp_path / "run"
    process = start(scene, out)
    wait_for(out / appearing, process)
    process.kill()
    process.communicate()
    assert_every_file_is_whole(out)
    assert_finishes_like(scene, out, reference)


def test_killed_again_and_again_at_random_moments(
    tmp_path: Path, scene: Path, reference: Path
) -> None:
    out = tmp_path / "run"
    moments = random.Random(7)
    for _ in range(6):
        process = start(scene, out)
        time.sleep(moments.uniform(0.1, 2.5))
        process.kill()
        process.communicate()
        assert_every_file_is_whole(out)
    assert_finishes_like(scene, out, reference)


def test_ctrl_c_ends_in_one_line(tmp_path: Path, scene: Path, reference: Path) -> None:
    out = tmp_path / "run"
    process = start(scene, out)
    wait_for(out / "planning.json", process)
    process.send_signal(signal.SIGINT)
    _, told = process.communicate()
    assert process.returncode == 130
    assert told == "mrmg: stopped; the same command takes it up again\n"
    assert_finishes_like(scene, out, reference)
