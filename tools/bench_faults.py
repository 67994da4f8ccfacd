"""Break what is read, run and stored, by the thousand, and see what is left.

Rows, each PASS or FAIL; the exit code is 1 if any fails:

- files: damaged files of all formats that are read, in one process through the door
  of the command line, one of a hundred as a process of its own, too: no traceback, at
  most 5 s of the processor and a gigabyte, a documented exit code, one message;
- plans: damaged plans, each to be caught by the rule that should;
- kills: run, robustness, campaign and calibrate, ended by SIGKILL, SIGTERM or Ctrl-C at
  random moments, some twice: all files whole, and the next command leaves what it
  leaves when nothing disturbs it. Most are forked from a process that has loaded all.
  Then two at once, a full disk, a read-only folder (both by mounts; skipped where
  those are not permitted), a cache that is cut off or deleted, and a clock set back
  (Python's own, and files of the future);
- hostile: bombs, absurd sizes, markup in all texts of all files of a run, paths that
  climb, and code, which runs with --trust-code alone;
- long: missions in one process, whose memory and file handles are read.

--only selects rows; --files, --plans, --kills and --missions take other numbers.
Everything that is drawn is drawn by --seed. With --output FILE the same command goes on
after an interruption. --keep DIR keeps files that something failed on.

Rows of --json: `row` (`files: scenes`), `required`, `cases`, `failed`, `holds`,
`failures` (`case`, `fault`; up to 50), `took_s`, and figures of some rows: of files
`codes` (commands by exit code), `cpu_s` and `peak_bytes` of the worst command; of plans
the `rules` that must catch them; of the long run `bytes_a_mission`, `memory_bytes`
(every twenty missions, free memory given back; before it `untrimmed_bytes`) and
`handles` (first, last).
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from faults import files, hostile, kills, long_run, plans
from faults.rows import Options
from protocol import Row, Trials, add_file_options, run, state, versions, write_document

ROWS: dict[str, Callable[[Options], Iterator[Row]]] = {
    "files": files.rows,
    "plans": plans.rows,
    "kills": kills.rows,
    "hostile": hostile.rows,
    "long": long_run.rows,
}


def main() -> int:
    """Run the bench; return 1 if a row fails."""
    options = parse_options()
    print(f"{__doc__}\nseed {options.seed}; {versions()}; state {state()}", flush=True)
    found: list[Row] = []
    with tempfile.TemporaryDirectory(prefix="mrmg-faults-", dir=options.work) as work:
        shared = Options(
            seed=options.seed,
            files=options.files,
            plans=options.plans,
            kills=options.kills,
            missions=options.missions,
            work=Path(work),
            keep=options.keep and options.keep.absolute(),
            trials=Trials(options.output, seed=options.seed),
        )
        for name in options.only or ROWS:
            began = time.monotonic()
            for row in ROWS[name](shared):
                took_s = time.monotonic() - began
                began = time.monotonic()
                found.append({**row, "took_s": round(took_s, 1)})
                _print_row(found[-1])
    ok = all(row["holds"] for row in found)
    write_document(options, "bench_faults", found, ok)
    return 0 if ok else 1


def _print_row(row: Row) -> None:
    verdict = "PASS" if row["holds"] else "FAIL"
    text = f"{verdict}  {row['row']:<28} {row['failed']:>4} of {row['cases']:>5} failed"
    print(f"{text}  {row['took_s']:>6.1f} s  {row['required']}", flush=True)
    for failure in row["failures"]:
        print(f"      {failure['case']}: {failure['fault']}", flush=True)


def parse_options() -> argparse.Namespace:
    """Return the options of the command line."""
    parser = argparse.ArgumentParser(
        prog="tools/bench_faults",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "--only", nargs="+", choices=ROWS, metavar="ROW", help=f"of {', '.join(ROWS)}"
    )
    parser.add_argument("--seed", type=int, default=0, metavar="N")
    for name, count in COUNTS.items():
        parser.add_argument(f"--{name}", type=int, default=count, metavar="N")
    parser.add_argument("--keep", type=Path, metavar="DIR")
    parser.add_argument("--work", type=Path, metavar="DIR", help="default: /tmp")
    add_file_options(parser)
    return parser.parse_args()


COUNTS = {"files": 10_000, "plans": 1000, "kills": 200, "missions": 1000}
"""How many of each are tried by default."""

if __name__ == "__main__":
    sys.modules.setdefault("bench_faults", sys.modules["__main__"])
    run(main)
