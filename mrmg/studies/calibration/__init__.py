"""Measuring what the energy model of a robot should say.

`calibrate.calibrate` drives it in MuJoCo and fits, `log_calibration` fits to logs of a
real robot; `files.write_calibration` leaves a calibrated copy of the model.
"""
