"""The report's timeline: what each robot does when, one row per robot."""

from __future__ import annotations

from typing import Any

from markupsafe import Markup
from matplotlib.ticker import MaxNLocator

from mrmg.plans import Plan
from mrmg.report.page import rendered
from mrmg.scene.types import Scene
from mrmg.simulation.log import ExecutionLog
from mrmg.simulation.supervision import Event
from mrmg.viz.activities import BROKEN, CHARGING, DRIVING, FINISHED, WAITING, Activity
from mrmg.viz.tags import text_width_em
from mrmg.viz.timeline_rows import HIDDEN, NamedVisit, TimelineRow, timeline_rows

_MOST_TICKS = 10
_WIDE_EM, _NARROW_EM = 45.0, 22.0
"""Widths of the time axis in letters of its names: windows of 900 and 400 pixels."""
_SHORT_EM = 4.0
"""Width of robots' names that have room beside the axis in small windows."""
_DONE = {"stop": "; the fleet stops", "end": "; the mission ends"}
_SAID = {
    DRIVING: "drives",
    WAITING: "waits",
    CHARGING: "charges",
    FINISHED: "has finished",
    BROKEN: "has broken down",
}


def timeline(scene: Scene, plan: Plan, log: ExecutionLog | None) -> Markup:
    """Return the timeline of the driven mission (planned, where none was driven)."""
    shown, end_s = timeline_rows(scene, plan, log, (_WIDE_EM, _NARROW_EM))
    who_em = max(text_width_em(row.robot, bold=True) for row in shown)
    return rendered(
        "timeline.html.jinja",
        end_s=end_s,
        who_em=who_em,
        long=who_em > _SHORT_EM,
        rows=[_row(row, end_s) for row in shown],
        events=[_event(event, end_s) for event in log.events] if log else [],
        ticks=_ticks(end_s),
        broken=any(row.standing == "broken down" for row in shown),
    )


def _row(row: TimelineRow, end_s: float) -> dict[str, Any]:
    return {
        "robot": row.robot,
        "lines": (row.line_count(0), row.line_count(1)),
        "spans": [_span(row, span, end_s) for span in row.spans],
        "visits": [_visit(named, end_s) for named in row.visits],
        "standing": _standing(row, end_s),
        "shares": _shares(row),
    }


def _span(row: TimelineRow, span: Activity, end_s: float) -> dict[str, Any]:
    unused = row.standing == "not used" and span.kind == FINISHED
    tip = f"{row.robot} {'is not used' if unused else _SAID[span.kind]}"
    tip += f" at {span.target}" if span.target else ""
    tip += f" from {span.start_s:.1f} to {span.end_s:.1f} s"
    left, width = 100 * span.start_s / end_s, 100 * (span.end_s - span.start_s) / end_s
    return {"kind": span.kind, "left": left, "width": width, "tip": tip}


def _visit(named: NamedVisit, end_s: float) -> dict[str, Any]:
    visit = named.visit
    lines = dict(zip(("wide", "narrow"), named.lines, strict=True))
    hidden = "".join(f" no-{name}" for name, line in lines.items() if line == HIDDEN)
    left = 100 * visit.time_s / end_s
    return {
        "look": f"{visit.kind}{hidden}",
        "lines": "".join(f"--{name}:{max(line, 0)};" for name, line in lines.items()),
        "left": left,
        "inside": _inside(left, named.width_em),
        "text": named.text,
        "tip": f"{visit.robot} enters {visit.kind} {visit.target} "
        f"at {visit.time_s:.1f} s",
    }


def _inside(left_percent: float, width_em: float) -> str:
    """Return where the middle of a text lies, moved inwards at the ends of the axis."""
    half = f"{0.5 * width_em:.2f}em"
    return f"clamp({half},{left_percent:.3f}%,calc(100% - {half}))"


def _standing(row: TimelineRow, end_s: float) -> dict[str, str] | None:
    if not row.standing:
        return None
    broken = [span.start_s for span in row.spans if span.kind == BROKEN]
    text = f"✖ {row.standing}" if broken else row.standing
    from_percent = 100 * broken[0] / end_s if broken else 0.0
    left = f"min({from_percent:.3f}%,calc(100% - {text_width_em(text) + 1.0:.2f}em))"
    return {"look": "bad" if broken else "", "left": left, "text": text}


def _event(event: Event, end_s: float) -> dict[str, Any]:
    tip = f"{event.time_s:.1f} s: {event.message}"
    return {"left": 100 * event.time_s / end_s, "tip": tip}


def events(log: ExecutionLog | None) -> list[str]:
    """Return what the supervisor saw and did, one sentence an event."""
    return [
        f"{event.time_s:.1f} s: {event.message}" + _DONE.get(event.action, "")
        for event in (log.events if log else ())
    ]


def _shares(row: TimelineRow) -> str:
    duration_s = {
        kind: sum(span.end_s - span.start_s for span in row.spans if span.kind == kind)
        for kind in _SAID
    }
    moving = any(duration_s[kind] for kind in (DRIVING, WAITING))
    words = [f"{duration_s[DRIVING]:.0f} s driving"] if moving else []
    if duration_s[WAITING] > 0.0:
        words.append(f"{duration_s[WAITING]:.0f} s waiting")
    if duration_s[CHARGING] > 0.0:
        words.append(f"{duration_s[CHARGING]:.0f} s at stations")
    words += [row.standing] if row.standing else []
    return ", ".join(words) or "stays where it is"


def _ticks(end_s: float) -> list[dict[str, str]]:
    places = MaxNLocator(_MOST_TICKS, steps=(1, 2, 5, 10)).tick_values(0.0, end_s)
    return [
        {"left": _inside(100 * at_s / end_s, text_width_em(text)), "text": text}
        for at_s in places
        for text in [f"{at_s:g} s"]
        if at_s <= end_s
    ]
