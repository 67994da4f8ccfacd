"""Hostile files: bombs, absurd sizes, markup, climbing paths, code unasked for."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

from protocol import Row

from faults.bombs import bombs
from faults.climbing import climbing
from faults.markup import markup
from faults.named import run_cases
from faults.rows import Options, row_of
from faults.runs import make_runs
from faults.untrusted_code import untrusted_code

REQUIRED = {
    "bombs and sizes": "one message, 5 s of the processor, a gigabyte",
    "markup": "in no page does a name become an element",
    "climbing paths": "one message; nothing outside is read into results or written",
    "code": "nothing runs without --trust-code",
}


def rows(options: Options) -> Iterator[Row]:
    """Yield a row for each kind of hostile file."""
    runs = options.work / "hostile"
    make_runs(runs)
    groups = {
        "bombs and sizes": bombs(runs),
        "markup": markup(runs),
        "climbing paths": climbing(),
        "code": untrusted_code(runs),
    }
    for group, cases in groups.items():
        found = options.trials.row(
            partial(run_cases, cases, options.work / "cases" / group.split()[0]),
            part="hostile",
            group=group,
        )
        yield row_of(
            f"hostile: {group}", REQUIRED[group], found["cases"], found["failures"]
        )
