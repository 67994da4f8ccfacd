"""Where motions of robots meet."""

from __future__ import annotations

from math import cos, sin

import numpy as np

from mrmg.compilation import kernel
from mrmg.planning.drafting.coordination._motion_kernels import in_zone, meets
from mrmg.planning.roadmap._fleet_kernels import MOST_CORNERS


@kernel
def note_motion(fleet, gates, traffic, zone, r, count):
    """Note middles and zones of robot r's first states in the traffic.

    Args:
        fleet, gates: robots and mutual-exclusion zones.
        traffic: of all robots; `pose` of robot r is new.
        zone: receives which zones it is in, shape (R, G, K).
        r: robot.
        count: number of its states.
    """
    mx, my = fleet[r].middle[0], fleet[r].middle[1]
    traffic.last[r] = count - 1
    for k in range(zone.shape[2]):
        i = min(k, count - 1)
        x, y, theta = (
            traffic.pose[r, i, 0],
            traffic.pose[r, i, 1],
            traffic.pose[r, i, 2],
        )
        if k < count:
            c, s = cos(theta), sin(theta)
            traffic.middle[r, k, 0] = x + c * mx - s * my
            traffic.middle[r, k, 1] = y + s * mx + c * my
        for gate in range(len(gates.reach)):
            zone[r, gate, k] = in_zone(gates, gate, x, y)


@kernel
def meetings_of(fleet, traffic, zone, r, met):
    """Write the step at which robot r first meets each other one, inf for never.

    Args:
        fleet: the robots.
        traffic: their motions; `closing` is robot r's.
        zone: which zones they are in, shape (R, G, K).
        r: robot.
        met: receives the steps, shape (R,).
    """
    corner = np.empty((2, MOST_CORNERS, 2))
    own = traffic.pose[r, : traffic.last[r] + 1]
    for other in range(len(fleet)):
        met[other] = np.inf
        if other == r:
            continue
        count = max(traffic.last[r], traffic.last[other])
        k = meets(fleet[r : r + 1], traffic, other, own, count, 0, corner)
        if k >= 0:
            met[other] = k
        for gate in range(zone.shape[1]):
            for step in range(min(count + 1, zone.shape[2])):
                if zone[r, gate, step] and zone[other, gate, step]:
                    met[other] = min(met[other], step)
                    break
