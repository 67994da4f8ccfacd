"""Studies over many simulated drives: calibration of models, robustness of plans."""
