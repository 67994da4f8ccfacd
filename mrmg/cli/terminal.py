"""What a person at a terminal sees: progress on stderr, results on stdout."""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from typing import TYPE_CHECKING, Any

from mrmg import storage
from mrmg.counted import counted
from mrmg.energy.text import energy_text
from mrmg.errors import Fault

if TYPE_CHECKING:
    from mrmg.planning import Improvement
    from mrmg.runs.arguments import RunArguments
    from mrmg.runs.steps import StepProgress

_DOING = {
    "plan": "planning",
    "verify": "verifying",
    "execute": "driving",
    "audit": "auditing",
    "draw": "drawing",
    "render": "filming",
    "report": "reporting",
}


@contextmanager
def progress() -> Iterator[Callable[[str, float | None, str], None] | None]:
    """Yield a callback that draws one bar per step; None away from a terminal.

    It takes the step, the share that is done, None where that is not known from the
    start, and a text. Steps that are none of a run are called on the bar what they are
    called.
    """
    if not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (
        TextColumn("{task.description:>10}"),
        BarColumn(),
        TimeElapsedColumn(),
        TextColumn("{task.fields[note]}", markup=False),
    )
    tasks: dict[str, Any] = {}
    with Progress(*columns, console=Console(stderr=True), transient=True) as bars:

        def report(step: str, fraction: float | None, text: str) -> None:
            if step not in tasks:
                whole = None if fraction is None else 1.0
                doing = _DOING.get(step, step)
                tasks[step] = bars.add_task(doing, total=whole, note="")
            bars.update(tasks[step], completed=fraction, note=text)

        yield report


@contextmanager
def progress_of(doing: str) -> Iterator[Callable[[float | None, str], None] | None]:
    """Yield a callback (share, text) that draws a bar; None away from a terminal.

    Args:
        doing: what the bar calls the work.
    """
    with progress() as report:
        yield report and partial(report, doing)


def improvement_reporter(
    report: StepProgress | None,
) -> Callable[[Improvement], None] | None:
    """Return a callback that prints a line per better plan; None without progress."""
    if report is None:
        return None
    return lambda found: print(
        f"{found.time_s:9.2f} s  {quality(found.to_json())}", file=sys.stderr
    )


def quality(found: Mapping[str, Any]) -> str:
    """Return what plans are compared by, its bound and the gap in words."""
    objective = found["objective"]

    def shown(value: float) -> str:
        if objective["unit"] == "J":
            return energy_text(value)
        return f"{value:.1f} s" if objective["unit"] == "s" else f"{value:.1f}"

    name = "cost" if objective["name"] == "energy" else objective["name"]
    text = f"{name} {shown(objective['value'])}"
    if objective["name"] != "energy":
        text += f" ({energy_text(found['cost_J'])}, {found['makespan_s']:.1f} s)"
    if objective["bound"] is not None:
        text += f", proven bound {shown(objective['bound'])}"
    if found["gap"] is not None:
        text += f", gap {found['gap']:.1%}"
    return text


def iterations(found: Mapping[str, Any]) -> str:
    """Return the iterations of the guided tree and their hard cap in words."""
    cap = counted(found["iteration_cap"], "iteration")
    return f"{found['iterations']} of at most {cap}"


def compile_kernels(arguments: RunArguments) -> None:
    """Compile kernels where that is to be done, and inform a person who waits for it.

    Args:
        arguments: of the planning to come.
    """
    from mrmg.compilation import compiled_kernels, kernels_are_compiled
    from mrmg.planning.parameters import kernels_of, profile_params

    chosen = profile_params(arguments.profile, planner=arguments.planner)
    if kernels_are_compiled(kernels_of(chosen.planner)):
        return
    with progress_of("compiling") as report:
        if report is None:
            return  # planning does it
        from mrmg.planning.preparation import compile_kernels

        report(None, "")
        began = time.perf_counter()
        once = "once for this version"
        compile_kernels(
            chosen.planner,
            lambda n: report(None, f"{counted(n, 'kernel')}, {once}"),
        )
        took_s = time.perf_counter() - began
    text = f"compiled {counted(compiled_kernels(), 'kernel')} in {took_s:.0f} s"
    print(f"{text}, {once}", file=sys.stderr)


