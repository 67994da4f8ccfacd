"""Regions of the roadmap, and paths along it from where a robot is."""

from __future__ import annotations

from math import hypot

import numpy as np

from mrmg.compilation import leaf_kernel
from mrmg.world._kernels import multiplier_in


@leaf_kernel
def region_of(roadmap, joined, x, y):
    """Return a point's region: the nearest vertex of the roadmap that is joined.

    Rings of buckets are searched outwards; what lies beyond ring n is at least n
    buckets away.

    Args:
        roadmap: `RoadmapArrays`.
        joined: which vertices count, shape (V,).
        x, y: the point [m].
    """
    column = min(max(int((x - roadmap.x_min) / roadmap.bucket), 0), roadmap.columns - 1)
    row = min(max(int((y - roadmap.y_min) / roadmap.bucket), 0), roadmap.rows - 1)
    nearest = -1
    best = np.inf
    for ring in range(max(roadmap.rows, roadmap.columns)):
        for i in range(max(row - ring, 0), min(row + ring + 1, roadmap.rows)):
            for j in range(
                max(column - ring, 0), min(column + ring + 1, roadmap.columns)
            ):
                if max(abs(i - row), abs(j - column)) < ring:
                    continue
                b = i * roadmap.columns + j
                for at in range(roadmap.bucket_start[b], roadmap.bucket_start[b + 1]):
                    v = roadmap.bucket_vertex[at]
                    if not joined[v]:
                        continue
                    far = hypot(roadmap.vertex[v, 0] - x, roadmap.vertex[v, 1] - y)
                    if far < best:
                        best = far
                        nearest = v
        if best <= ring * roadmap.bucket:
            break
    return nearest


@leaf_kernel
def path_energy(setting, r, t, x, y, region):
    """Return the energy from a point to a target along the roadmap [J].

    The path leads straight to the region's vertex, and from there along the roadmap;
    infinite where the roadmap does not join the two.
    """
    robot = setting.fleet[r]
    vertex = setting.roadmap.vertex[region]
    straight_m = hypot(vertex[0] - x, vertex[1] - y)
    costs_m = straight_m * multiplier_in(setting.terrain, x, y)
    return robot.plain * (costs_m + setting.roadmap.cost_to_go[robot.field, t, region])


@leaf_kernel
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
