"""The bench of the physics tells a row that holds from one that misses."""

from __future__ import annotations

import importlib
import json
import sys
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from mrmg import shipped
from mrmg.scene.loading.models import load_model
from mrmg.studies.outcomes import Study, Trial

TOOLS = Path(__file__).parents[2] / "tools"


@pytest.fixture(scope="module")
def bench() -> Iterator[SimpleNamespace]:
    """The bench's modules by name, as its script finds them beside itself."""
    names = ("figures", "missions", "trials", "yaw")
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(TOOLS))
        yield SimpleNamespace(
            script=importlib.import_module("bench_physics"),
            **{name: importlib.import_module(f"physics.{name}") for name in names},
        )


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


def test_a_mission_within_all_figures_holds(bench: SimpleNamespace) -> None:
    assert bench.missions.faults_of([row(seed) for seed in range(3)]) == []
    assert bench.figures.verdict([]) == "holds"


@pytest.mark.parametrize(
    ("changes", "reported"),
    [
        ({"feasible": False}, "seed 1 infeasible"),
        ({"metered_pct": -2.1}, "worst metered_pct 2.1 > 2"),
        ({"measured_pct": 4.1}, "worst measured_pct 4.1 > 4"),
        ({"rms_m": 0.031}, "worst rms_m 0.031 > 0.03"),
        ({"max_m": 0.16}, "worst max_m 0.16 > 0.15"),
    ],
)
def test_one_bad_mission_makes_the_row_miss(
    bench: SimpleNamespace, changes: dict[str, Any], reported: str
) -> None:
    faults = bench.missions.faults_of([row(0), row(1, **changes), row(2)])
    assert faults == [reported]
    assert bench.figures.verdict(faults) == f"MISSES: {reported}"


@pytest.mark.parametrize(
    ("changes", "reported"),
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
    bench: SimpleNamespace, changes: dict[str, Any], reported: str
) -> None:
    assert bench.missions.faults_of([row(0, **changes)] * 3) == [reported]
    if "fleet" not in changes:
        assert bench.missions.faults_of([row(0), row(1, **changes), row(2)]) == []


def test_larger_fleets_may_be_slower(bench: SimpleNamespace) -> None:
    assert bench.missions.faults_of([row(fleet=8, realtime=13.0)]) == []
    assert bench.missions.faults_of([row(fleet=3, realtime=13.0)]) == []


def study(feasible: int, trials: int) -> Study:
    """Trials of which the first so many are feasible."""
    blank = dict.fromkeys(Trial.__dataclass_fields__, 0) | {"causes": ()}
    return Study(
        options={},
        trials=tuple(
            Trial(**{**blank, "seed": seed, "feasible": seed < feasible})
            for seed in range(trials)
        ),
    )


def test_the_gain_by_replanning_is_that_over_all_scenes(bench: SimpleNamespace) -> None:
    carried, failing, saved = study(10, 10), study(5, 10), study(9, 10)
    assert bench.trials.share([carried, failing]) == 0.75
    gained = bench.trials.gain_figure([carried, failing], [carried, saved])
    assert gained.holds
    assert gained.found == "+20.0%"
    lost = bench.trials.gain_figure([carried, carried], [carried, saved])
    assert not lost.holds
    assert lost.found == "-5.0%"


@pytest.mark.parametrize(
    ("feasible", "trials", "holds", "asked"),
    [(95, 100, True, ">= 95/100"), (94, 100, False, ">= 95/100"), (2, 2, True, "all")],
)
def test_a_share_of_the_trials_must_be_feasible(
    bench: SimpleNamespace, feasible: int, trials: int, holds: bool, asked: str
) -> None:
    own = study(feasible, trials)
    figure = bench.trials.figure_of("scene1", bench.trials.DEFAULT, own)
    assert (figure.holds, figure.asked) == (holds, asked)
    assert figure.found == f"{feasible}/{trials}"


def test_every_figure_is_told_and_judged(
    bench: SimpleNamespace, capsys: pytest.CaptureFixture[str]
) -> None:
    slow = row(0, scene="b", realtime=39.0)
    rows = [row(seed, scene="a") for seed in range(3)] + [slow]
    figures = bench.missions.figures_of(rows)
    assert [item.what for item in figures if not item.holds] == [
        "x real time with 2 robots, slowest scene"
    ]
    bench.figures.print_figures(figures)
    reported = capsys.readouterr().out
    assert "feasible missions | 4/4 | all | PASS" in reported
    assert "slowest scene | 39 | >= 40 | FAIL" in reported
    assert reported.endswith("1 figures FAIL\n")


