"""The fleet and its free spaces as flat arrays, the form in which kernels know them."""

from __future__ import annotations

from math import cos, sin

import numpy as np

from mrmg.compilation import inlined, kernel, record_type
from mrmg.energy.model import N_COEFFICIENTS
from mrmg.world._kernels import FreeSpace

MOST_CORNERS = 12
"""Most corners a footprint may have."""

FLEET = record_type(
    [
        ("model", np.int64),  # motion model id
        ("step_at", np.int64),  # address of a user's compiled step, else 0
        ("steer_at", np.int64),  # address of a user's compiled steering, else 0
        ("wheelbase", np.float64),  # [m]
        ("track", np.float64),  # [m]
        ("limit", np.float64, (5,)),  # planner's v_min, v_max, w_max, u1_max, u2_max
        ("corner", np.float64, (MOST_CORNERS, 2)),  # footprint [m], padded
        ("corners", np.int64),  # number of corners
        ("middle", np.float64, (2,)),  # of the footprint, in the robot's frame [m]
        ("radius", np.float64),  # of the farthest corner from the middle [m]
        ("turning_radius", np.float64),  # [m]
        ("passage", np.float64),  # clearance of the reference point's way [m]
        ("margin", np.float64),  # distance kept from obstacles [m]
        ("spacing", np.float64),  # distance kept from other robots [m]
        ("space", np.int64),  # index of the free space
        ("field", np.int64),  # index of the cost-to-go fields
        ("energy", np.float64, (N_COEFFICIENTS,)),  # coefficients of the energy model
        ("plain", np.float64),  # battery energy per metre of plain ground [J/m]
        ("capacity", np.float64),  # [J]
        ("charge", np.float64),  # power of recharging [W], inf for at once
        ("reserve", np.float64),  # energy the planner leaves [J]
    ]
)
"""One robot as a record; a fleet is an array of them, shape (R,)."""


Spaces = FreeSpace
"""The free spaces of a world stacked, as their number is no part of a type: distances,
bucket starts and allowances have one more axis, edges are numbered through."""


@kernel
def middle_at(robot, state):
    """Return the middle (x, y) of a robot's footprint in a state [m]."""
    mx, my = robot.middle[0], robot.middle[1]
    if mx == my == 0.0:
        return state[0], state[1]
    c, s = cos(state[2]), sin(state[2])
    return state[0] + c * mx - s * my, state[1] + s * mx + c * my


@inlined
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
        spaces.allowance[index],
        spaces.guide,
    )
