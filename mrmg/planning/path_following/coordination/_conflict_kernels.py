"""Where motions of robots meet."""

from __future__ import annotations

import numpy as np

from mrmg.compilation import kernel
from mrmg.planning.path_following.coordination._motion_kernels import (
    first_conflict,
)
from mrmg.planning.problem._region_kernels import in_region
from mrmg.planning.roadmap._fleet_kernels import MOST_CORNERS, middle_at


@kernel
def note_motion(fleet, zones, traffic, inside, r, count):
    """Note middles and zones of robot r's first states in the traffic.

    Args:
        fleet, zones: robots and mutual-exclusion zones.
        traffic: of all robots; `pose` of robot r is new.
        inside: receives which zones it is in, shape (R, G, K).
        r: robot.
        count: number of its states.
    """
    traffic.robot[r].last = count - 1
    for k in range(inside.shape[2]):
        pose = traffic.pose[r, min(k, count - 1)]
        if k < count:
            traffic.middle[r, k, 0], traffic.middle[r, k, 1] = middle_at(fleet[r], pose)
        for zone in range(len(zones.zone)):
            inside[r, zone, k] = in_region(
                zones.zone[zone], zones.corner[zone], pose[0], pose[1]
            )


@kernel
def conflicts_of(fleet, traffic, inside, r, conflict):
    """Write the step of robot r's first conflict with each other one, inf for never.

    Args:
        fleet: the robots.
        traffic: their motions; `closing` is robot r's.
        inside: which zones they are in, shape (R, G, K).
        r: robot.
        conflict: receives the steps, shape (R,).
    """
    corner = np.empty((2, MOST_CORNERS, 2))
    own = traffic.pose[r, : traffic.robot[r].last + 1]
    for other in range(len(fleet)):
        conflict[other] = np.inf
        if other == r:
            continue
        count = max(traffic.robot[r].last, traffic.robot[other].last)
        k = first_conflict(fleet[r : r + 1], traffic, other, own, count, 0, corner)
        if k >= 0:
            conflict[other] = k
        for zone in range(inside.shape[1]):
            for step in range(min(count + 1, inside.shape[2])):
                if inside[r, zone, step] and inside[other, zone, step]:
                    conflict[other] = min(conflict[other], step)
                    break
