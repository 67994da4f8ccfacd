"""Measuring what the energy model of a robot should say.

`calibrate` drives it in MuJoCo and fits, `calibrate_from_logs` fits to logs of a real
robot; `write_calibration` leaves a calibrated copy of the model.
"""

from mrmg.studies.calibration.calibrate import (
    Calibration,
    Estimate,
    calibrate,
    fit_legs,
)
from mrmg.studies.calibration.files import (
    require_other_folder,
    write_calibration,
    write_terrain,
)
from mrmg.studies.calibration.log_calibration import LogCalibration, calibrate_from_logs
from mrmg.studies.calibration.robot_logs import LoggedRun, read_run

__all__ = [
    "Calibration",
    "Estimate",
    "LogCalibration",
    "LoggedRun",
    "calibrate",
    "calibrate_from_logs",
    "fit_legs",
    "read_run",
    "require_other_folder",
    "write_calibration",
    "write_terrain",
]