def test_rows_that_nothing_is_asked_of_are_told_but_not_judged(
    bench: SimpleNamespace,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """However few of their trials are feasible; the others decide."""
    trials = bench.trials
    same = bench.figures.Figure("a trial by a worker and here", "same", "same", True)
    monkeypatch.setattr(trials, "repeated_figure", lambda _: same)
    monkeypatch.setattr(
        trials, "study_of", lambda _, kind, __: study(10 if kind.least else 1, 10)
    )
    figures, table = trials.disturbance_figures(None)
    reported = capsys.readouterr().out.splitlines()
    rows = [line.split(" | ") for line in reported if line.startswith("scene")][1:]
    assert {row[4]: row[-1] for row in rows} == {"10/10": "holds", "1/10": "not judged"}
    assert [line["feasible"] for line in table] == [10, 1, 10, 1, 10] * 2
    names = [figure.what for figure in figures]
    assert len(names) == 2 * 3 + 2
    assert all(figure.holds for figure in figures)
    assert "scene1, default and rolling=+30%" not in names
    assert "scene1, default and rolling=+30%, replanning" in names


def test_a_mission_without_plan_is_told_and_breaks_nothing(
    bench: SimpleNamespace,
) -> None:
    lost = {"seed": 4, "fleet": 2, "feasible": False, "reasons": ["x"], "robots": []}
    assert bench.missions.faults_of([lost]) == ["seed 4 infeasible"]
    line = bench.missions.line_of("somewhere", [lost])
    assert bench.missions.cells(line) == ["somewhere", "2", "0/1"]
    assert line["rms_m_worst"] is None
    driven = bench.missions.line_of("somewhere", [row(0), lost])
    assert driven.keys() == line.keys()
    assert (driven["rms_m_worst"], driven["x_real_clock"]) == (0.003, 10.0)
    assert bench.missions.faults_of([row(0), lost]) == ["seed 4 infeasible"]


@pytest.mark.parametrize("name", shipped.model_names())
def test_robots_turn_as_their_wheels_say(bench: SimpleNamespace, name: str) -> None:
    model, _ = load_model(shipped.models_folder() / name)
    error_pct = bench.yaw.yaw_error_pct(model, 1.0, 0.3)
    assert abs(error_pct) < bench.yaw.YAW_ERROR_PCT
    assert error_pct != 0.0


@pytest.mark.slow
def test_the_quickstart_is_driven_kept_and_not_driven_again(
    bench: SimpleNamespace,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    output = tmp_path / "rows.jsonl"
    document = tmp_path / "bench.json"
    arguments = ["--scenes", "quickstart", "--no-yaw", "--output", str(output)]
    arguments += ["--json", str(document)]
    monkeypatch.setattr(sys, "argv", ["bench", *arguments, "--seeds", "0"])
    code = bench.script.main()
    reported = capsys.readouterr().out
    line = next(item for item in reported.splitlines() if item.startswith("quickstart"))
    assert " | 1/1 | " in line
    assert code == ("| FAIL" in reported)
    assert "a mission driven again | same log | same log | PASS" in reported
    rows = [json.loads(item) for item in output.read_text().splitlines()]
    assert [item["seed"] for item in rows] == [0]
    for item in rows:
        assert item["feasible"]
        for robot in item["robots"]:
            assert abs(robot["measured_pct"]) < 4.0
            assert robot["parts_J"]["rolling"] > robot["parts_J"]["turning"] > 0.0
    monkeypatch.setattr(
        sys, "argv", ["bench", *arguments, "--seeds", "0-1", "--workers", "2"]
    )
    bench.script.main()
    assert f"1 trials are in {output}" in capsys.readouterr().out
    more = [json.loads(item) for item in output.read_text().splitlines()]
    assert more[:1] == rows
    assert [item["seed"] for item in more] == [0, 1]
    written = json.loads(document.read_text())
    assert written["protocol"]["seeds"] == [0, 1]
    assert written["ok"] == all(figure["holds"] for figure in written["figures"])
    assert (written["yaw"], written["disturbances"]) == ([], [])
    (line,) = written["rows"]
    assert (line["scene"], line["feasible"], line["missions"]) == ("quickstart", 2, 2)
    assert 0.0 < line["measured_pct_worst"] < 4.0
