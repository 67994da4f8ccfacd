"""Measuring what the energy model of a robot should say, by driving it in MuJoCo.

`calibrate` drives and fits, `write_calibration` leaves a calibrated copy of the model.
"""

from mrmg.studies.calibration.calibrate import (
    Calibration,
    Estimate,
    calibrate,
    fit_legs,
)
from mrmg.studies.calibration.files import require_other_folder, write_calibration

__all__ = [
    "Calibration",
    "Estimate",
    "calibrate",
    "fit_legs",
    "require_other_folder",
    "write_calibration",
]
