"""Regions of the roadmap, and paths along it from where a robot is."""

from __future__ import annotations

from math import hypot

import numpy as np

from mrmg.compilation import kernel
from mrmg.planning.roadmap._bucket_kernels import nearest_points
from mrmg.world._kernels import multiplier_in

ENTRIES = 4
"""Vertices at which a path may join the roadmap: the region's and those that follow.
The region's vertex may lie behind the robot, which costs the way there and back."""


@kernel
def region_of(roadmap, joined, x, y):
    """Return a point's region: the nearest vertex of the roadmap that is joined.

    Args:
        roadmap: `RoadmapArrays`.
        joined: which vertices count, shape (V,).
        x, y: the point [m].

    Returns:
        The vertex, -1 if none is joined.
    """
    nearest, square = np.full(1, -1, np.int64), np.empty(1)
    nearest_points(roadmap.buckets, roadmap.vertex, joined, x, y, nearest, square)
    return nearest[0]


@kernel
def path_energy(setting, r, t, x, y, region):
    """Return the energy from a point to a target along the roadmap [J].

    The path leads straight to the region's vertex, or to one of the next after it if
    that is cheaper, and from there along the roadmap; infinite where the roadmap does
    not join the two.
    """
    robot, roadmap = setting.fleet[r], setting.roadmap
    multiplier = multiplier_in(setting.terrain, x, y)
    least_m = np.inf
    v = region
    for _ in range(ENTRIES):
        if v >= 0:
            dx, dy = roadmap.vertex[v, 0] - x, roadmap.vertex[v, 1] - y
            on_m = roadmap.cost_to_go[robot.field, t, v]
            least_m = min(least_m, multiplier * hypot(dx, dy) + on_m)
            v = roadmap.successor[robot.field, t, v]
    return robot.plain * least_m


@kernel
def point_on_path(setting, r, t, region, ahead_m, point):
    """Write the point `ahead_m` along the roadmap's path from a region to a target."""
    field = setting.fleet[r].field
    vertex = setting.roadmap.vertex
    v = region
    while True:
        after = setting.roadmap.successor[field, t, v]
        if after < 0:
            point[0], point[1] = vertex[v, 0], vertex[v, 1]
            return
        dx, dy = vertex[after, 0] - vertex[v, 0], vertex[after, 1] - vertex[v, 1]
        length = hypot(dx, dy)
        if length > ahead_m:
            share = ahead_m / length
            point[0] = vertex[v, 0] + share * dx
            point[1] = vertex[v, 1] + share * dy
            return
        ahead_m -= length
        v = after
