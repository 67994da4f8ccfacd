"""What campaigns cost beyond their trials, and whether a cluster loses any.

Throughput: a campaign of --trials missions of quickstart, seeds 0, 1, ..., with so many
processes as --workers names in turn. Overhead is the time of all processes, from the
reading of the campaign file to the summary page, that no trial accounts for, divided by
the trials; it includes the start of the processes. Its limit holds for one worker. The
tables of all numbers of workers must be equal byte for byte.

With --cluster, a Dask scheduler and two workers are started as processes that speak
TCP, each worker with a home, a cache and a working folder of its own. A worker is
killed while it makes a trial, and started again; the scheduler is killed; the campaign
is started again with a new scheduler and new workers in the same homes. Its table must
be that of a serial run, no trial may be made twice, and each worker may compile the
planner once. With --cold their caches are empty at first, else they are copies of this
one's.

Rows of --json: `workers`, `trials`, `made` in this call, `feasible`, `wall_s`,
`trials_per_s`, `trial_s_median`, `overhead_ms` a trial. `figures` has the last table:
`what`, `found`, `asked`, `holds`, `value`, `limit`.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from campaign_cluster import cluster_figures
from physics.figures import Figure, print_figures
from protocol import Row, add_file_options, run, state, versions, write_document

from mrmg import storage
from mrmg.studies.campaigns.campaign import run_campaign
from mrmg.studies.campaigns.reading import read_campaign
from mrmg.studies.engine import Engine

LIMIT_MS = 50.0
"""Largest overhead of a trial."""

HEAD = "workers | trials | feasible | wall s | trials/s | trial s | overhead ms"


def main() -> int:
    """Run the bench; return 1 if a figure fails."""
    options = parse_options()
    print(f"{__doc__}\n{versions()}; state {state()}", flush=True)
    folder = options.runs / state()
    rows = [throughput(options, workers, folder) for workers in options.workers]
    print(f"\n{HEAD}")
    for row in rows:
        print(
            f"{row['workers']} | {row['trials']} | {row['feasible']} | "
            f"{row['wall_s']:.1f} | {row['trials_per_s']:.2f} | "
            f"{row['trial_s_median']:.2f} | {row['overhead_ms']:.1f}"
        )
    figures = figures_of(rows, folder)
    if options.cluster:
        figures += cluster_figures(folder / "cluster", cold=options.cold)
    print_figures(figures)
    ok = all(figure.holds for figure in figures)
    tables = {"figures": list(map(asdict, figures))}
    write_document(options, "bench_campaign", rows, ok, **tables)
    return 0 if ok else 1


def parse_options() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__,
        prog="tools/bench_campaign",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--trials", type=int, default=1000, help="default 1000")
    parser.add_argument(
        "--workers", type=int, nargs="*", default=[1, 2], help="default 1 2"
    )
    parser.add_argument("--cluster", action="store_true", help="try a cluster, too")
    parser.add_argument(
        "--cold", action="store_true", help="its workers have nothing compiled"
    )
    parser.add_argument(
        "--runs",
        type=Path,
        default=Path("runs/bench_campaign"),
        help="folder of the campaigns, default runs/bench_campaign; trials in it are "
        "not made again, and do not count in times",
    )
    add_file_options(parser)
    return parser.parse_args()


def throughput(options: argparse.Namespace, workers: int, folder: Path) -> Row:
    """Make what is missing of a campaign, and return what that took."""
    file = folder / f"quickstart-{options.trials}.yaml"
    storage.write_text(file, f"scenes: quickstart\nseeds: 0-{options.trials - 1}\n")
    made: list[float] = []

    def note(done: int, trials: int, feasible: int, left_s: float | None) -> None:
        if left_s is not None:
            made.append(left_s)

    out = folder / f"{file.stem}-workers{workers}"
    began = time.perf_counter()
    engine = Engine(workers=workers)
    found = run_campaign(read_campaign(file), out, engine=engine, on_trial=note)
    wall_s = time.perf_counter() - began
    newest = sorted(
        (out / "trials").iterdir(), key=lambda path: path.stat().st_mtime_ns
    )[-len(made) :]
    times_s = [storage.read_json(path)["time_s"]["total"] for path in newest if made]
    spent_s = wall_s * workers - sum(times_s)
    return {
        "workers": workers,
        "trials": found["trials"],
        "made": len(made),
        "feasible": found["feasible"],
        "wall_s": wall_s,
        "trials_per_s": len(made) / wall_s,
        "trial_s_median": statistics.median(times_s) if times_s else float("nan"),
        "overhead_ms": 1000.0 * spent_s / len(made) if made else float("nan"),
    }


def figures_of(rows: Sequence[Row], folder: Path) -> list[Figure]:
    """Return what is asked of the overhead, and of the tables."""
    figures = [
        Figure.at_most("overhead of a trial", row["overhead_ms"], LIMIT_MS, " ms")
        for row in rows
        if row["workers"] == 1 and row["made"]
    ]
    tables = {
        (
            folder
            / f"quickstart-{row['trials']}-workers{row['workers']}"
            / "trials.csv"
        ).read_bytes()
        for row in rows
    }
    if len(rows) > 1:
        same = len(tables) == 1
        output = "equal" if same else "different"
        what = "tables of all numbers of workers"
        figures.append(Figure(what, output, "equal", same))
    return figures


if __name__ == "__main__":
    run(main)
