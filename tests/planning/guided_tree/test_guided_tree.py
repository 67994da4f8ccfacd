"""The planner guided_tree through public doors: plans, caps, refusals, routers."""

from __future__ import annotations

import copy
import inspect
import pkgutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mrmg
from mrmg.cli.main import main
from mrmg.errors import UsageError
from mrmg.planning import guided_tree, plan_mission, profile_params
from mrmg.planning.guided_tree._expansion_kernels import steer
from mrmg.planning.guided_tree.planner import grow_guided_tree
from mrmg.planning.parameters import GuidedTreeParams
from mrmg.planning.problem.problem import state_mission
from mrmg.planning.routing.routing import RouterParams
from mrmg.plans import PlanStatus
from mrmg.scene.loading import load_scene, scene_from_document
from mrmg.scene.types import Scene

SCENES = Path(__file__).parents[2] / "scenes"


def test_a_robot_recharges_once_where_it_enters_a_station() -> None:
    scene = load_scene(SCENES / "station_needed.yaml")
    result = plan_mission(scene, seed=5, params=profile_params("paper"))
    assert result.plan is not None, result.reason
    assert result.plan.tours["r1"] == ("s1", "g1")


@pytest.mark.parametrize(
    "name",
    [
        "one_goal",
        pytest.param("two_swap", marks=pytest.mark.ci),
        "station_needed",
        "no_goals",
    ],
)
def test_plans_are_valid_and_reproducible(name: str) -> None:
    scene = load_scene(SCENES / f"{name}.yaml")
    first, second = (
        plan_mission(scene, seed=6, params=profile_params("paper")) for _ in range(2)
    )
    assert first.plan is not None, first.reason
    assert mrmg.verify(scene, first.plan).violations == ()
    assert second.plan is not None
    assert first.plan.digest == second.plan.digest
    assert first.plan.profile == "paper"
    assert first.statistics["iterations"] <= first.statistics["iteration_cap"]


def test_the_profile_is_the_planner_with_its_router() -> None:
    named = profile_params(planner="guided_tree", router="nrpa")
    assert named == profile_params("paper") == profile_params(planner="guided_tree")
    assert (named.planner, named.router.method) == ("guided_tree", "nrpa")
    plain = profile_params()
    assert (plain.planner, plain.router.method) == ("path_following", "search")


@pytest.mark.parametrize("router", ["nrpa", "search", "exact"])
def test_path_following_takes_any_router(router: str) -> None:
    scene = load_scene(SCENES / "two_swap.yaml")
    params = profile_params(planner="path_following", router=router)
    assert params.router.method == router
    result = plan_mission(scene, params=params)
    assert result.plan is not None
    assert mrmg.verify(scene, result.plan).ok


@pytest.mark.parametrize(
    ("choice", "named"),
    [
        ({"planner": "guided_tree", "router": "search"}, "nrpa alone"),
        ({"profile": "paper", "router": "exact"}, "nrpa alone"),
        ({"profile": "paper", "planner": "path_following"}, "profile paper"),
        ({"planner": "rrt"}, "planner"),
        ({"router": "greedy"}, "greedy"),
    ],
)
def test_choices_that_contradict_each_other_are_refused(
    choice: dict[str, Any], named: str
) -> None:
    with pytest.raises(UsageError, match=named):
        profile_params(**choice)


@pytest.mark.parametrize(
    ("name", "value"),
    [("decline", 1.0), ("decline", 0.0), ("decay_rate", 1.0), ("k", 0), ("bias", 1.1)],
)
def test_parameters_out_of_range_are_refused_by_name(name: str, value: Any) -> None:
    with pytest.raises(UsageError, match=name):
        GuidedTreeParams(**{name: value})


def test_the_cap_on_iterations_ends_the_search_and_is_reported() -> None:
    scene = load_scene(SCENES / "two_swap.yaml")
    capped = replace(
        profile_params("paper"), guided_tree=GuidedTreeParams(iterations=7)
    )
    result = plan_mission(scene, params=capped)
    assert result.status is PlanStatus.NO_PLAN_FOUND
    assert "7 of at most 7 iterations" in result.reason
    assert result.statistics["iterations"] == result.statistics["iteration_cap"] == 7