def print_warnings(warnings: Sequence[Fault], *, more: str = "") -> None:
    """Print warnings on stderr: all, or the first one and where to find the others.

    Args:
        warnings: what to print.
        more: the command that prints them all.
    """
    shown = warnings[:1] if more else warnings
    left = len(warnings) - len(shown)
    for warning in shown:
        others = f" (and {left} more: {more})" if left else ""
        print(f"mrmg: warning: {warning}{others}", file=sys.stderr)


def print_json(value: Any) -> None:
    """Print `value` on stdout in the form of the run folder's files."""
    sys.stdout.write(storage.canonical_json(value))


def print_result(options: argparse.Namespace, value: Any, lines: Iterable[str]) -> None:
    """Print what a verb found: as JSON alone if that was asked for, else in lines."""
    if options.json:
        print_json(value)
    else:
        print("\n".join(lines))


def table_lines(rows: Sequence[Sequence[str]]) -> Iterator[str]:
    """Yield rows in columns, the first row being their names."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for row in rows:
        cells = [text.ljust(width) for text, width in zip(row, widths, strict=True)]
        yield "  ".join(cells).rstrip()


def about(duration_s: float) -> str:
    """Return a duration that is not known exactly, in words."""
    units = (("h", 3600.0), ("min", 60.0), ("s", 1.0))
    name, unit_s = next(
        (each for each in units if duration_s >= 2.0 * each[1]), units[2]
    )
    return f"about {duration_s / unit_s:.0f} {name}"


def because(outcome: str, reasons: Sequence[str]) -> list[str]:
    """Return lines of an outcome: its first reason in the first one, others below."""
    first = ": ".join([outcome, *reasons[:1]])
    return [first, *(f"  {reason}" for reason in reasons[1:])]


def summary_lines(summary: dict[str, Any], reason: str) -> Iterator[str]:
    """Yield the outcome of a run in a few lines."""
    status = summary["status"]
    failed = "failed" if status == "solved" else f"not done ({status})"
    outcome = "done" if summary["mission_ok"] else failed
    why = f"; {reason}" if reason else ""
    yield f"{summary['scene']}, seed {summary['seed']}: mission {outcome}{why}"
    yield from (f"  {line}" for line in _figure_lines(summary))


def _figure_lines(summary: dict[str, Any]) -> Iterator[str]:
    plan, verdict = summary["plan"], summary["verdict"]
    execution, energy = summary["execution"], summary["energy"]
    if plan:
        yield (
            f"plan       {energy_text(plan['cost_J'], 1)} in "
            f"{plan['makespan_s']:.0f} s, planned in {plan['time_s']['total']:.2f} s"
        )
        yield f"quality    {quality(plan)}"
        for sentence in plan.get("margins_kept", ()):
            yield f"margins    {sentence}"
        if plan.get("iteration_cap"):
            yield f"search     {iterations(plan)}"
    for hint in summary.get("hints", ()):
        yield f"hint       {hint}"
    if verdict:
        yield (
            f"verdict    {counted(verdict['violations'], 'violation')}; "
            f"clearance to obstacles {_metres(verdict['min_obstacle_clearance_m'])}, "
            f"between robots {_metres(verdict['min_robot_distance_m'])}"
        )
    if execution:
        tracking = execution["tracking"]
        yield (
            f"driven     {execution['goals_visited']} of "
            f"{counted(summary['goals'], 'goal')}, "
            f"{counted(execution['contacts'], 'contact')}, tracking "
            f"{tracking['rms_m']:.3f} m rms, {tracking['max_m']:.3f} m max, "
            f"{execution['realtime_factor']:.0f} x real time"
        )
        for event in execution["events"]:
            yield f"{event['time_s']:>7.1f} s  {event['message']}"
    if energy:
        yield (
            f"energy     metered {energy['metered_error_pct']:+.2f} %, measured "
            f"{energy['measured_error_pct']:+.2f} % against the plan; lowest charge "
            f"{100.0 * energy['min_charge_fraction']:.1f} %, "
            f"{counted(energy['recharges'], 'recharge')}"
        )
        residual_pct = energy["balance_residual_pct"]
        if residual_pct is not None:
            yield (
                f"balance    motion, friction and contacts account for all but "
                f"{abs(residual_pct):.2f} % of the drives' work"
            )


def _metres(value: float | None) -> str:
    return "-" if value is None else f"{value:.2f} m"
