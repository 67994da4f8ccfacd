"""The verb `campaign`: trials of every combination of a file's factors."""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

from mrmg.cli import terminal
from mrmg.counted import counted
from mrmg.runs import argument_values as values

_LINE_EVERY_S = 10.0
"""How often progress is printed where there is no terminal [s]."""

_MOST_LEVELS = 12
"""Values of a factor that are listed; the page and the table have all."""


def add_campaign(verbs: Any) -> None:
    """Add the verb `campaign`."""
    verb = verbs.add_parser(
        "campaign",
        help="trials of all combinations of scenes, seeds, planners, plants ...",
        description="Plan and drive every combination of the factors of a file, and "
        "put the results together in tables and a page. Trials that are done are "
        "kept: the same command goes on where it was stopped.",
        command=campaign,
    )
    verb.add_argument("file", type=Path, metavar="FILE.yaml", help="campaign file")
    verb.add_argument(
        "--engine",
        choices=("local", "dask"),
        default="local",
        help="who makes trials: processes of this machine, or a Dask cluster; default "
        "local",
    )
    verb.add_value(
        "--scheduler",
        "ADDRESS",
        "of the cluster, such as tcp://host:8786; default a cluster of this "
        "machine's processes",
    )
    verb.add_value(
        "--workers",
        "N",
        "trials under way at once; default 1, or what the cluster has room for; "
        "no influence on the result",
        values.count,
    )
    verb.add_out("DIR", "folder; default campaigns/FILE", short=False)
    verb.add_flag("--runs", "leave a run folder of each trial, too")
    verb.add_flag("--parquet", "write trials.parquet, too")
    verb.add_trust()
    verb.add_json("summary.json alone")


def campaign(options: argparse.Namespace) -> None:
    """Make the trials of a campaign."""
    from mrmg.studies.campaigns.campaign import run_campaign
    from mrmg.studies.campaigns.reading import read_campaign
    from mrmg.studies.engine import Engine

    engine = Engine(
        kind=options.engine, workers=options.workers, scheduler=options.scheduler
    )
    found = read_campaign(
        options.file, trust_code=options.trust_code, with_runs=options.runs
    )
    folder = options.out or Path("campaigns") / found.name
    reached = f"0 of {counted(len(found.trials), 'trial')}"
    printed_s = time.monotonic()

    def report(
        bar: Callable[[float, str], None] | None,
        done: int,
        trials: int,
        feasible: int,
        left_s: float | None,
    ) -> None:
        """Show that one more trial is done; on a line now and then, off a terminal."""
        nonlocal reached, printed_s
        reached = f"{done} of {counted(trials, 'trial')}"
        text = f"{reached}, {feasible} feasible"
        text += f", {terminal.about(left_s)} left" if left_s else ""
        now_s = time.monotonic()
        if bar is not None:
            bar(done / trials, text)
        elif left_s is not None and now_s - printed_s > _LINE_EVERY_S:
            printed_s = now_s
            print(f"mrmg: {text}", file=sys.stderr)

    if options.engine == "local":
        arguments = {
            (each.profile, each.planner): each
            for each in (trial.order.arguments for trial in found.trials)
        }
        for each in arguments.values():
            terminal.compile_kernels(each)
    try:
        with terminal.progress_of("trials") as on_progress:
            figures = run_campaign(
                found,
                folder,
                engine=engine,
                parquet=options.parquet,
                on_trial=partial(report, on_progress),
            )
    except KeyboardInterrupt:
        print(f"mrmg: done and kept in {folder}: {reached}", file=sys.stderr)
        raise
    lines = [*_lines(figures), *_places(folder, options.parquet)]
    terminal.print_result(options, figures, lines)


def _lines(figures: dict[str, Any]) -> Iterator[str]:
    yield f"{figures['campaign']}: {_share(figures)}"
    if figures["refused"] or figures["errors"]:
        yield "  reasons    of trials that are refused or broke down are in the table"
    for cause, count in figures["failures"].items():
        yield f"  failed     {count} x {cause}"
    for factor, levels in figures["by"].items():
        if 1 < len(levels) <= _MOST_LEVELS:
            yield from (
                f"  {factor:<10} {level['value']}: {_share(level)}" for level in levels
            )


def _share(figures: dict[str, Any]) -> str:
    trials = figures["trials"] - figures["refused"] - figures["errors"]
    text = f"{figures['feasible']} of {counted(trials, 'trial')} feasible"
    if trials:
        low, high = figures["interval"]
        text += f" ({figures['share']:.1%}, 95 % interval {low:.1%} to {high:.1%})"
    if figures["refused"]:
        text += f"; {figures['refused']} more refused"
    if figures["errors"]:
        text += f"; {figures['errors']} more broke down; the same command tries again"
    return text


def _places(folder: Path, parquet: bool) -> list[str]:
    names = [("table", "trials.csv"), ("page", "summary.html")]
    names[1:1] = [("", "trials.parquet")] if parquet else []
    return [f"  {what:<10} {folder / name}" for what, name in names]
