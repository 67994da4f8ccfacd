"""The report's timeline: what each robot does when, one row per robot."""

from __future__ import annotations

from markupsafe import Markup
from matplotlib.ticker import MaxNLocator

from mrmg.plans import Plan
from mrmg.report.page import rendered
from mrmg.scene.types import Scene
from mrmg.simulation.log import ExecutionLog
from mrmg.viz.tags import text_width_em
from mrmg.viz.timeline_rows import timeline_rows

_MOST_TICKS = 10
_WIDE_EM, _NARROW_EM = 45.0, 22.0
"""Widths of the time axis in letters of its names: windows of 900 and 400 pixels."""


def timeline(scene: Scene, plan: Plan, log: ExecutionLog | None) -> Markup:
    """Return the timeline of the driven mission (planned, where none was driven)."""
    rows, end_s = timeline_rows(scene, plan, log, (_WIDE_EM, _NARROW_EM))
    ticks = MaxNLocator(_MOST_TICKS, steps=(1, 2, 5, 10)).tick_values(0.0, end_s)
    return rendered(
        "timeline.html.jinja",
        rows=rows,
        end_s=end_s,
        who_em=max(text_width_em(row.robot, bold=True) for row in rows),
        events=log.events if log else (),
        ticks=ticks,
        text_width_em=text_width_em,
    )
