"""The verb `campaign`: trials of every combination of a file's factors."""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mrmg.cli import terminal
from mrmg.cli.run_options import add_trust, reader
from mrmg.errors import ExitCode
from mrmg.runs import argument_values as values

if TYPE_CHECKING:
    from mrmg.studies.trials import OnTrial

_LINE_EVERY_S = 10.0
"""How often progress is printed where there is no terminal."""


def add_campaign(verbs: Any) -> None:
    """Add the verb `campaign`."""
    verb = verbs.add_parser(
        "campaign",
        help="trials of all combinations of scenes, seeds, planners, plants ...",
        description="Plan and drive every combination of the factors of a file, and "
        "put the results together in tables and a page. Trials that are done are "
        "kept: the same command goes on where it was stopped.",
    )
    verb.add_argument("file", type=Path, metavar="FILE.yaml", help="campaign file")
    verb.add_argument(
        "--engine",
        choices=("local", "dask"),
        default="local",
        help="who makes trials: processes of this machine, or a Dask cluster; default "
        "local",
    )
    verb.add_argument(
        "--scheduler",
        metavar="ADDRESS",
        help="of the cluster, such as tcp://host:8786; default a cluster of this "
        "machine's processes",
    )
    verb.add_argument(
        "--workers",
        type=reader(values.count),
        metavar="N",
        help="trials under way at once; default 1, or what the cluster has room for; "
        "no influence on the result",
    )
    verb.add_argument(
        "--out", type=Path, metavar="DIR", help="folder; default campaigns/FILE"
    )
    verb.add_argument(
        "--runs", action="store_true", help="leave a run folder of each trial, too"
    )
    verb.add_argument(
        "--parquet", action="store_true", help="write trials.parquet, too"
    )
    add_trust(verb)
    verb.add_argument("--json", action="store_true", help="print summary.json alone")
    verb.set_defaults(command=campaign)


def campaign(options: argparse.Namespace) -> int:
    """Make the trials of a campaign."""
    from mrmg.studies.campaigns import read_campaign, run_campaign
    from mrmg.studies.engine import Engine

    engine = Engine(
        kind=options.engine, workers=options.workers, scheduler=options.scheduler
    )
    found = read_campaign(
        options.file, trust_code=options.trust_code, with_runs=options.runs
    )
    folder = options.out or Path("campaigns") / found.name
    counts = [0, len(found.trials)]
    try:
        with terminal.progress_of("trials") as on_progress:
            figures = run_campaign(
                found,
                folder,
                engine=engine,
                parquet=options.parquet,
                on_trial=_reporter(on_progress, counts),
            )
    except KeyboardInterrupt:
        print(
            f"mrmg: {counts[0]} of {counts[1]} trials are kept in {folder}",
            file=sys.stderr,
        )
        raise
    if options.json:
        terminal.print_json(figures)
        return ExitCode.OK
    print(_outcome(figures))
    print(f"  table      {folder / 'trials.csv'}")
    print(f"  page       {folder / 'summary.html'}")
    return ExitCode.OK


def _reporter(
    report: Callable[[float, str], None] | None, counts: list[int]
) -> OnTrial:
    """Return a callback that shows progress, and notes how many trials are done."""
    last = time.monotonic()
    first = 0

    def on_trial(done: int, trials: int, feasible: int) -> None:
        nonlocal last, first
        now = time.monotonic()
        counts[:] = done, trials
        text = f"{done} of {trials} trials, {feasible} feasible"
        if report is not None:
            report(done / trials, text)
        elif now - last > _LINE_EVERY_S or done == trials:
            last = now
            print(f"mrmg: {text}", file=sys.stderr)

    return on_trial


def _outcome(figures: dict[str, Any]) -> str:
    return (
        f"{figures['campaign']}: {figures['feasible']} of {figures['trials']} feasible"
    )
