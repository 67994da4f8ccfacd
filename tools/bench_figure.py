"""Runtimes of the planner for papers: by scene and by number of robots; Table I."""

from __future__ import annotations

import statistics
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from bench_record import BenchRow
from matplotlib.axes import Axes
from matplotlib.patches import Patch
from print_style import PAGE_IN, print_figure
from problem_figure import add_legend

from mrmg.viz import style

MOST_LETTERS = 45
"""Letters of all names under one panel up to which they stand level."""

Key = Callable[[BenchRow], str]
_HEIGHT_IN = 2.5
_LOOKS: dict[str, dict[str, Any]] = {
    "default": {"facecolor": "#56B4E9", "edgecolor": "#003B5C", "hatch": ""},
    "paper": {"facecolor": "#E69F00", "edgecolor": "#5C3A00", "hatch": "////"},
}
_GROUP_WIDTH = 0.7
_WHISKERS_PCT = (5, 95)
HEAD = (
    "scene",
    "robots",
    "goals",
    "stations",
    "terrain",
    "capacity [m]",
    "profile",
    "runs",
    "init [s]",
    "first plan [s]",
    "total [s]",
    "solver [%]",
    "path-following plans",
    "iterations",
    "timeouts",
)
"""Columns of Table I."""


def draw_runtimes(rows: Sequence[BenchRow], path: Path) -> None:
    """Draw the time to the first verified plan, over the width of a page.

    Boxes are quartiles, whiskers the 5th and 95th percentile; runs without a plan are
    counted above.

    Args:
        rows: of the bench, at least one.
        path: file to write (PDF, SVG or PNG by its suffix).
    """
    fleets = _by_fleet(rows)
    # One fleet of each map stands for it: the map's own, or the first there is.
    stands_for = {row.family: row.scene for row in reversed(rows)}
    stands_for |= {row.scene: row.scene for row in rows if row.scene == row.family}
    table = [row for row in rows if row.scene in stands_for.values()]
    panels: list[tuple[list[BenchRow], Key, str]] = [
        (table, lambda row: row.scene, "scene")
    ]
    if len({row.robots for row in fleets}) > 1:
        title = f"robots in {fleets[0].family}"
        panels.append((fleets, lambda row: str(row.robots), title))
    with print_figure((PAGE_IN, _HEIGHT_IN), path) as own:
        shares = [len({key(row) for row in part}) + 1 for part, key, _ in panels]
        all_axes = own.subplots(1, len(panels), sharey=True, width_ratios=shares)
        for axes, (part, key, title) in zip(np.ravel(all_axes), panels, strict=True):
            _draw_boxes(axes, part, key)
            axes.set_xlabel(title)
        np.ravel(all_axes)[0].set_ylabel("time to the first plan [s]")
        profiles = [name for name in _LOOKS if any(row.profile == name for row in rows)]
        handles = [Patch(**_LOOKS[name], label=f"profile {name}") for name in profiles]
        add_legend(own, handles, columns=len(handles))


def table_rows(rows: Sequence[BenchRow]) -> list[tuple[str, ...]]:
    """Return Table I: a line for every scene and profile, medians over the seeds."""
    lines = []
    for scene in _unique(row.scene for row in rows):
        for profile in _unique(row.profile for row in rows):
            own = [row for row in rows if (row.scene, row.profile) == (scene, profile)]
            if own:
                lines.append(_line(own))
    return lines


def _line(rows: Sequence[BenchRow]) -> tuple[str, ...]:
    first, solved = rows[0], [row for row in rows if row.solved]
    return (
        first.scene,
        str(first.robots),
        str(first.goals),
        str(first.stations),
        str(first.terrain_areas),
        f"{first.capacity_m:.0f}",
        first.profile,
        str(len(rows)),
        _median(rows, lambda row: row.init_s),
        _median(solved, lambda row: row.first_s or 0.0),
        _median(rows, lambda row: row.total_s),
        _median(rows, lambda row: 100.0 * row.routing_s / row.total_s, 0),
        _count(rows, lambda row: row.path_following_plans),
        _count(rows, lambda row: row.iterations),
        str(len(rows) - len(solved)),
    )


def _count(rows: Sequence[BenchRow], of: Callable[[BenchRow], int]) -> str:
    """Return the median of the runs that did such a thing at all, and how many did."""
    doing = [row for row in rows if of(row)]
    text = _median(doing, lambda row: float(of(row)), 0)
    return text if len(doing) in (0, len(rows)) else f"{text} in {len(doing)}"


def _median(
    rows: Sequence[BenchRow], of: Callable[[BenchRow], float], digits: int = 3
) -> str:
    if not rows:
        return "–"
    return f"{statistics.median(of(row) for row in rows):.{digits}f}"


def _draw_boxes(axes: Axes, rows: Sequence[BenchRow], key: Key) -> None:
    groups = _unique(key(row) for row in rows)
    profiles = [name for name in _LOOKS if any(row.profile == name for row in rows)]
    width = _GROUP_WIDTH / len(profiles)
    for at, profile in enumerate(profiles):
        shift = (at - 0.5 * (len(profiles) - 1)) * width
        for place, group in enumerate(groups):
            own = [r for r in rows if r.profile == profile and key(r) == group]
            times_s = [row.first_s for row in own if row.first_s is not None]
            _draw_box(axes, times_s, place + shift, 0.85 * width, _LOOKS[profile])
            failed = len(own) - len(times_s)
            if failed:
                axes.annotate(
                    f"{failed}/{len(own)}\nfailed",
                    (place + shift, 1.02),
                    xycoords=("data", "axes fraction"),
                    ha="center",
                    va="bottom",
                    fontsize=5.5,
                    color=style.RESERVE,
                )
    axes.set_yscale("log")
    axes.yaxis.set_major_formatter("{x:g}")
    # Many names side by side would run into each other.
    slope = 30 if sum(map(len, groups)) > MOST_LETTERS else 0
    axes.set_xticks(
        range(len(groups)), groups, rotation=slope, ha="right" if slope else "center"
    )
    axes.set_xlim(-0.6, len(groups) - 0.4)
    axes.grid(axis="y", which="both", color="#E4E6EA", linewidth=0.5)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)


def _draw_box(
    axes: Axes, times_s: Sequence[float], at: float, width: float, look: dict[str, Any]
) -> None:
    if not times_s:
        return
    ink = look["edgecolor"]
    axes.boxplot(
        [list(times_s)],
        positions=[at],
        widths=width,
        whis=_WHISKERS_PCT,
        showfliers=False,
        patch_artist=True,
        manage_ticks=False,
        boxprops={**look, "linewidth": 0.6},
        medianprops={"color": ink, "linewidth": 1.2},
        whiskerprops={"color": ink, "linewidth": 0.6},
        capprops={"color": ink, "linewidth": 0.6},
    )


def _by_fleet(rows: Sequence[BenchRow]) -> list[BenchRow]:
    """Return the rows of the map that was planned with the most sizes of fleets."""
    families: dict[str, list[BenchRow]] = {}
    for row in rows:
        families.setdefault(row.family, []).append(row)
    own = max(families.values(), key=lambda part: len({row.robots for row in part}))
    return sorted(own, key=lambda row: row.robots)


def _unique(items: Iterable[str]) -> list[str]:
    return list(dict.fromkeys(items))