def test_the_command_line_prints_iterations_and_their_cap(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    scene, run = str(SCENES / "one_goal.yaml"), str(tmp_path / "run")
    words = ["plan", scene, "--planner", "guided_tree", "--router", "nrpa"]
    assert main([*words, "--out", run]) == 0
    cap = GuidedTreeParams().iterations
    assert f"of at most {cap} iterations" in capsys.readouterr().out


def test_a_mission_of_many_robots_has_room_in_memory() -> None:
    """Growing is halted at once: only the tree is made, and the first tours."""
    circle = {"radius": 1.5}
    document = {
        "format": 1,
        "name": "crowd",
        "bounds": [0, 0, 240, 120],
        "goals": [
            {"id": f"g{n}", "circle": {"center": [20 + 2 * n, 110], **circle}}
            for n in range(100)
        ],
        "stations": [
            {"id": f"s{n}", "circle": {"center": [40 * n + 20, 60], **circle}}
            for n in range(4)
        ],
        "robots": [
            {"id": f"r{n}", "model": "car", "pose": [20 + 4 * n, 10, 1.57]}
            for n in range(50)
        ],
    }
    scene = scene_from_document(document, source="crowd")
    params = replace(
        profile_params("paper"),
        samples=300,
        router=RouterParams(method="nrpa", levels=1, iterations=1),
    )
    problem = state_mission(scene, 0, params)
    growth = grow_guided_tree(problem, params, 0, np.ones(1, np.bool_))
    assert growth.counts["iterations"] == 0


def test_a_tree_that_has_no_room_in_memory_is_refused() -> None:
    scene = load_scene(SCENES / "two_swap.yaml")
    huge = replace(
        profile_params("paper"), guided_tree=GuidedTreeParams(iterations=10**12)
    )
    with pytest.raises(UsageError, match=r"no room in memory.*path_following"):
        plan_mission(scene, params=huge)


@pytest.mark.parametrize("reverse", [True, False])
def test_a_car_turns_round_to_what_is_behind_it_as_it_can(
    mission: dict[str, Any], reverse: bool
) -> None:
    scene = scene_from_document(mission, source="court")
    fleet = state_mission(scene, 0, profile_params("paper")).mission.fleet.copy()
    if not reverse:
        fleet["limit"][:, 0] = 0.0
    x, y, theta = scene.robots[0].pose
    state = np.array([x, y, theta, 0.0, 0.0])
    speed_up, turn = steer(fleet, 0, state, x - 6.0, y + 0.5, 0.5)
    assert speed_up < 0.0 if reverse else speed_up > 0.0
    assert turn > 0.0


# --- what the paper lacks -------------------------------------------------------------


@pytest.fixture
def changed(mission: dict[str, Any]) -> Callable[..., Scene]:
    """Return the maker of missions with other sections, or entries in their first."""

    def make(**changes: Any) -> Scene:
        document = copy.deepcopy(mission)
        for part, change in changes.items():
            if isinstance(document.get(part), list):
                document[part][0] |= change
            else:
                document[part] = change
        return scene_from_document(document, source="court")

    return make


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"goals": {"dwell": 3}}, r"dwell times \(g1\)"),
        ({"stations": {"dwell": 3}}, r"dwell times \(s1\)"),
        ({"stations": {"capacity": 1}}, r"one robot at a time \(s1\)"),
        (
            {"battery": {"capacity_m": 40, "charging_power": 500}},
            r"recharging that takes time \(r1, r2\)",
        ),
        (
            {"robots": {"finish": {"circle": {"center": [4, 4], "radius": 1.5}}}},
            r"finishes \(r1\)",
        ),
        ({"time_limit": 90}, r"time limits \(90 s\)"),
        ({"objective": "makespan"}, r"other than energy \(makespan\)"),
    ],
)
def test_features_that_the_paper_lacks_are_refused_by_name(
    changed: Callable[..., Scene], changes: dict[str, Any], named: str
) -> None:
    with pytest.raises(UsageError, match=named) as refused:
        plan_mission(changed(**changes), params=profile_params("paper"))
    assert "--planner path_following" in str(refused.value)


def test_all_that_the_paper_lacks_is_named_at_once(
    changed: Callable[..., Scene],
) -> None:
    scene = changed(time_limit=90, goals={"dwell": 3})
    with pytest.raises(UsageError, match="dwell times.*time limits"):
        plan_mission(scene, params=profile_params("paper"))


def test_a_refused_scene_leaves_no_run(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["plan", "hills", "--profile", "paper", "--out", str(tmp_path / "run")]
    assert main(words) == 2
    assert "elevation" in capsys.readouterr().err
    assert not (tmp_path / "run" / "planning.json").exists()


# --- a package of its own -------------------------------------------------------------


def test_no_router_but_nrpa_is_used() -> None:
    """That nothing of the other strategies is, is an import contract."""
    routing = {"_nrpa_kernels", "_random_kernels"}
    for module in pkgutil.iter_modules(
        guided_tree.__path__, f"{guided_tree.__name__}."
    ):
        source = inspect.getsource(__import__(module.name, fromlist=["_"]))
        lines = [line.split() for line in source.splitlines()]
        used = {words[1] for words in lines if words[:1] == ["from"]}
        routers = {name for name in used if ".planning.routing" in name}
        assert {name.rpartition(".")[2] for name in routers} <= routing
