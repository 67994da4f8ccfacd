"""The report's timeline: what each robot does when, one row per robot."""

from __future__ import annotations

import math
from html import escape

from mrmg.execution.log import ExecutionLog
from mrmg.execution.supervision import Event
from mrmg.mission import Plan, Visit
from mrmg.results import mission_series as series
from mrmg.results import style
from mrmg.scene.types import Scene

_MOST_TICKS = 10
_SHORTEST_S = 0.1
_EVENT_KEY = ' <i class="event"></i>the fleet is stopped, or planned for anew'
_DONE = {"stop": "; the fleet stops", "end": "; the mission ends"}
_SAID = {
    series.DRIVING: "drives",
    series.WAITING: "waits",
    series.CHARGING: "charges",
    series.FINISHED: "has finished",
}


def timeline(scene: Scene, plan: Plan, log: ExecutionLog | None) -> str:
    """Return the timeline of the driven mission (planned, where none was driven)."""
    motions = series.shown_motions(plan, log)
    end_s = max(_SHORTEST_S, *(float(motion.time_s[-1]) for motion in motions))
    names = {**style.goal_labels(scene), **style.station_labels(scene)}
    rows = []
    for at, motion in enumerate(motions):
        visits = series.shown_visits(scene, plan, motion)
        spans = series.activities(scene, motion, visits)
        parts = [_span(motion.robot, span, end_s) for span in spans]
        parts += [_visit(visit, names[visit.target], end_s) for visit in visits]
        parts += [_event(event, end_s) for event in log.events] if log else []
        shares = {
            kind: sum(span.end_s - span.start_s for span in spans if span.kind == kind)
            for kind in _SAID
        }
        rows.append(
            f'<div class="row" data-robot="{escape(motion.robot)}" '
            f'style="--c:var(--r{at})"><b class="who">{escape(motion.robot)}</b>'
            f'<div class="track">{"".join(parts)}</div>'
            f'<span class="sum">{_shares(shares)}</span></div>'
        )
    return (
        f'<div class="timeline" data-end="{end_s:.3f}">{"".join(rows)}'
        f'<div class="row scale"><b class="who"></b><div class="track">'
        f"{_ticks(end_s)}"
        '<i class="now" hidden></i></div><span class="sum"></span></div></div>'
        '<p class="soft key"><i class="act driving"></i>driving '
        '<i class="act waiting"></i>waiting <i class="act charging"></i>'
        'at a station ⚡ <i class="act finished"></i>finished '
        "│ entering a goal"
        f"{_EVENT_KEY if log and log.events else ''}</p>"
    )


def _span(robot: str, span: series.Activity, end_s: float) -> str:
    tip = f"{robot} {_SAID[span.kind]}"
    tip += f" at {span.target}" if span.target else ""
    tip += f" from {span.start_s:.1f} to {span.end_s:.1f} s"
    left, width = 100 * span.start_s / end_s, 100 * (span.end_s - span.start_s) / end_s
    return (
        f'<i class="act {span.kind}" style="left:{left:.3f}%;width:{width:.3f}%" '
        f'data-tip="{escape(tip)}"></i>'
    )


def _visit(visit: Visit, name: str, end_s: float) -> str:
    label = f"⚡{name}" if visit.kind == "station" else name
    tip = f"{visit.robot} enters {visit.kind} {visit.target} at {visit.time_s:.1f} s"
    return (
        f'<i class="visit {visit.kind}" style="left:{100 * visit.time_s / end_s:.3f}%" '
        f'data-tip="{escape(tip)}"><s>{escape(label)}</s></i>'
    )


def _event(event: Event, end_s: float) -> str:
    tip = f"{event.time_s:.1f} s: {event.message}"
    return (
        f'<i class="event" style="left:{100 * event.time_s / end_s:.3f}%" '
        f'data-tip="{escape(tip)}"></i>'
    )


def events(log: ExecutionLog | None) -> list[str]:
    """Return what mission control saw and did, one sentence an event."""
    return [
        f"{event.time_s:.1f} s: {event.message}" + _DONE.get(event.action, "")
        for event in (log.events if log else ())
    ]


def _shares(duration_s: dict[str, float]) -> str:
    if not any(duration_s[kind] for kind in (series.DRIVING, series.WAITING)):
        return "stays where it is"
    words = [f"{duration_s[series.DRIVING]:.0f} s driving"]
    if duration_s[series.WAITING] > 0.0:
        words.append(f"{duration_s[series.WAITING]:.0f} s waiting")
    if duration_s[series.CHARGING] > 0.0:
        words.append(f"{duration_s[series.CHARGING]:.0f} s at stations")
    return ", ".join(words)


def _ticks(end_s: float) -> str:
    return "".join(
        f'<i class="tick" style="left:{100 * number * step_s / end_s:.3f}%">'
        f"{number * step_s:g} s</i>"
        for step_s in [_step(end_s)]
        for number in range(int(end_s / step_s) + 1)
    )


def _step(end_s: float) -> float:
    """Return the least of 1, 2, 5, 10, ... that divides the axis into a few pieces."""
    power = 10.0 ** math.floor(math.log10(end_s / _MOST_TICKS))
    return next(
        factor * power
        for factor in (1.0, 2.0, 5.0, 10.0)
        if end_s / (factor * power) <= _MOST_TICKS
    )
