"""The bench of missions: its document, and how it goes on after an interruption."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

import bench
import protocol
import pytest
from mission_tables import print_scene

from mrmg.planning import PlannerParams
from mrmg.scene.loading import load_scene
from mrmg.scene.types import Scene


class Bench:
    """The bench on the quickstart, which counts the missions that it plans."""

    def __init__(self, folder: Path, patch: pytest.MonkeyPatch) -> None:
        self.output, self.document = folder / "rows.jsonl", folder / "bench.json"
        self.planned: list[tuple[int, str]] = []
        self._patch = patch
        planned = bench.planned

        def counted(*arguments: Any) -> Any:
            self.planned.append((arguments[2], arguments[3]))
            return planned(*arguments)

        patch.setattr(bench, "planned", counted)

    def run(self, *arguments: str) -> dict[str, Any]:
        """Return the document; `planned` has the (seed, profile) that were planned."""
        self.planned.clear()
        fixed = ["bench", "--scenes", "quickstart", "--output", str(self.output)]
        fixed += ["--json", str(self.document)]
        self._patch.setattr(sys, "argv", [*fixed, *arguments])
        assert bench.main() == 0
        return json.loads(self.document.read_text())

    def lines(self) -> list[str]:
        return self.output.read_text().splitlines()


def table_line(printed: str) -> list[str]:
    lines = printed.splitlines()
    return next(line for line in lines if line.startswith("quickstart")).split(" | ")


@pytest.fixture
def quickstart(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Bench:
    return Bench(tmp_path, monkeypatch)


def test_an_interrupted_bench_goes_on(
    quickstart: Bench, capsys: pytest.CaptureFixture[str]
) -> None:
    whole = quickstart.run("--seeds", "0-2")
    printed = table_line(capsys.readouterr().out)
    assert [seed for seed, _ in quickstart.planned] == [0, 1, 2]
    before = quickstart.lines()
    assert [json.loads(line)["seed"] for line in before] == [0, 1, 2]
    text = quickstart.output.read_text()
    quickstart.output.write_text(text[: -len(before[2]) // 2])  # half the last line
    again = quickstart.run("--seeds", "0-2")
    assert [seed for seed, _ in quickstart.planned] == [2]
    assert quickstart.lines()[:2] == before[:2]
    assert [json.loads(line)["seed"] for line in quickstart.lines()] == [0, 1, 2]
    assert again["rows"][0]["cost_m_median"] == whole["rows"][0]["cost_m_median"]
    capsys.readouterr()
    assert quickstart.run("--seeds", "0-2") == again
    assert quickstart.planned == []
    repeated = capsys.readouterr().out
    assert f"3 trials are in {quickstart.output}" in repeated
    assert table_line(repeated)[-1] == printed[-1]


def test_a_line_without_its_end_of_line_is_whole(quickstart: Bench) -> None:
    quickstart.run("--seeds", "0")
    quickstart.output.write_text(quickstart.output.read_text().rstrip("\n"))
    quickstart.run("--seeds", "0-1")
    assert [seed for seed, _ in quickstart.planned] == [1]
    assert [json.loads(line)["seed"] for line in quickstart.lines()] == [0, 1]


def test_trials_of_other_arguments_or_code_are_made_again(
    quickstart: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    quickstart.run("--seeds", "0")
    first = quickstart.lines()
    charged = quickstart.run("--seeds", "0", "--energy", "paper")
    assert [seed for seed, _ in quickstart.planned] == [0]
    assert charged["protocol"]["energy"] == "paper"
    assert len(quickstart.lines()) == 1
    old = quickstart.output.with_name("rows.jsonl.old")
    assert old.read_text().splitlines() == first
    monkeypatch.setattr(protocol, "state", lambda: "another")
    other = quickstart.run("--seeds", "0", "--energy", "paper")
    assert [seed for seed, _ in quickstart.planned] == [0]
    assert other["protocol"]["state"] == "another"
    assert len(quickstart.lines()) == 1


def test_the_document_has_the_same_keys_whatever_is_measured(
    quickstart: Bench,
) -> None:
    plain = quickstart.run("--seeds", "0")
    assert plain.keys() == {"bench", "protocol", "rows", "ok", "ratios"}
    assert (plain["bench"], plain["ok"], plain["ratios"]) == ("bench", True, [])
    reported = plain["protocol"]
    assert (reported["scenes"], reported["seeds"]) == (["quickstart"], [0])
    assert (reported["profile"], reported["budget"]) == (["default"], None)
    assert {"mrmg", "mujoco", "numba", "Python"} <= reported["versions"].keys()
    assert reported["machine"]
    (row,) = plain["rows"]
    assert (row["scene"], row["profile"]) == ("quickstart", "default")
    assert (row["ok"], row["runs"]) == (1, 1)
    assert row["first_s_median"] > 0.0
    assert row["cost_to_bound_first"] is None
    assert row["rms_m_worst"] is None
    bounded = quickstart.run("--seeds", "0", "--bound")
    assert quickstart.planned
    assert bounded["rows"][0].keys() == row.keys()
    assert bounded["rows"][0]["cost_to_bound_first"] >= 1.0


def test_every_profile_is_warm_before_anything_is_timed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    planned: list[str] = []

    def note(scene: Scene, *, params: PlannerParams | None = None, **_: Any) -> None:
        planned.append(f"{scene.name} {params.planner if params else ''}".strip())

    monkeypatch.setattr(bench, "plan_mission", note)
    options = argparse.Namespace(
        profile=["default", "paper"], seeds=range(1), bound=False
    )
    bench.warm.cache_clear()
    for name in ("scene1", "scene2"):
        bench.warmed(load_scene(name), options)
    warm = ["quickstart path_following", "quickstart guided_tree"]
    assert planned == [*warm, "scene1", "scene2"]
    bench.warm.cache_clear()


def test_plans_that_the_verifier_refused_have_no_share_in_figures() -> None:
    def row(cost_m: float, violations: int) -> dict[str, Any]:
        times = {"routing": 0.1, "total": 1.0, "first_solution": 0.5}
        return {
            "profile": "default", "ok": not violations, "violations": violations,
            "plan_s": 1.0, "cost_m": cost_m, "statistics": {"time_s": times},
        }  # fmt: skip

    rows = [row(100.0, 0), row(10.0, 1), row(104.0, 0)]
    options = argparse.Namespace(
        profile=["default"], budget=None, bound=False, execute=False
    )
    (line,) = print_scene("any", rows, options)
    assert (line["ok"], line["runs"], line["cost_m_median"]) == (2, 3, 102.0)


def test_what_went_wrong_is_said_in_words(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", ["bench", "--scenes", "nowhere", "--seeds", "0"])
    with pytest.raises(SystemExit) as ended:
        protocol.run(bench.main)
    assert ended.value.code == 3
    assert "nowhere" in capsys.readouterr().err


def test_an_interruption_says_how_to_go_on(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(bench, "missions", interrupted)
    monkeypatch.setattr(sys, "argv", ["bench", "--scenes", "quickstart"])
    with pytest.raises(SystemExit) as ended:
        protocol.run(bench.main)
    assert ended.value.code == 130
    assert "--output" in capsys.readouterr().err


def test_a_file_that_cannot_be_written_is_refused_at_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", ["bench", "--json", str(tmp_path)])
    with pytest.raises(SystemExit) as ended:
        bench.main()
    assert ended.value.code == 2
    assert f"{tmp_path} is a folder: name a file" in capsys.readouterr().err
