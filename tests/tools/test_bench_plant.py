"""What the benches of plant and controllers make of their missions."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import bench_controllers
import bench_plant
import pytest

import mrmg
from mrmg import storage


def mission(stage: str, errors_pct: list[float], feasible: bool = True) -> Any:
    return {"stage": stage, "errors_pct": errors_pct, "feasible": feasible}


def test_a_line_has_both_stages() -> None:
    row = bench_plant.summary(
        "scene1",
        [
            mission("before", [8.0, -2.0, 5.0], feasible=False),
            mission("after", [1.0, -2.0, 0.5]),
        ],
    )
    assert row["scene"] == "scene1"
    assert (row["robots"], row["missions"]) == (3, 1)
    assert (row["before_median_pct"], row["before_worst_pct"]) == (5.0, 8.0)
    assert (row["before_feasible"], row["after_feasible"]) == (0, 1)
    assert (row["after_median_pct"], row["after_signed_median_pct"]) == (1.0, 0.5)
    assert bench_plant.holds(row)


@pytest.mark.parametrize(
    "after", [([3.1, 3.1, 0.1], True), ([1.0, 1.0, 6.1], True), ([1.0], False)]
)
def test_a_target_that_is_missed_is_seen(after: tuple[list[float], bool]) -> None:
    errors_pct, feasible = after
    missions = [mission("before", [0.0]), mission("after", errors_pct, feasible)]
    assert not bench_plant.holds(bench_plant.summary("all", missions))


def test_what_calibration_found_is_what_the_robots_are_planned_with() -> None:
    scene = mrmg.load_scene("quickstart")
    found = {
        "car": {
            "found": [
                {"parameter": "rolling_coefficient", "value": 0.0655},
                {"parameter": "turning_coefficient", "value": 0.027},
                {"parameter": "wheel_inertia_kg_m2", "value": 0.26},
            ]
        }
    }
    other = bench_plant.with_found(scene, found)
    for robot in other.robots:
        assert robot.model.rolling_coefficient == 0.0655
        assert robot.model.turning_coefficient == 0.027
        assert robot.model.wheel_inertia_kg_m2 == 0.26
    assert [robot.battery for robot in other.robots] == [
        robot.battery for robot in scene.robots
    ]


def test_a_line_of_controllers_is_of_medians_and_worst_clearances() -> None:
    def trial(rms_m: float, robots_m: float, cause: str = "") -> dict[str, Any]:
        rest = {name: 1.0 for name, _ in bench_controllers.COLUMNS}
        return {
            **rest,
            "scene": "hills",
            "kind": "harsh",
            "controller": "tvlqr",
            "feasible": not cause,
            "causes": [cause] if cause else [],
            "rms_m": rms_m,
            "robots_m": robots_m,
            "bounded_pct": None,
        }

    trials = [trial(0.1, 2.0), trial(0.4, 0.5, "contact"), trial(0.2, 3.0)]
    row = bench_controllers.summary(trials)
    assert (row["feasible"], row["trials"]) == (2, 3)
    assert (row["rms_m"], row["robots_m"]) == (0.2, 0.5)
    assert row["bounded_pct"] is None
    assert row["failures"] == {"contact": 1}


@pytest.mark.parametrize(
    ("main", "options"),
    [
        (bench_plant.main, ["--seeds", "0"]),
        (bench_controllers.main, ["--controllers", "mpc", "--trials", "1"]),
    ],
    ids=["plant", "controllers"],
)
def test_trials_of_a_changed_scene_of_the_same_name_are_made_again(
    main: Callable[[], int],
    options: list[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    made: list[str] = []

    def noted(what: str, row: dict[str, Any]) -> Callable[..., dict[str, Any]]:
        return lambda *_: made.append(what) or row

    measured = {name: 1.0 for name, _ in bench_controllers.COLUMNS}
    driven = {**measured, "feasible": True, "causes": []}
    monkeypatch.setattr(mrmg, "plan", lambda *_, **__: SimpleNamespace(plan="a plan"))
    monkeypatch.setattr(bench_controllers, "driven", noted("drive", driven))
    flown = {"feasible": True, "errors_pct": [1.0], "why": []}
    monkeypatch.setattr(bench_plant, "mission", noted("mission", flown))
    monkeypatch.setattr(bench_plant, "calibrated", noted("model", {"found": []}))
    scene, rows = tmp_path / "scene.yaml", tmp_path / "rows.jsonl"
    words = ["bench", "--scenes", str(scene), "--output", str(rows), *options]
    monkeypatch.setattr(sys, "argv", words)
    document = mrmg.load_scene("quickstart").document
    counts = []
    for name in ("one", "one", "other"):
        storage.write_json(scene, {**document, "name": name})
        made.clear()
        main()
        counts.append([each for each in made if each != "model"])
    assert counts[0]
    assert counts == [counts[0], [], counts[0]]
