"""How well the energy model fits what was measured: power by leg, and residuals."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes

from mrmg.studies.calibration.calibrate import Calibration, Estimate
from mrmg.viz import style
from mrmg.viz.figures import FOR_PRINT, new_figure, tidy, write_figure

_LOOKS = {
    "straight": ("o", "#0072B2"),
    "cycle": ("^", "#D55E00"),
    "circle": ("s", "#009E73"),
    "spin": ("D", "#CC79A7"),
}
"""Marker and colour by kind of manoeuvre."""

_SIZE_INCHES = (9.5, 6.2)


def draw_calibration(calibration: Calibration, path: Path) -> None:
    """Draw measured against fitted power, the residuals and the parameters.

    Args:
        calibration: what to draw.
        path: picture to write (PNG, SVG or PDF by its suffix).
    """
    figure = new_figure(*_SIZE_INCHES)
    left, right = figure.subplots(1, 2, width_ratios=(1.0, 1.25))
    _draw_agreement(left, calibration)
    _draw_residuals(right, calibration)
    figure.suptitle(_title(calibration), x=0.01, ha="left", fontsize=10.5)
    figure.legend(
        *left.get_legend_handles_labels(),
        loc="outside lower center",
        ncols=len(_LOOKS) + 1,
        frameon=False,
    )
    with rc_context(FOR_PRINT):
        write_figure(figure, path)


def _draw_agreement(axes: Axes, calibration: Calibration) -> None:
    measured = np.array([leg.power_W for leg in calibration.legs])
    fitted = calibration.fit.fitted
    ends = [fitted.min(), fitted.max()]
    axes.plot(ends, ends, color=style.MUTED, linewidth=0.8, label="measured = fitted")
    for kind, rows in _rows_by_kind(calibration).items():
        marker, color = _LOOKS[kind]
        axes.plot(
            fitted[rows],
            measured[rows],
            marker,
            color=color,
            markersize=5,
            markerfacecolor="none",
            label=kind,
        )
    axes.set_xlabel("fitted mean power of a leg [W]")
    axes.set_ylabel("measured mean power of a leg [W]")
    tidy(axes)


def _draw_residuals(axes: Axes, calibration: Calibration) -> None:
    """Draw the residuals in the order of driving, manoeuvres of a kind together."""
    residual = calibration.fit.residual
    axes.axhline(0.0, color=style.MUTED, linewidth=0.8)
    for kind, rows in _rows_by_kind(calibration).items():
        marker, color = _LOOKS[kind]
        axes.vlines(rows, 0.0, residual[rows], color=color, linewidth=1.0)
        axes.plot(rows, residual[rows], marker, color=color, markersize=4)
    rms = calibration.fit.residual_rms
    axes.axhspan(-rms, rms, color=style.MUTED, alpha=0.12, linewidth=0)
    axes.set_title(f"band: root mean square, {rms:.3g} W", loc="left", fontsize=9)
    axes.set_xlabel("leg, in order of driving")
    axes.set_ylabel("measured less fitted [W]")
    tidy(axes)


def _rows_by_kind(calibration: Calibration) -> dict[str, np.ndarray]:
    kinds = np.array([leg.manoeuvre.kind for leg in calibration.legs])
    return {kind: np.flatnonzero(kinds == kind) for kind in _LOOKS if kind in kinds}


def _title(calibration: Calibration) -> str:
    lines = [f"{calibration.model.name}: energy model fitted to MuJoCo"]
    lines += [_line(name, item) for name, item in calibration.estimates.items()]
    return "\n".join(lines)


def _line(name: str, item: Estimate) -> str:
    unit = "" if item.unit == "1" else f" {item.unit.replace('^2', '²')}"
    was = "not in the model" if item.was is None else f"model: {item.was:.6g}"
    quantity = name.removesuffix("_kg_m2").removesuffix("_kg").replace("_", " ")
    return f"{quantity} {item.rounded()} ± {item.half_width:.1g}{unit} ({was})"
