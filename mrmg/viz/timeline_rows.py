"""What a timeline shows, for page and picture: spans, and names in lines above them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from mrmg.energy.battery_curves import shown_curves
from mrmg.plans import Plan, Visit
from mrmg.scene.types import Scene
from mrmg.simulation.log import ExecutionLog
from mrmg.viz import style
from mrmg.viz.activities import (
    Activity,
    activities,
    breakdowns,
    standing_of,
)
from mrmg.viz.tags import text_width_em

_SHORTEST_S = 0.1
_GAP_EM = 0.6
_MOST_LINES = 8
HIDDEN = -1
"""Line of a name that has no room."""


@dataclass(frozen=True, slots=True, kw_only=True)
class NamedVisit:
    """A visit and its name.

    Attributes:
        visit: of a goal or station.
        text: its name.
        width_em: of the name.
        lines: number of the line above the bar that the name is in, from 0, for each
            width of the timeline; `HIDDEN` where it has no room.
    """

    visit: Visit
    text: str
    width_em: float
    lines: tuple[int, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class TimelineRow:
    """What one robot does.

    Attributes:
        robot: its id.
        standing: "broken down", "not used" or "".
        spans: without gaps.
        visits: of its tour, in order of time.
    """

    robot: str
    standing: str
    spans: tuple[Activity, ...]
    visits: tuple[NamedVisit, ...]

    def line_count(self, layout: int) -> int:
        """Return how many lines of names a width of the timeline needs; at least 1."""
        return max([1, *(named.lines[layout] + 1 for named in self.visits)])

    def spent_s(self, kind: str) -> float:
        """Return how long the robot was at activities of a kind [s]."""
        return sum(
            span.end_s - span.start_s for span in self.spans if span.kind == kind
        )


def timeline_rows(
    scene: Scene, plan: Plan, log: ExecutionLog | None, widths_em: Sequence[float]
) -> tuple[tuple[TimelineRow, ...], float]:
    """Return the rows of a timeline, and when it ends [s].

    Args:
        scene: gives names and stations.
        plan: what was to be driven; shown where there is no log.
        log: what was driven.
        widths_em: of the time axis in each layout, in sizes of the names' letters.
    """
    curves = shown_curves(scene, plan, log)
    end_s = max(_SHORTEST_S, *(float(curve.time_s[-1]) for curve in curves))
    broken_s = breakdowns(log)
    rows = []
    for curve in curves:
        robot, visits = curve.robot, curve.visits
        rows.append(
            TimelineRow(
                robot=robot,
                standing=standing_of(scene.robot(robot), plan, log),
                spans=activities(scene, curve, visits, broken_s.get(robot)),
                visits=named_visits(scene, visits, end_s, widths_em),
            )
        )
    return tuple(rows), end_s


def named_visits(
    scene: Scene, visits: Iterable[Visit], end_s: float, widths_em: Sequence[float]
) -> tuple[NamedVisit, ...]:
    """Return the names of visits in lines; see `timeline_rows`."""
    visits = sorted(visits, key=lambda visit: visit.time_s)
    names = style.target_labels(scene)
    texts = [names[visit.target] for visit in visits]
    sizes = [text_width_em(text, bold=True) for text in texts]
    shares = [visit.time_s / end_s for visit in visits]
    layouts = [name_lines(shares, sizes, width_em) for width_em in widths_em]
    return tuple(
        NamedVisit(visit=visit, text=text, width_em=size, lines=lines)
        for visit, text, size, lines in zip(
            visits, texts, sizes, zip(*layouts, strict=True), strict=True
        )
    )


def name_lines(
    shares: Sequence[float], sizes_em: Sequence[float], width_em: float
) -> list[int]:
    """Return the lowest line for each name in which it meets none before it.

    Args:
        shares: places of the names' middles, 0..1 of the axis, ascending; names at its
            ends are moved inwards.
        sizes_em: widths of the names.
        width_em: of the axis.
    """
    ends_em = [-_GAP_EM] * _MOST_LINES
    lines = []
    for share, size_em in zip(shares, sizes_em, strict=True):
        middle_em = min(max(share * width_em, 0.5 * size_em), width_em - 0.5 * size_em)
        free = [
            line
            for line, end_em in enumerate(ends_em)
            if end_em + _GAP_EM <= middle_em - 0.5 * size_em + 1e-9
        ]
        lines.append(free[0] if free else HIDDEN)
        if free:
            ends_em[free[0]] = middle_em + 0.5 * size_em
    return lines
