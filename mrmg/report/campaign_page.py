"""The summary page of a campaign: shares, energies and times by each factor."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from mrmg.report.page import elements as html
from mrmg.report.page import macros, page

_MOST_LEVELS = 30
"""Values of a factor that are shown."""

_plots = macros("campaign.html.jinja")

_NOTE = (
    "Plots show medians, quartiles and extremes of the trials that have the figure; "
    "energy to first is the median ratio to the trials with the first value that are "
    "equal in all other factors, and in brackets their number. Shares have Wilson "
    "intervals of {confidence:.0%}; refused trials, combinations that are not allowed, "
    "do not count. trials.csv has every trial, times.csv their times on the "
    "clock, which depend on the machines, and summary.json all figures here."
)

Figures = Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class _Measure:
    """A figure of trials, and how it is shown."""

    key: str
    title: str
    unit: str
    factor: float
    digits: int

    def text(self, value: float) -> str:
        return f"{value * self.factor:.{self.digits}f} {self.unit}"


_MEASURES = (
    _Measure("cost_J", "Planned energy", "kJ", 1e-3, 2),
    _Measure("measured_J", "Measured energy", "kJ", 1e-3, 2),
    _Measure("makespan_s", "Planned makespan", "s", 1.0, 1),
    _Measure("duration_s", "Driven time", "s", 1.0, 1),
    _Measure("plan_s", "Time to plan", "s", 1.0, 2),
)


def campaign_html(figures: Figures) -> str:
    """Return the page of the content of a campaign's `summary.json`."""
    title = f"Campaign {figures['campaign']}"
    by = figures["by"]
    varied = {name: own for name, own in by.items() if len(own) > 1}
    same = [f"{name} {own[0]['value']}" for name, own in by.items() if len(own) == 1]
    everything = [{"value": "all", **figures}]
    return page(
        title,
        [
            html.heading(title),
            html.tiles(_tiles(figures)),
            html.section(
                "All trials",
                _table("", everything),
                _all_plots(everything),
                html.note(f"The same in all: {', '.join(same)}.") if same else "",
                html.note(_NOTE.format(**figures)),
            ),
            *(_by_factor(name, own) for name, own in varied.items()),
        ],
    )


def _tiles(figures: Figures) -> list[tuple[str, str, str]]:
    tiles = [
        ("Trials", str(figures["trials"]), ""),
        ("Feasible", _percent(figures["share"]), _interval(figures)),
    ]
    for measure in _MEASURES:
        if figures[measure.key] and measure.key in (
            "measured_J",
            "duration_s",
            "plan_s",
        ):
            middle, low, high = (
                measure.text(figures[measure.key][at])
                for at in ("median", "p25", "p75")
            )
            tiles.append((measure.title, middle, f"half within {low} to {high}"))
    for key in ("refused", "errors"):
        if figures[key]:
            tiles.append((key.capitalize(), str(figures[key]), "reasons in trials.csv"))
    return tiles


def _by_factor(name: str, levels: Sequence[Figures]) -> str:
    shown = levels[:_MOST_LEVELS]
    rest = ""
    if len(shown) < len(levels):
        rest = html.note(
            f"The first {len(shown)} of {len(levels)} values; summary.json has all."
        )
    return html.section(f"By {name}", _table(name, shown), rest, _all_plots(shown))


def _all_plots(levels: Sequence[Figures]) -> str:
    shares = [
        (
            level["value"],
            _percent(level["share"]),
            *((None,) * 5 if level["share"] is None else _share_places(level)),
        )
        for level in levels
    ]
    share = _plots.ranges("Share feasible", shares, ("0 %", "100 %"))
    return _plots.plots(share, *(_plot(measure, levels) for measure in _MEASURES))


def _share_places(level: Figures) -> tuple[float | None, ...]:
    low, high = level["interval"]
    return 100.0 * low, None, 100.0 * level["share"], None, 100.0 * high


def _plot(measure: _Measure, levels: Sequence[Figures]) -> str:
    """Return a plot of extremes, quartiles and medians; empty if nothing has any."""
    found = [level[measure.key] for level in levels if level[measure.key]]
    if not found:
        return ""
    low = min(each["min"] for each in found)
    span = max(each["max"] for each in found) - low
    rows = []
    for level in levels:
        own = level[measure.key]
        text = measure.text(own["median"]) if own else "–"
        names = ("min", "p25", "median", "p75", "max")
        places = [
            (100.0 * (own[at] - low) / span if span else 50.0) if own else None
            for at in names
        ]
        rows.append((level["value"], text, *places))
    ends = (measure.text(low), measure.text(low + span))
    return _plots.ranges(measure.title, rows, ends)


def _table(name: str, levels: Sequence[Figures]) -> str:
    head = [name, "Trials", "Feasible", "Share", "Interval"]
    relative = any(level.get("cost_to_first") for level in levels)
    head += [*["Planned energy to first"] * relative, "Failures"]
    rows = []
    for level in levels:
        cells = [str(level["value"]), str(level["trials"]), str(level["feasible"])]
        cells += [_percent(level["share"]), _interval(level)]
        if relative:
            ratio = level.get("cost_to_first")
            cells.append(f"{ratio['median']:.4f} ({ratio['pairs']})" if ratio else "–")
        failures = [f"{cause} {count}" for cause, count in level["failures"].items()]
        failures += [
            f"{key} {level[key]}" for key in ("refused", "errors") if level[key]
        ]
        rows.append([*cells, ", ".join(failures) or "none"])
    return html.table(head, rows, text_columns=(0, len(head) - 1))


def _percent(share: float | None) -> str:
    return "–" if share is None else f"{100.0 * share:.1f} %"


def _interval(figures: Figures) -> str:
    if figures["interval"] is None:
        return "–"
    low, high = figures["interval"]
    return f"{100.0 * low:.1f} to {100.0 * high:.1f} %"
