"""The bench of the physics tells a row that holds from one that misses."""

from __future__ import annotations

import importlib.util
import json
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from mrmg import shipped
from mrmg.results.robustness import Study, Trial
from mrmg.scene.loading.models import load_model

TOOL = Path(__file__).parents[2] / "tools" / "bench_physics.py"


@pytest.fixture(scope="module")
def bench() -> ModuleType:
    spec = importlib.util.spec_from_file_location("bench_physics", TOOL)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def row(seed: int = 0, **changes: Any) -> dict[str, Any]:
    """A mission that holds every figure, but for what is changed."""
    robot = {"metered_pct": -0.1, "measured_pct": 0.2, "rms_m": 0.003, "max_m": 0.01}
    robot |= {key: changes.pop(key) for key in list(changes) if key in robot}
    mission = {
        "seed": seed,
        "fleet": 2,
        "feasible": True,
        "robots": [robot],
        "realtime": 50.0,
        "realtime_clock": 10.0,
        "controller_ms": {"median": 0.3, "p99": 0.5},
    }
    return mission | changes


def test_a_mission_within_all_figures_holds(bench: ModuleType) -> None:
    assert bench.faults_of([row(seed) for seed in range(3)]) == []
    assert bench.verdict([]) == "holds"


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"feasible": False}, "seed 1 infeasible"),
        ({"metered_pct": -2.1}, "worst metered_pct 2.1 > 2"),
        ({"measured_pct": 4.1}, "worst measured_pct 4.1 > 4"),
        ({"rms_m": 0.031}, "worst rms_m 0.031 > 0.03"),
        ({"max_m": 0.16}, "worst max_m 0.16 > 0.15"),
    ],
)
def test_one_bad_mission_makes_the_row_miss(
    bench: ModuleType, changes: dict[str, Any], told: str
) -> None:
    faults = bench.faults_of([row(0), row(1, **changes), row(2)])
    assert faults == [told]
    assert bench.verdict(faults) == f"MISSES: {told}"


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"metered_pct": 1.1}, "median metered_pct 1.1 > 1"),
        ({"measured_pct": -2.1}, "median measured_pct 2.1 > 2"),
        ({"realtime": 39.0}, "39 x real time < 40"),
        ({"fleet": 8, "realtime": 11.0}, "11 x real time < 12"),
        (
            {"controller_ms": {"median": 1.5, "p99": 2.0}},
            "controller median ms 1.5 > 1",
        ),
        ({"controller_ms": {"median": 0.5, "p99": 6.0}}, "controller p99 ms 6 > 5"),
    ],
)
def test_medians_count_where_figures_are_of_the_median(
    bench: ModuleType, changes: dict[str, Any], told: str
) -> None:
    assert bench.faults_of([row(0, **changes)] * 3) == [told]
    if "fleet" not in changes:
        assert bench.faults_of([row(0), row(1, **changes), row(2)]) == []


def test_larger_fleets_may_be_slower(bench: ModuleType) -> None:
    assert bench.faults_of([row(fleet=8, realtime=13.0)]) == []
    assert bench.faults_of([row(fleet=3, realtime=13.0)]) == []


def study(feasible: int, trials: int) -> Study:
    """Trials of which the first so many are feasible."""
    blank = dict.fromkeys(Trial.__dataclass_fields__, 0)
    return Study(
        options={},
        trials=tuple(
            Trial(**{**blank, "seed": seed, "feasible": seed < feasible})
            for seed in range(trials)
        ),
    )


def test_the_gain_by_replanning_is_that_over_all_scenes(bench: ModuleType) -> None:
    carried, failing, saved = study(10, 10), study(5, 10), study(9, 10)
    assert bench.share([carried, failing]) == 0.75
    assert bench.gain_faults([carried, failing], [carried, saved]) == []
    assert bench.gain_faults([carried, carried], [carried, saved]) == [
        "-5% by replanning"
    ]


def test_seeds_are_read(bench: ModuleType) -> None:
    assert bench.seeds_of("2-4") == range(2, 5)
    assert bench.seeds_of("7") == range(7, 8)


def test_a_mission_without_plan_is_told_and_breaks_nothing(bench: ModuleType) -> None:
    lost = {"seed": 4, "fleet": 2, "feasible": False, "reasons": ["x"], "robots": []}
    assert bench.faults_of([lost]) == ["seed 4 infeasible"]
    assert bench.cells("somewhere", [lost]) == ["somewhere", "2", "0/1"]
    assert bench.faults_of([row(0), lost]) == ["seed 4 infeasible"]


@pytest.mark.parametrize("name", shipped.model_names())
def test_robots_turn_as_their_wheels_say(bench: ModuleType, name: str) -> None:
    model, _ = load_model(shipped.models_folder() / name)
    error_pct = bench.yaw_error_pct(model, 1.0, 0.3)
    assert abs(error_pct) < bench.YAW_ERROR_PCT
    assert error_pct != 0.0


@pytest.mark.slow
def test_the_quickstart_is_driven_and_written(
    bench: ModuleType,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    output = tmp_path / "rows.jsonl"
    arguments = "--scenes quickstart --seeds 0-1 --no-yaw --output"
    monkeypatch.setattr(sys, "argv", ["bench", *arguments.split(), str(output)])
    code = bench.main()
    told = capsys.readouterr().out
    line = next(item for item in told.splitlines() if item.startswith("quickstart"))
    assert " | 2/2 | " in line
    assert code == ("MISSES" in line)
    rows = [json.loads(item) for item in output.read_text().splitlines()]
    assert [item["seed"] for item in rows] == [0, 1]
    for item in rows:
        assert item["feasible"]
        for robot in item["robots"]:
            assert abs(robot["measured_pct"]) < 4.0
            assert robot["parts_J"]["rolling"] > robot["parts_J"]["turning"] > 0.0
