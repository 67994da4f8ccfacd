"""The page of a calibration from logs: laws, terrains, runs side by side, residuals."""

from __future__ import annotations

import base64

from mrmg.report.page import page, rendered
from mrmg.studies.calibration.log_calibration import LogCalibration
from mrmg.viz.log_plot import fit_svg, runs_svg


def calibration_html(calibration: LogCalibration) -> str:
    """Return the page of a calibration."""
    fit, runs = (
        base64.b64encode(svg.encode()).decode()
        for svg in (fit_svg(calibration), runs_svg(calibration))
    )
    laws = calibration.laws_json()
    body = rendered(
        "log.html.jinja", calibration=calibration, laws=laws, fit=fit, runs=runs
    )
    return page(f"{calibration.model.name}: calibrated from logs", body)
