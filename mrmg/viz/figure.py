"""Figures of a run for papers: map, energy or timeline, as PDF, SVG or PNG."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from matplotlib import rc_context

from mrmg.errors import Fault, RunFolderError, require_known
from mrmg.runs.record import read_record
from mrmg.viz.energy_plot import draw_energy
from mrmg.viz.figures import FOR_PRINT, require_format
from mrmg.viz.overview import draw_overview
from mrmg.viz.timeline_plot import draw_timeline

_DRAW: dict[str, Callable[..., None]] = {
    "map": draw_overview,
    "energy": draw_energy,
    "timeline": draw_timeline,
}
KINDS = tuple(_DRAW)
"""What a figure can show."""


def draw_figure(
    run_folder: Path, kind: str, path: Path, *, trust_code: bool = False
) -> None:
    """Draw one figure of a run.

    Args:
        run_folder: the run; at least planned.
        kind: one of `KINDS`.
        path: file to write; its suffix, one of `figures.FORMATS`, gives the format.
        trust_code: whether robot models may bring Python code (`loading.trust`).

    Raises:
        UsageError: if kind or suffix is unknown.
        RunFolderError: if the run has no plan, or cannot be read.
    """
    require_known("kind", kind, KINDS)
    require_format(path)
    record = read_record(run_folder, trust_code=trust_code)
    if record.plan is None:
        reason = f"there is no plan to draw ({record.planning['reason']})"
        reason += "; 'mrmg scene draw' draws the scene"
        raise RunFolderError(str(run_folder), [Fault("planning.json", reason)])
    with rc_context(FOR_PRINT):
        _DRAW[kind](record.scene, record.plan, record.log, path=path)
