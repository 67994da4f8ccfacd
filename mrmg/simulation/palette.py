"""Colours of the simulated world, chosen to stay apart for colour-blind eyes.

Robots take the Okabe-Ito palette (Okabe and Ito 2008), lightened in later rounds;
terrain takes steps after Tol's YlOrBr (Tol 2021), softened, whose lightness falls as
driving gets harder.
"""

from __future__ import annotations

import math

import numpy as np

Rgb = tuple[float, float, float]

_OKABE_ITO: tuple[Rgb, ...] = (
    (0.000, 0.447, 0.698),
    (0.835, 0.369, 0.000),
    (0.000, 0.620, 0.451),
    (0.800, 0.475, 0.655),
    (0.337, 0.706, 0.914),
    (0.902, 0.624, 0.000),
    (0.941, 0.894, 0.259),
    (0.350, 0.350, 0.350),
)
_HARDER = np.array(
    [
        (0.886, 0.894, 0.843),  # plain ground
        (0.980, 0.900, 0.640),
        (0.973, 0.800, 0.450),
        (0.900, 0.600, 0.300),
        (0.780, 0.430, 0.190),
        (0.600, 0.280, 0.120),
    ]
)
_EASIER: Rgb = (0.72, 0.84, 0.90)
_DARKEST_MULTIPLIER = 8.0

OBSTACLE: Rgb = (0.42, 0.45, 0.50)
PARTIAL_OBSTACLE: Rgb = (0.62, 0.55, 0.68)
WALL: Rgb = (0.30, 0.32, 0.36)
GOAL: Rgb = (0.47, 0.15, 0.62)
STATION: Rgb = (0.06, 0.52, 0.50)


def robot_colour(index: int) -> Rgb:
    """Return the colour of the robot at `index` in the scene's order."""
    turn, place = divmod(index, len(_OKABE_ITO))
    lightness = 1.0 - 0.6**turn
    red, green, blue = (part + (1.0 - part) * lightness for part in _OKABE_ITO[place])
    return red, green, blue


def terrain_colour(multiplier: float) -> Rgb:
    """Return the ground's colour for a terrain multiplier; 1 is plain ground."""
    if multiplier < 1.0:
        return _EASIER
    share = min(math.log(multiplier) / math.log(_DARKEST_MULTIPLIER), 1.0)
    at = share * (len(_HARDER) - 1)
    red, green, blue = (
        float(np.interp(at, np.arange(len(_HARDER)), _HARDER[:, part]))
        for part in range(3)
    )
    return red, green, blue
