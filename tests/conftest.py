"""What all tests share: the order of tests, and one run of the shipped quickstart.

Slow are the tests marked so, and those that `slow_tests.txt` lists: all that took more
than `QUICK_S` of processor time. `pytest --list-slow` brings the list up to date with
the tests that it runs. Tests marked ci repeat at length what others show at one case
(all shipped scenes, other maps, a compilation from nothing); they run where CI=true.
"""

from __future__ import annotations

import os
import shutil
import signal
from collections.abc import Generator
from pathlib import Path

import pytest
from hypothesis import settings

pytest_plugins = ("handmade",)

# Equal examples whenever the tests run, and none judged by its time.
settings.register_profile("mrmg", derandomize=True, deadline=None)
settings.load_profile("mrmg")

SLOW_TESTS = Path(__file__).with_name("slow_tests.txt")
QUICK_S = 0.4
"""Processor time that a test of the fast part may take."""

NOT_HERE = pytest.mark.skipif(
    os.environ.get("CI") != "true", reason="at length where CI=true"
)

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


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the option that measures which tests are slow."""
    parser.addoption("--list-slow", action="store_true", help=f"update {SLOW_TESTS}")


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Run the slow tests last, so that a broken build is reported early.

    Where a test is marked quick for some of its parameters, the others are slow.
    """
    listed = set(SLOW_TESTS.read_text().splitlines())
    for item in items:
        quick = item.get_closest_marker("quick")
        called = getattr(item, "callspec", None)
        others = quick and called and called.id not in quick.args
        if others or item.nodeid in listed:
            item.add_marker(pytest.mark.slow)
        if item.get_closest_marker("ci"):
            item.add_marker(pytest.mark.slow)
            item.add_marker(NOT_HERE)
    items.sort(key=lambda item: item.get_closest_marker("slow") is not None)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Generator[None, object, object]:
    """Note a test as slow or quick, where that is measured."""
    began_s = sum(os.times()[:4])
    result = yield
    if item.config.getoption("--list-slow"):
        slow = {*SLOW_TESTS.read_text().splitlines()} - {item.nodeid}
        if sum(os.times()[:4]) - began_s > QUICK_S:
            slow.add(item.nodeid)
        SLOW_TESTS.write_text("".join(f"{name}\n" for name in sorted(slow)))
    return result


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
