"""Costs-to-go as searches read them."""

from __future__ import annotations

from math import floor, pi
from typing import NamedTuple

import numpy as np

from mrmg.compilation import inlined, kernel

BEARINGS = 8
"""Headings that costs-to-go of turning know: those to the cells about one."""


class Guide(NamedTuple):
    """Costs-to-go through all targets of a tour, then to where the robot may stay.

    Attributes:
        field: from each cell on each leg in each layer of time to the end [s], shape
            (L, T, ny, nx); the last layer lasts.
        turning: what turning costs beside that with each of BEARINGS, a full turn
            divided by their number apart, [s], shape (L, BEARINGS, ny, nx); (0, ...) if
            it is not known.
        x_min, y_min: corner of the grid [m].
        cell: side of a cell [m].
        layer: steps that a layer of time lasts.
    """

    field: np.ndarray
    turning: np.ndarray
    x_min: float
    y_min: float
    cell: float
    layer: int


@inlined
def guide_at(guide, leg, step, x, y):
    """Return the cost-to-go of a point on a leg at a step [s].

    It is bilinear, of the cells around the point that have a value. The last leg's
    costs count for all after it: `NO_GUIDE` has those of one.
    """
    legs, layers = guide.field.shape[:2]
    field = guide.field[min(leg, legs - 1), min(step // guide.layer, layers - 1)]
    rows, columns = field.shape
    fx = (x - guide.x_min) / guide.cell - 0.5
    fy = (y - guide.y_min) / guide.cell - 0.5
    column = min(max(int(floor(fx)), 0), columns - 1)
    row = min(max(int(floor(fy)), 0), rows - 1)
    u, v = min(1.0, max(0.0, fx - column)), min(1.0, max(0.0, fy - row))
    total = weight = 0.0
    for i in range(2):
        for j in range(2):
            value = field[min(row + i, rows - 1), min(column + j, columns - 1)]
            share = (v if i else 1.0 - v) * (u if j else 1.0 - u)
            if value < np.inf and share > 0.0:
                total += share * value
                weight += share
    return total / weight if weight > 0.0 else np.inf


@kernel
def turning_at(guide, leg, state):
    """Return what turning costs from a state on beside the cost-to-go [s]."""
    rows, columns = guide.turning.shape[2], guide.turning.shape[3]
    column = int(floor((state[0] - guide.x_min) / guide.cell))
    row = int(floor((state[1] - guide.y_min) / guide.cell))
    column, row = min(max(column, 0), columns - 1), min(max(row, 0), rows - 1)
    place = state[2] / (2.0 * pi) * BEARINGS
    low = int(floor(place))
    share = place - low
    one = guide.turning[leg, low % BEARINGS, row, column]
    return (1.0 - share) * one + share * guide.turning[
        leg, (low + 1) % BEARINGS, row, column
    ]
