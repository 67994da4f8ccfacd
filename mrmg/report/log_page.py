"""The page of a calibration from logs: laws, terrains, runs side by side, residuals."""

from __future__ import annotations

import base64
import math

from markupsafe import Markup

from mrmg.report.page import elements as html
from mrmg.report.page import page
from mrmg.studies.calibration.calibrate import Estimate
from mrmg.studies.calibration.log_calibration import LogCalibration
from mrmg.viz.log_plot import fit_svg, runs_svg


def calibration_html(calibration: LogCalibration) -> str:
    """Return the page of a calibration."""
    name = calibration.model.name
    return page(
        f"{name}: calibrated from logs",
        [
            html.heading(f"{name}: energy parameters from logs"),
            html.tiles(_tiles(calibration)),
            html.section("Laws compared", _laws(calibration), html.note(_reason())),
            html.section("Terrains", _terrains(calibration)),
            html.section("Fit", _image(fit_svg(calibration), "power and residuals")),
            html.section(
                "Runs side by side",
                html.note(
                    "Each fitted run is predicted by the other runs of its terrain, "
                    "test runs by all of them. Bars are 90 % prediction intervals."
                ),
                _image(runs_svg(calibration), "energies of all runs"),
                _runs(calibration),
            ),
        ],
    )


def _tiles(calibration: LogCalibration) -> list[tuple[str, str, str]]:
    best = calibration.laws_json()[0]
    return [
        ("Law", best["name"], best["formula"]),
        (
            "Median error",
            f"{best['median_error_pct']:.1f} %",
            "of a run's energy, predicted by the other runs",
        ),
        (
            "90 % intervals hold",
            f"{best['intervals_hold_pct']:.0f} %",
            f"of the runs; they are {best['interval_width_pct']:.0f} % wide (median)",
        ),
    ]


def _reason() -> str:
    return (
        "By leaving out each run in turn: the law with the least mean "
        "|log(measured / predicted)| comes first and is used; a law with fewer "
        "parameters that predicts as well is one that has understood more."
    )


def _laws(calibration: LogCalibration) -> str:
    laws = calibration.laws_json()
    names = [item.name for item in calibration.terrains]
    rows = [
        [
            law["name"],
            law["formula"],
            f"{law['mean_log_error']:.3f}",
            f"{law['median_error_pct']:.1f}",
            *(f"{law['terrains'][name]['median_error_pct']:.1f}" for name in names),
            f"{law['intervals_hold_pct']:.0f}",
            f"{law['interval_width_pct']:.0f}",
        ]
        for law in laws
    ]
    head = ["law", "power", "mean |log error|", "median error [%]"]
    head += [f"{name} [%]" for name in names]
    head += ["intervals hold [%]", "width [%]"]
    return html.table(head, rows, text_columns=(0, 1), sums=(0,))


def _terrains(calibration: LogCalibration) -> str:
    rows = [
        [
            item.name,
            str(item.runs),
            _value(item.rolling_W_s_m),
            _value(item.turning_W_s_rad),
            _value(item.stationary_W),
            _value(item.inertia_kg),
            f"{item.multiplier:.2f}",
            f"{item.turning_multiplier:.2f}",
            f"{100.0 * item.energy_spread:.0f}",
        ]
        for item in calibration.terrains
    ]
    head = ["terrain", "runs", "rolling [W s/m]", "turning [W s/rad]"]
    head += ["stationary [W]", "inertia [kg]", "multiplier", "turning_multiplier"]
    return html.table([*head, "spread [%]"], rows)


def _runs(calibration: LogCalibration) -> str:
    rows = [
        [
            item.run.file,
            item.run.terrain + ("" if item.fitted else " (test)"),
            f"{item.run.energy_J:.0f}",
            f"{item.predicted_J:.0f}",
            f"{item.error_pct:+.1f}",
            f"{item.interval_J[0]:.0f} .. {item.interval_J[1]:.0f}",
            "yes" if item.holds else "no",
        ]
        for item in calibration.runs
    ]
    head = ["log", "terrain", "measured [J]", "predicted [J]", "error [%]"]
    return html.table([*head, "interval [J]", "holds"], rows, text_columns=(0, 1, 6))


def _value(item: Estimate) -> str:
    if math.isnan(item.half_width):
        return f"{item.value:.3g} (not determined)"
    return f"{item.value:.3g} ± {item.half_width:.2g}"


def _image(svg: str, what: str) -> str:
    data = base64.b64encode(svg.encode()).decode()
    source = f"data:image/svg+xml;base64,{data}"
    return Markup('<img alt="{}" src="{}" width="100%">').format(what, source)
