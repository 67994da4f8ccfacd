"""Planners and routers of other packages, as a user of the command line meets them."""

from __future__ import annotations

import json
import math
import shutil
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mrmg
from mrmg import extensions
from mrmg.cli.main import main
from mrmg.errors import MachineError, UsageError
from mrmg.planning import Attempt, Problem, Request, Routing, RoutingProblem
from mrmg.planning.path_following.strategy import path_following
from mrmg.planning.routers import find_router
from mrmg.planning.routing.routing import RouterParams
from mrmg.testing import sample_routing_problem

MODULE = """
from pathlib import Path
Path(__file__).with_suffix(".imported").touch()
{imports}
"""
WORKING = """
from mrmg.planning.path_following.strategy import path_following
from mrmg.planning.routers import find_router
from mrmg.planning.routing.routing import RouterParams

class Planner:
    def __call__(self, problem, request):
        return path_following(problem, request)

def router(problem, seed):
    return find_router(RouterParams())(problem, seed)
"""

Install = Callable[..., Path]


@pytest.fixture
def install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Install:
    """Return what installs a package of a name, with a planner and a router `mine`."""

    def added(name: str, body: str, version: str = "1.2") -> Path:
        site = tmp_path / "site" / name
        for old in site.glob(f"{name}-*.dist-info"):
            shutil.rmtree(old)
        info = site / f"{name}-{version}.dist-info"
        info.mkdir(parents=True, exist_ok=True)
        (site / f"{name}_code.py").write_text(MODULE.format(imports=body))
        (info / "METADATA").write_text(
            f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n"
        )
        (info / "entry_points.txt").write_text(
            f"[mrmg.planners]\nmine = {name}_code:Planner\n"
            f"path_following = {name}_code:nothing\n"
            f"[mrmg.routers]\nmine = {name}_code:router\n"
        )
        monkeypatch.syspath_prepend(str(site))
        monkeypatch.delitem(sys.modules, f"{name}_code", raising=False)
        extensions.origin.cache_clear()
        return site / f"{name}_code.imported"

    return added


def plan(folder: Path, *words: str) -> int:
    try:
        return main(["plan", "quickstart", "--out", str(folder), *words])
    except SystemExit as ended:
        return int(str(ended.code))


def test_planner_and_router_are_used_and_recorded(
    install: Install, tmp_path: Path
) -> None:
    install("fields", WORKING)
    folder = tmp_path / "run"
    words = ("--planner", "mine", "--router", "mine")
    assert plan(folder, *words) == 0
    header = json.loads((folder / "plan.json").read_text())
    assert (header["planner"], header["router"]) == ("mine", "mine")
    assert header["versions"]["fields"] == "1.2"
    arguments = json.loads((folder / "run.json").read_text())["arguments"]
    assert (arguments["planner"], arguments["router"]) == ("mine", "mine")
    assert mrmg.Plan.load(folder).planner == "mine"
    assert main(["verify", str(folder)]) == 0


