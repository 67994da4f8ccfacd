"""One specification gives the flags, the keywords, the record and the fingerprints."""

from __future__ import annotations

import inspect
import json
import shlex
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import mrmg
from mrmg.cli.parser import make_parser
from mrmg.cli.run_options import given
from mrmg.errors import ExitCode, UsageError
from mrmg.report.report import command
from mrmg.runs.arguments import RunArguments, VideoArguments, keyword
from mrmg.runs.folder import RunFolder, Step
from mrmg.runs.options import options_of
from mrmg.runs.record import read_record
from mrmg.runs.steps import Run
from mrmg.scene.loading import load_scene
from mrmg.scene.objective import Objective

OTHER: dict[str, Any] = {
    "seed": 7,
    "objective": {"energy": 1.0, "makespan": 50.0},
    "time_limit_s": 300.0,
    "budget_s": 2.5,
    "trees": 3,
    "soc_margin": 0.25,
    "margins": {"obstacle": 0.1, "robot": 0.3},
    "skip_unreachable": True,
    "workers": 2,
    "profile": "paper",
    "planner": "guided_tree",
    "router": "nrpa",
    "controller": "tvlqr",
    "disturb": "rolling=+30%",
    "disturb_seed": 4,
    "faults": ("r1@3s", "r2@5s"),
    "replan": True,
}
"""A value other than the default for every argument."""

OPTIONS = {option.name: option for option in options_of(RunArguments)}


def test_every_argument_is_tried_here() -> None:
    known = {name for name in OTHER if name in OPTIONS}
    assert known == set(OTHER)
    changed = {name for name in OTHER if getattr(RunArguments(), name) != OTHER[name]}
    assert changed == set(OTHER)


@pytest.mark.parametrize("name", OTHER)
def test_the_command_line_of_an_argument_gives_it_back(name: str) -> None:
    option, value = OPTIONS[name], OTHER[name]
    arguments = RunArguments(**{name: value})
    parsed = make_parser().parse_args(["run", "yard", *option.words(value)])
    assert RunArguments(**given(parsed)) == arguments
    assert (arguments.words() == []) == (name == "workers")
    assert RunArguments.from_json(json.loads(json.dumps(arguments.to_json()))) == (
        arguments
    )


@pytest.mark.parametrize("name", OTHER)
def test_an_argument_decides_what_it_says(name: str, tmp_path: Path) -> None:
    scene = load_scene("quickstart")
    steps = {"plan": set(Step), "drive": {*Step} - {Step.PLAN, Step.VERIFY}, "": set()}
    run = Run(scene=scene, arguments=RunArguments(), folder=RunFolder(tmp_path))
    other = replace(run, arguments=RunArguments(**{name: OTHER[name]}))
    changed = {
        step for step in Step if run.fingerprint(step) != other.fingerprint(step)
    }
    assert changed == steps[OPTIONS[name].decides]


def test_the_keywords_of_run_are_its_options() -> None:
    parameters = inspect.signature(mrmg.run).parameters
    for name, option in OPTIONS.items():
        assert parameters[name].default == option.default
        assert f"{name}: {option.help}" in (mrmg.run.__doc__ or "")


