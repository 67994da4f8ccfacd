"""How well a power law fits logs of a robot: energies of runs, powers and residuals."""

from __future__ import annotations

import io

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure

from mrmg.studies.calibration.log_calibration import LogCalibration
from mrmg.studies.calibration.log_fit import Pieces
from mrmg.viz import style
from mrmg.viz.figures import FOR_PRINT, new_figure, tidy

_COLORS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
_ROWS_PER_INCH = 5.5


def runs_svg(calibration: LogCalibration) -> str:
    """Return all runs side by side as SVG: measured energies within their intervals."""
    runs = calibration.runs
    figure = new_figure(9.5, 1.2 + len(runs) / _ROWS_PER_INCH, dpi=None)
    axes = figure.subplots()
    colors = _colors(calibration)
    for row, item in enumerate(runs):
        color, energy_J = colors[item.run.terrain], item.run.energy_J
        low, high = (end / energy_J for end in item.interval_J)
        axes.plot([low, high], [row, row], color=color, linewidth=3.0, alpha=0.35)
        axes.plot(item.predicted_J / energy_J, row, "|", color=color, markersize=9)
    axes.axvline(1.0, color=style.MUTED, linewidth=0.8)
    names = [
        f"{item.run.terrain} {item.run.file.rpartition('/')[2]}"
        f"{'' if item.fitted else ' (test)'}"
        for item in runs
    ]
    axes.set_yticks(range(len(runs)), names, fontsize=7)
    axes.set_ylim(len(runs) - 0.5, -0.5)
    axes.set_xscale("log")
    ticks = (0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 4.0)
    axes.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    axes.minorticks_off()
    axes.set_xlabel("predicted over measured energy of a run, and its 90 % interval")
    tidy(axes)
    return _svg(figure)


def fit_svg(calibration: LogCalibration) -> str:
    """Return power measured against fitted, and residuals by speed and yaw rate."""
    figure = new_figure(9.5, 3.6, dpi=None)
    panels = figure.subplots(1, 3)
    fit, colors = calibration.fits[0], _colors(calibration)
    labelled: set[str] = set()
    for item in calibration.runs:
        if not item.fitted:
            continue
        run = item.run
        pieces = Pieces.of(run, fit.law)
        fitted_W = pieces.features @ fit.law.coefficients(fit.parameters[run.terrain])
        label = None if run.terrain in labelled else run.terrain
        labelled.add(run.terrain)
        look = {"color": colors[run.terrain], "markersize": 2.2, "alpha": 0.5}
        off_W = pieces.power_W - fitted_W
        panels[0].plot(fitted_W, pieces.power_W, "o", label=label, **look)
        panels[1].plot(pieces.speed_m_s, off_W, "o", **look)
        panels[2].plot(pieces.yaw_rate_rad_s, off_W, "o", **look)
    ends = np.array(panels[0].get_xlim())
    panels[0].plot(ends, ends, color=style.MUTED, linewidth=0.8)
    panels[0].set(xlabel="fitted power [W]", ylabel="measured power, 2 s means [W]")
    panels[1].set(xlabel="speed [m/s]", ylabel="measured less fitted [W]")
    panels[2].set(xlabel="yaw rate [rad/s]", ylabel="measured less fitted [W]")
    for axes in panels:
        tidy(axes)
    for axes in panels[1:]:
        axes.axhline(0.0, color=style.MUTED, linewidth=0.8)
    legend = figure.legend(loc="outside lower center", ncols=6, frameon=False)
    for handle in filter(None, legend.legend_handles):
        handle.set_alpha(1.0)
    return _svg(figure)


def _colors(calibration: LogCalibration) -> dict[str, str]:
    return {
        item.name: _COLORS[number % len(_COLORS)]
        for number, item in enumerate(calibration.terrains)
    }


def _svg(figure: Figure) -> str:
    text = io.StringIO()
    with rc_context(FOR_PRINT):
        figure.savefig(text, format="svg", metadata={"Date": None})
    return text.getvalue()
