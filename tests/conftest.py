"""What all tests share: the order of tests, and one run of the shipped quickstart."""

from __future__ import annotations

import shutil
import signal
from pathlib import Path

import pytest
from hypothesis import settings

pytest_plugins = ("handmade",)

# Equal examples whenever the tests run, and none judged by its time.
settings.register_profile("mrmg", derandomize=True, deadline=None)
settings.load_profile("mrmg")

WALLED = """\
format: 1
name: walled
bounds: [0, 0, 30, 20]
obstacles:
  - polygon: [[18, 4], [28, 4], [28, 16], [18, 16]]
    holes: [[[20, 6], [26, 6], [26, 14], [20, 14]]]
goals:
  - {id: g1, circle: {center: [23, 10], radius: 1.0}}
battery: {capacity_m: 100}
robots:
  - {id: r1, model: car, pose: [5, 10, 0]}
"""


def pytest_configure() -> None:
    """Let commands under test be stopped by Ctrl-C.

    A shell that starts the tests in the background has them ignore it, and what they
    start would inherit that.
    """
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Run the slow tests last, so that a broken build is told early.

    Where a test is marked quick for some of its parameters, the others are slow.
    """
    for item in items:
        quick = item.get_closest_marker("quick")
        called = getattr(item, "callspec", None)
        if quick and called and called.id not in quick.args:
            item.add_marker(pytest.mark.slow)
    items.sort(key=lambda item: item.get_closest_marker("slow") is not None)


@pytest.fixture(scope="session")
def quickstart_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The run folder of a quickstart without video; only to be read."""
    from mrmg.runs import pipeline

    folder = tmp_path_factory.mktemp("runs") / "quickstart"
    pipeline.run("quickstart", out=folder, video=None)
    return folder


@pytest.fixture
def own_run(quickstart_run: Path, tmp_path: Path) -> Path:
    """A copy of that run folder to do anything with."""
    return Path(shutil.copytree(quickstart_run, tmp_path / "run"))


@pytest.fixture
def walled_scene(tmp_path: Path) -> Path:
    """A scene whose only goal stands inside a wall without a door."""
    path = tmp_path / "walled.yaml"
    path.write_text(WALLED)
    return path