@pytest.mark.parametrize(
    ("wrong", "named"),
    [
        ({"seed": -1}, "seed: -1 is not a whole number of at least 0"),
        ({"seed": 1.5}, "seed: 1.5"),
        ({"trees": True}, "trees: True"),
        ({"budget_s": 0}, "budget_s: 0 is not a positive number"),
        ({"time_limit": "soon"}, "time_limit_s: 'soon'"),
        ({"soc_margin": 1.0}, "soc_margin: 1.0 is not a number of"),
        ({"profile": "fast"}, "profile: 'fast'; allowed: default, paper"),
        ({"objective": {"time": 1.0}}, "objective: .*1:50"),
        ({"faults": "r1@3s"}, "faults: 'r1@3s' is not a sequence"),
        ({"faults": None}, "faults: None is not a sequence of texts"),
        ({"faults": 5}, "faults: 5 is not a sequence of texts"),
        ({"fault": ["r9@3s"]}, "robot 'r9' .*allowed: r1, r2"),
        ({"budget_s": 3.0, "trees": 2}, "trees is not allowed with budget_s"),
        ({"controller": "mpcc"}, "allowed: mpc"),
        ({"disturb": "weight=+5%"}, "allowed: mass, friction"),
    ],
)
def test_wrong_keywords_are_refused_before_anything_is_written(
    wrong: dict[str, Any], named: str, tmp_path: Path
) -> None:
    with pytest.raises(UsageError, match=named):
        mrmg.run("quickstart", out=tmp_path / "run", video=None, **wrong)
    assert not (tmp_path / "run").exists()


def test_how_the_video_is_made_is_no_text(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="expected VideoArguments, got 'chase'"):
        mrmg.run("quickstart", out=tmp_path / "run", video="chase")  # type: ignore[arg-type]
    assert not (tmp_path / "run").exists()


def test_an_unknown_keyword_is_answered_with_the_known_ones() -> None:
    with pytest.raises(TypeError, match=r"no argument 'seeds'; allowed: seed, prof"):
        mrmg.run("quickstart", seeds=3)


@pytest.mark.parametrize(
    "objective",
    [
        "1:50",
        {"energy": 1, "makespan": 50},
        Objective(energy_weight=1.0, makespan_weight=50.0),
    ],
)
def test_an_objective_may_be_given_in_every_form(objective: Any) -> None:
    assert RunArguments(objective=objective).objective == OTHER["objective"]


def test_run_takes_objective_time_limit_and_controller_and_reports_them(
    tmp_path: Path,
) -> None:
    out = tmp_path / "run"
    result = mrmg.run(
        "quickstart",
        out=out,
        video=None,
        objective="makespan",
        time_limit=250,
        soc_margin=0.05,
        controller="tvlqr",
    )
    assert result.exit_code == ExitCode.OK
    assert result.summary["plan"]["objective"]["name"] == "makespan"
    assert result.summary["plan"]["time_limit_s"] == 250.0
    assert json.loads((out / "log.json").read_text())["controller"] == "tvlqr"
    recorded = json.loads((out / "run.json").read_text())["arguments"]
    assert (recorded["objective"], recorded["time_limit_s"]) == ("makespan", 250.0)
    line = command(read_record(out))
    assert line == (
        "mrmg run quickstart --seed 0 --objective makespan --time-limit 250 "
        "--soc-margin 0.05 --controller tvlqr"
    )
    assert line in (out / "report.html").read_text()
    # The line of the report continues the same run: nothing is planned or driven again.
    before = {name: (out / name).stat().st_mtime_ns for name in ("plan.npz", "log.npz")}
    parsed = make_parser().parse_args(
        [*shlex.split(line)[1:], "--no-video", "--out", str(out)]
    )
    assert parsed.command(parsed) == ExitCode.OK
    assert before == {name: (out / name).stat().st_mtime_ns for name in before}


def test_the_video_is_checked_alike() -> None:
    with pytest.raises(UsageError, match="view: 'side'; allowed: top, chase, split"):
        VideoArguments(view="side")
    assert VideoArguments(size=[640, 480]).size == (640, 480)  # type: ignore[arg-type]


def test_retired_names_are_read_everywhere_and_shown_nowhere() -> None:
    """The state-of-charge margin was called state-of-charge margin in 0.1.0."""
    wanted = RunArguments(soc_margin=0.3)
    parsed = make_parser().parse_args(["run", "yard", "--spare", "0.3"])
    assert RunArguments(**given(parsed)) == wanted
    assert RunArguments.from_json({"spare": 0.3}) == wanted
    assert keyword("spare") == "soc_margin"
    assert "--spare" not in make_parser().format_help()
    assert wanted.words() == ["--soc-margin", "0.3"]
