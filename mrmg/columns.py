"""Names and units of the columns of states and controls, by motion model."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from mrmg.errors import MachineError

POSE_AND_SPEED = {"x_m": "m", "y_m": "m", "theta_rad": "rad", "v_m_s": "m/s"}

_FIFTH = {
    "car": {"psi_rad": "rad"},
    "unicycle": {"omega_rad_s": "rad/s"},
}
_CONTROLS = {
    "car": {"u1_m_s2": "m/s^2", "u2_rad_s": "rad/s"},
    "unicycle": {"u1_m_s2": "m/s^2", "u2_rad_s2": "rad/s^2"},
}


def state_columns(motion: str) -> dict[str, str]:
    """Return the unit of each state column by its name.

    The fifth is the steering angle psi of a car, the yaw rate omega of a differential
    drive ("unicycle"), and w, whose meaning and unit (SI) its file defines, of a custom
    motion, or where the motion model was not recorded.
    """
    return {**POSE_AND_SPEED, **_FIFTH.get(motion, {"w": "SI"})}


def control_columns(motion: str) -> dict[str, str]:
    """Return the unit of each control column by its name."""
    return _CONTROLS.get(motion, {"u1": "SI", "u2": "SI"})


def named(names: Mapping[str, str], values: np.ndarray, rows: int) -> dict[str, Any]:
    """Return the columns of an array by name, each with `rows` values.

    What holds between two rows stands in the first of them; the last row has NaN.
    """
    padded = np.full((rows, len(names)), np.nan)
    padded[: len(values)] = values.reshape(len(values), len(names))
    return dict(zip(names, padded.T, strict=True))


def data_frame(arrays: Mapping[str, np.ndarray]) -> Any:
    """Return a pandas DataFrame of named columns.

    Raises:
        MachineError: if pandas, which mrmg does not depend on, is not installed.
    """
    try:
        import pandas as pd
    except ImportError as error:
        raise MachineError(
            "to_dataframe needs pandas, which is not installed; 'pip install pandas', "
            "or use to_arrays, which returns a dict of arrays"
        ) from error
    return pd.DataFrame(dict(arrays))
