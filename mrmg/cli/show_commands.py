"""The verbs that show runs: compare, figure, view."""

from __future__ import annotations

import argparse

from mrmg.cli import terminal
from mrmg.errors import ExitCode


def compare(options: argparse.Namespace) -> int:
    """Set runs side by side: a table, and a page with their courses."""
    from mrmg.results.compare import compare_runs
    from mrmg.results.compare_page import write_comparison

    comparison = compare_runs(options.runs)
    write_comparison(comparison, options.out)
    if options.json:
        terminal.print_json(comparison.to_json())
    else:
        print(f"{comparison.to_text()}\n\n{options.out}")
    return ExitCode.OK


def figure(options: argparse.Namespace) -> int:
    """Draw one figure of a run for a paper."""
    from pathlib import Path

    from mrmg.results.figure import draw_figure

    out = options.out or Path(f"{options.kind}.pdf")
    draw_figure(options.run, options.kind, out)
    print(out)
    return ExitCode.OK
