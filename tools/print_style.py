"""Sizes and settings of the tools' figures, which are made for print."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from matplotlib import rc_context
from matplotlib.figure import Figure

from mrmg.viz.figures import FOR_PRINT, new_figure, require_format, write_figure

COLUMN_IN, PAGE_IN = 3.45, 7.16
"""Widths of one and of two columns of an IEEE paper [inch]."""
TEXT_PT, SMALL_PT = 7.5, 6.0
"""Sizes of text, and of the labels within maps."""

_SMALL: Any = {
    "font.size": TEXT_PT,
    "axes.titlesize": TEXT_PT,
    "axes.labelsize": TEXT_PT,
    "xtick.labelsize": TEXT_PT,
    "ytick.labelsize": TEXT_PT,
    "legend.fontsize": TEXT_PT,
    "axes.linewidth": 0.6,
    "hatch.linewidth": 0.4,
    "patch.linewidth": 0.5,
}


@contextmanager
def print_figure(size_in: tuple[float, float], path: Path) -> Iterator[Figure]:
    """Yield an empty figure with small text; write it to `path` afterwards.

    Args:
        size_in: width and height [inch].
        path: file to write, atomically (one of `FORMATS` by its suffix).

    Raises:
        UsageError: if the suffix is none of them.
    """
    require_format(path)
    with rc_context({**FOR_PRINT, **_SMALL}):
        figure = new_figure(*size_in, dpi=None)
        yield figure
        write_figure(figure, path)