def test_another_version_of_the_package_makes_another_plan(
    install: Install, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    install("fields", WORKING)
    folder = tmp_path / "run"
    assert plan(folder, "--router", "mine") == 0
    install("fields", WORKING, version="1.3")
    assert plan(folder, "--router", "mine") == 2
    assert "--overwrite" in capsys.readouterr().err
    assert plan(folder, "--router", "mine", "--overwrite") == 0
    assert mrmg.Plan.load(folder).versions["fields"] == "1.3"


def test_a_run_stays_readable_without_the_package(
    install: Install, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    marker = install("fields", WORKING)
    folder = tmp_path / "run"
    assert plan(folder, "--planner", "mine") == 0
    monkeypatch.setattr(sys, "path", [p for p in sys.path if p != str(marker.parent)])
    extensions.origin.cache_clear()
    assert main(["verify", str(folder)]) == 0
    assert plan(tmp_path / "other", "--planner", "mine") == 2


def test_nothing_is_imported_unasked(install: Install, tmp_path: Path) -> None:
    marker = install("fields", WORKING)
    assert plan(tmp_path / "run") == 0
    assert extensions.names(extensions.PLANNERS)[-1] == "mine"
    assert not marker.exists()


@pytest.mark.parametrize("kind", ["planner", "router"])
def test_an_unknown_name_is_refused_with_those_allowed(
    install: Install, tmp_path: Path, capsys: pytest.CaptureFixture[str], kind: str
) -> None:
    marker = install("fields", WORKING)
    folder = tmp_path / "run"
    assert plan(folder, f"--{kind}", "nime") == 2
    with pytest.raises(UsageError, match="'nime' is not known"):
        mrmg.run("quickstart", out=folder, **{kind: "nime"})
    with pytest.raises(UsageError, match="a run takes names"):
        mrmg.run("quickstart", out=folder, **{kind: follow})
    told = capsys.readouterr().err
    assert f"{kind} 'nime' is not known (did you mean 'mine'?)" in told
    for name in extensions.names(f"mrmg.{kind}s"):
        assert name in told
    assert not folder.exists()
    assert not marker.exists()


@pytest.mark.parametrize(
    ("body", "fault"),
    [
        ("raise RuntimeError('no licence')", "RuntimeError: no licence"),
        ("import a_module_that_nobody_has", "ModuleNotFoundError"),
        ("Planner = router = 7", "is 7, which is not callable"),
        ("", "AttributeError"),
        ("def router(problem, seed): return problem.nothing", "AttributeError"),
        ("def router(problem, seed): return []", "returned [], not a Routing"),
    ],
)
def test_a_broken_package_is_named_and_nothing_is_written(
    install: Install,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    body: str,
    fault: str,
) -> None:
    install("fields", body)
    folder = tmp_path / "run"
    assert plan(folder, "--router", "mine") == 7
    told = capsys.readouterr().err
    assert "router 'mine' of package fields 1.2" in told
    assert fault in told
    assert "Traceback" not in told
    assert not (folder / "planning.json").exists()


def test_a_name_of_two_packages_is_refused(
    install: Install, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    markers = [install(name, WORKING) for name in ("fields", "meadows")]
    assert plan(tmp_path / "run", "--planner", "mine") == 2
    told = capsys.readouterr().err
    assert "fields 1.2" in told
    assert "meadows 1.2" in told
    assert not any(marker.exists() for marker in markers)


def follow(problem: Problem, request: Request) -> Attempt:
    return path_following(problem, request)


class Counting:
    """A router that counts its calls."""

    def __init__(self) -> None:
        self.calls = 0

    def __call__(self, problem: RoutingProblem, seed: int) -> Routing:
        self.calls += 1
        return find_router(RouterParams())(problem, seed)


def test_scripts_pass_objects() -> None:
    router = Counting()
    scene = mrmg.load_scene("quickstart")
    found = mrmg.plan(scene, planner=follow, router=router).plan
    own = mrmg.plan(scene).plan
    assert found is not None
    assert own is not None
    assert router.calls > 0
    assert found.planner.endswith(":follow")
    assert found.router.endswith(":Counting")
    assert found.cost_J == own.cost_J
    assert (own.planner, own.router) == ("path_following", "search")


def test_attempts_that_are_none_are_refused() -> None:
    scene = mrmg.load_scene("quickstart")

    def adrift(problem: Problem, request: Request) -> Attempt:
        (plan,) = path_following(problem, request).plans[-1:]
        moved = tuple(
            replace(each, state=each.state * np.nan) for each in plan.trajectories
        )
        return Attempt(plans=[replace(plan, trajectories=moved)])

    wrong: Any = [5]
    for planner, message in (
        (lambda *_: None, "returned None, not an Attempt"),
        (lambda *_: Attempt(plans=wrong[0]), "not an Attempt"),
        (lambda *_: Attempt(plans=wrong), "an Attempt with 5 among its plans"),
        (adrift, "a plan with states that are not finite"),
    ):
        with pytest.raises(MachineError, match=message):
            mrmg.plan(scene, planner=planner)


@pytest.mark.parametrize("sequence", [list, np.array])
def test_tours_may_be_sequences_of_any_kind(sequence: Any) -> None:
    problem = sample_routing_problem(1)
    routing = find_router(RouterParams())(problem, 0)

    def listing(problem: RoutingProblem, seed: int) -> Routing:
        tours: Any = [sequence(tour) for tour in routing.tours]
        return Routing(tours, routing.cost_J)

    assert find_router(RouterParams(method="listing"), listing)(problem, 0) == routing


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (None, "returned None, not a Routing"),
        (Routing((("a",), ()), 1.0), "tours of whole numbers"),  # type: ignore[arg-type]
        (Routing(((0.0,), ()), 1.0), "tours of whole numbers"),  # type: ignore[arg-type]
        (Routing(((), ()), math.nan), "a cost of nan J; it is inf where there are no"),
    ],
)
def test_routings_that_are_none_are_refused(wrong: Any, message: str) -> None:
    router = find_router(RouterParams(method="wrong"), lambda *_: wrong)
    with pytest.raises(MachineError, match=message):
        router(sample_routing_problem(1), 0)


def test_tours_that_break_their_rules_are_refused() -> None:
    def forgetful(problem: RoutingProblem, seed: int) -> Routing:
        routing = find_router(RouterParams())(problem, seed)
        first, *others = routing.tours
        return Routing((first[1:], *others), routing.cost_J)

    with pytest.raises(MachineError, match="goal . is visited 0 times, not 1"):
        mrmg.plan(mrmg.load_scene("quickstart"), router=forgetful)
