"""Driving under disturbances: the arguments for it, and the verb `robustness`."""

from __future__ import annotations

import argparse
import shlex
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mrmg.cli import terminal
from mrmg.cli.run_options import add_options, given, help_of
from mrmg.counted import counted
from mrmg.runs import argument_values as values
from mrmg.runs.folder import Step, existing

if TYPE_CHECKING:
    from mrmg.studies.outcomes import Study
    from mrmg.studies.trials import OnTrial

_COLUMNS = ("worst", "p05", "median", "p95")


def add_robustness(verbs: Any) -> None:
    """Add the verb `robustness`."""
    verb = verbs.add_parser(
        "robustness",
        help="how probable it is that a plan is feasible under disturbances",
        description="Drive the plan of a run folder many times, each time under other "
        "disturbances. Trials that are done are kept: the same command goes on where "
        "it was stopped.",
        command=robustness,
    )
    verb.add_run()
    verb.add_value("--trials", "N", "default 100", values.count, 100)
    processes = "processes that drive; default 1, and no influence on the result"
    verb.add_value("--workers", "N", processes, values.count, 1)
    verb.add_value("--disturb", "SPEC", help_of("disturb"), str, "")
    seed = "--disturb-seed of the first trial, the next have N+1, ...; default 0"
    verb.add_value("--seed", "N", seed, values.seed, 0)
    add_options(verb, "robustness")
    verb.add_trust()
    verb.add_json("the study of robustness.json alone")


def robustness(options: argparse.Namespace) -> None:
    """Drive a plan under many disturbances."""
    from mrmg.runs.steps import taken_up
    from mrmg.studies.robustness.study import study_robustness

    given_drive = {
        name: value
        for name, value in given(options).items()
        if name in ("controller", "plant", "replan")
    }
    with existing(options.run).opened_for_writing() as folder:
        run = taken_up(folder, trust_code=options.trust_code)
        drive = {"replan": False, "faults": (), **given_drive}
        driven = replace(run, arguments=replace(run.arguments, **drive))
        with terminal.progress_of("driving") as on_progress:
            study = study_robustness(
                driven,
                trials=options.trials,
                seed=options.seed,
                disturb=options.disturb,
                workers=options.workers,
                on_trial=_trial_reporter(on_progress),
            )
        if folder.file("report.html").exists():
            run.make(Step.REPORT)
    terminal.print_result(options, study.to_json(), _lines(study, options.run))


def _trial_reporter(report: Callable[[float, str], None] | None) -> OnTrial | None:
    if report is None:
        return None
    return lambda done, trials, feasible: report(
        done / trials, f"{done} of {counted(trials, 'trial')}, {feasible} feasible"
    )


def _lines(study: Study, run: Path) -> Iterator[str]:
    figures = study.to_json()
    low, high = figures["interval"]
    yield (
        f"{figures['feasible']} of {counted(figures['trials'], 'trial')} feasible: "
        f"probability {figures['probability']:.1%}, {figures['confidence']:.0%} "
        f"interval {low:.1%} to {high:.1%}"
    )
    for cause, count in sorted(figures["failures"].items()):
        yield f"  failed     {count} x {cause}"
    yield "  margins      worst      5 %   median     95 %"
    for name, label, factor in (
        ("charge_fraction", "charge %", 100.0),
        ("obstacle_clearance_m", "obstacle m", 1.0),
        ("robot_distance_m", "robots m", 1.0),
        ("tracking_max_m", "tracking m", 1.0),
    ):
        if name in figures["margins"]:
            margin = figures["margins"][name]
            numbers = (margin[key] * factor for key in _COLUMNS)
            yield f"  {label:<10}" + "".join(f"{number:9.3g}" for number in numbers)
    words = ["mrmg", "execute", str(run), *study.replay_options(study.worst)]
    yield f"  worst case {shlex.join(words)}"
