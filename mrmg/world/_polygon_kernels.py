"""Distances of points, segments and convex polygons, and footprints at poses.

Polygons are arrays of their corners, counter-clockwise, shape (m, 2), in m.
"""

from __future__ import annotations

from math import cos, hypot, sin

import numpy as np

from mrmg.compilation import kernel


@kernel
def point_segment_distance(px, py, ax, ay, bx, by):
    """Return the distance of a point from a segment."""
    dx = bx - ax
    dy = by - ay
    length2 = dx * dx + dy * dy
    t = 0.0
    if length2 > 0.0:
        t = ((px - ax) * dx + (py - ay) * dy) / length2
        t = min(1.0, max(0.0, t))
    return hypot(px - ax - t * dx, py - ay - t * dy)


@kernel
def segments_cross(ax, ay, bx, by, cx, cy, dx, dy):
    """Return whether segments ab and cd properly cross."""
    d1 = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    d2 = (bx - ax) * (dy - ay) - (by - ay) * (dx - ax)
    d3 = (dx - cx) * (ay - cy) - (dy - cy) * (ax - cx)
    d4 = (dx - cx) * (by - cy) - (dy - cy) * (bx - cx)
    return (d1 > 0.0) != (d2 > 0.0) and (d3 > 0.0) != (d4 > 0.0)


@kernel
def point_in_convex(px, py, corners):
    """Return whether a point lies in a convex counter-clockwise polygon."""
    n = len(corners)
    for i in range(n):
        j = i + 1 if i + 1 < n else 0
        ex = corners[j, 0] - corners[i, 0]
        ey = corners[j, 1] - corners[i, 1]
        if ex * (py - corners[i, 1]) - ey * (px - corners[i, 0]) < 0.0:
            return False
    return True


@kernel
def point_convex_distance(px, py, corners):
    """Return the distance of a point from a convex polygon; 0 where it lies in it."""
    if point_in_convex(px, py, corners):
        return 0.0
    best = np.inf
    n = len(corners)
    for i in range(n):
        j = i + 1 if i + 1 < n else 0
        ax, ay, bx, by = corners[i, 0], corners[i, 1], corners[j, 0], corners[j, 1]
        best = min(best, point_segment_distance(px, py, ax, ay, bx, by))
    return best


@kernel
def convex_segment_distance(corners, ax, ay, bx, by):
    """Return the distance of a convex polygon from a segment; 0 where they meet."""
    best = point_convex_distance(ax, ay, corners)
    best = min(best, point_convex_distance(bx, by, corners))
    n = len(corners)
    for i in range(n):
        j = i + 1 if i + 1 < n else 0
        px, py = corners[i, 0], corners[i, 1]
        if segments_cross(px, py, corners[j, 0], corners[j, 1], ax, ay, bx, by):
            return 0.0
        best = min(best, point_segment_distance(px, py, ax, ay, bx, by))
    return best


@kernel
def convex_convex_distance(first, second):
    """Return the distance of two convex polygons; 0 where they meet."""
    if point_in_convex(second[0, 0], second[0, 1], first):
        return 0.0
    if point_in_convex(first[0, 0], first[0, 1], second):
        return 0.0
    best = np.inf
    n = len(second)
    for i in range(n):
        j = i + 1 if i + 1 < n else 0
        best = min(
            best,
            convex_segment_distance(
                first, second[i, 0], second[i, 1], second[j, 0], second[j, 1]
            ),
        )
        if best == 0.0:
            return 0.0
    return best


@kernel
def place_footprint(footprint, x, y, theta, out):
    """Write the footprint's corners at a pose into `out`, shape (m, 2)."""
    c = cos(theta)
    s = sin(theta)
    for i in range(len(footprint)):
        out[i, 0] = x + c * footprint[i, 0] - s * footprint[i, 1]
        out[i, 1] = y + s * footprint[i, 0] + c * footprint[i, 1]
