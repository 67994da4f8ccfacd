"""The fleet and its free spaces as flat arrays, the form in which kernels know them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mrmg.compilation import kernel
from mrmg.world._kernels import FreeSpace

PLANNING_MARGIN_M = 0.25
"""Distance the planner keeps from obstacles at its time steps.

Between two steps of 0.1 s no corner of a car moves more than 0.16 m from both ends, so
this also keeps the motion between the steps clear, and leaves room for tracking errors.
"""

ROBOT_MARGIN_M = 0.5
"""Distance the planner keeps between robots at its time steps."""


class Fleet(NamedTuple):
    """Robots as arrays; R robots, planner's share of the limits.

    Attributes:
        model: motion model id, shape (R,).
        wheelbase: [m], shape (R,).
        limit: (v_min, v_max, w_max, u1_max, u2_max), shape (R, 5).
        corner: footprint corners, padded, shape (R, M, 2).
        corners: number of corners, shape (R,).
        middle: middle of the footprint in the robot's frame, shape (R, 2).
        radius: distance of the farthest corner from the middle, shape (R,).
        turning_radius: [m], shape (R,).
        passage: clearance of the reference point's line of travel [m], shape (R,).
        space: index of the free space, shape (R,).
        field: index of the cost-to-go fields, shape (R,).
        energy: coefficients of the energy model, shape (R, 6).
        plain: battery energy per metre of plain ground [J/m], shape (R,).
        capacity, reserve: [J], shape (R,).
    """

    model: np.ndarray
    wheelbase: np.ndarray
    limit: np.ndarray
    corner: np.ndarray
    corners: np.ndarray
    middle: np.ndarray
    radius: np.ndarray
    turning_radius: np.ndarray
    passage: np.ndarray
    space: np.ndarray
    field: np.ndarray
    energy: np.ndarray
    plain: np.ndarray
    capacity: np.ndarray
    reserve: np.ndarray


class Spaces(NamedTuple):
    """All free spaces of a world stacked, so that their number is not part of a type."""

    x_min: float
    y_min: float
    cell: float
    distance: np.ndarray
    bucket: float
    bucket_columns: int
    bucket_rows: int
    bucket_start: np.ndarray
    bucket_edge: np.ndarray
    reach: float
    edge: np.ndarray


@kernel
def space_of(spaces, index):
    """Return one free space of the stack."""
    return FreeSpace(
        spaces.x_min,
        spaces.y_min,
        spaces.cell,
        spaces.distance[index],
        spaces.bucket,
        spaces.bucket_columns,
        spaces.bucket_rows,
        spaces.bucket_start[index],
        spaces.bucket_edge,
        spaces.reach,
        spaces.edge,
    )
