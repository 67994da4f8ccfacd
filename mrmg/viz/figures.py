"""What all figures drawn with matplotlib have in common."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from matplotlib import rc_context
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from mrmg import storage
from mrmg.errors import UsageError
from mrmg.viz.timeline_rows import HIDDEN, NamedVisit

DPI = 110
FORMATS = (".pdf", ".svg", ".png")
"""What figures can be written as."""

NAME_POINTS = 8.5
"""Size of the names of visits."""
NAMES_EM = 7.8 * 72.0 / NAME_POINTS
"""Width of axes of time, at least, in letters of such names."""

FOR_PRINT: Any = {
    # Journals want text as text, in embedded TrueType fonts.
    "pdf.fonttype": 42,
    "svg.fonttype": "none",
    "svg.hashsalt": "mrmg",
    "savefig.dpi": 300,
}
_TIMELESS: dict[str, dict[str, Any]] = {
    "png": {"Software": None},
    "pdf": {"CreationDate": None},
    "svg": {"Date": None},
}
"""Metadata by format; with the salt of SVG, equal figures give equal files."""


def require_format(path: Path) -> None:
    """Refuse files of another format than `FORMATS`.

    Raises:
        UsageError: if the suffix is none of them.
    """
    if path.suffix.lower() not in FORMATS:
        raise UsageError(f"{path} must end in one of {', '.join(FORMATS)}")


def new_figure(width_in: float, height_in: float, **details: Any) -> Figure:
    """Return an empty white figure; `details` as of matplotlib's `Figure`."""
    look = {"dpi": DPI, "layout": "constrained", "facecolor": "white", **details}
    figure = Figure(figsize=(width_in, height_in), **look)
    FigureCanvasAgg(figure)
    return figure


def tidy(axes: Axes) -> None:
    """Give axes a pale grid behind their lines, and no frame above and on the right."""
    axes.grid(color="#E4E6EA", linewidth=0.7)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)


def add_legend_above(figure: Figure, handles: Iterable[Artist]) -> None:
    """Put a legend of one line above a figure, on the right."""
    shown = list(handles)
    figure.legend(
        handles=shown,
        loc="outside upper right",
        ncols=len(shown),
        frameon=False,
        fontsize=9.5,
    )


def write_name(axes: Axes, named: NamedVisit, bottom: float, **look: Any) -> None:
    """Write the name of a visit where its time is, if it has room in its first layout.

    Args:
        axes: over the time of the mission [s]; not less than `NAMES_EM` wide.
        named: what to write.
        bottom: lower end of the name, up the axes.
        **look: as of matplotlib's `Text`.
    """
    if named.lines[0] != HIDDEN:
        end_s = axes.get_xlim()[1]
        half_s = 0.5 * named.width_em / NAMES_EM * end_s
        axes.text(
            min(max(named.visit.time_s, half_s), end_s - half_s),
            bottom,
            named.text,
            fontsize=NAME_POINTS,
            ha="center",
            va="bottom",
            bbox={"fc": "white", "ec": "none", "pad": 0.3},
            zorder=4,
            **look,
        )


def write_figure(figure: Figure, path: Path) -> None:
    """Write a figure to `path` atomically, in the format of its suffix."""
    form = path.suffix.removeprefix(".").lower() or "png"
    salt = FOR_PRINT["svg.hashsalt"]
    with storage.atomic_path(path) as temporary, rc_context({"svg.hashsalt": salt}):
        figure.savefig(temporary, format=form, metadata=_TIMELESS.get(form))
