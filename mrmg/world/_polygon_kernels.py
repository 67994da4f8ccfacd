"""Distances of points, segments and convex polygons, and footprints at poses.

Polygons are arrays of their corners, counter-clockwise, shape (m, 2), in m. A segment
is a polygon of two corners.
"""

from __future__ import annotations

from math import cos, sin, sqrt

import numpy as np

from mrmg.compilation import kernel

BULGE = 0.025
"""Share of its way that a motion of one step strays from a straight one, at most: in dt
it strays v w dt^2 / 8 from v dt [m], and w dt is at most 0.2."""


@kernel
def point_distance(ax, ay, bx, by):
    """Return the distance of two points; `hypot`, which never overflows, is slower."""
    dx, dy = bx - ax, by - ay
    return sqrt(dx * dx + dy * dy)


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
    return point_distance(px, py, ax + t * dx, ay + t * dy)


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
def beyond_sides(first, second, enough):
    """Return how far a polygon lies beyond the side of another one it is farthest from.

    Negative where it lies wholly beyond none. The distance is at least that, and where
    it is not positive either way round, the two meet (separating axes). Sides after one
    that is `enough` are not looked at.
    """
    best, n = -np.inf, len(first)
    for i in range(n):
        j = i + 1 if i + 1 < n else 0
        ex, ey = first[j, 0] - first[i, 0], first[j, 1] - first[i, 1]
        size = sqrt(ex * ex + ey * ey)
        if size == 0.0 or best >= enough:
            continue
        least = np.inf
        for k in range(len(second)):
            dx, dy = second[k, 0] - first[i, 0], second[k, 1] - first[i, 1]
            least = min(least, dx * ey - dy * ex)
        best = max(best, least / size)
    return best


@kernel
def corners_from_sides(first, second):
    """Return the least distance of a polygon's corners from sides of another one."""
    best, n = np.inf, len(first)
    for i in range(n):
        j = i + 1 if i + 1 < n else 0
        ax, ay, bx, by = first[i, 0], first[i, 1], first[j, 0], first[j, 1]
        for k in range(len(second)):
            apart = point_segment_distance(second[k, 0], second[k, 1], ax, ay, bx, by)
            best = min(best, apart)
    return best


@kernel
def convex_distance(first, second, enough):
    """Return the distance of two convex polygons; 0 where they meet.

    Some number from `enough` on where they are at least that far apart.
    """
    beyond = beyond_sides(first, second, enough)
    if beyond < enough:
        beyond = max(beyond, beyond_sides(second, first, enough))
    if beyond >= enough or beyond <= 0.0:
        return max(beyond, 0.0)
    return min(corners_from_sides(first, second), corners_from_sides(second, first))


@kernel
def place_footprint(footprint, x, y, theta, out):
    """Write the footprint's corners at a pose into `out`, shape (m, 2)."""
    place_turned(footprint, x, y, cos(theta), sin(theta), out)


@kernel
def place_turned(footprint, x, y, c, s, out):
    """Write the corners where cosine and sine of the heading are known."""
    for i in range(len(footprint)):
        out[i, 0] = x + c * footprint[i, 0] - s * footprint[i, 1]
        out[i, 1] = y + s * footprint[i, 0] + c * footprint[i, 1]


@kernel
def way_of_corners(footprint, start, end):
    """Return how far any point of a footprint moves from pose to pose at most [m]."""
    reach2 = 0.0
    for corner in footprint:
        reach2 = max(reach2, corner[0] * corner[0] + corner[1] * corner[1])
    way = point_distance(start[0], start[1], end[0], end[1])
    return way + sqrt(reach2) * abs(end[2] - start[2])


@kernel
def place_between(footprint, start, end, t, out):
    """Write the footprint's corners at share t of the way from pose to pose."""
    place_footprint(
        footprint,
        start[0] + t * (end[0] - start[0]),
        start[1] + t * (end[1] - start[1]),
        start[2] + t * (end[2] - start[2]),
        out,
    )


@kernel
def pass_apart(first, second, start, end, its_start, its_end, distance, corner):
    """Return whether two footprints stay apart while each moves from pose to pose.

    They may have met no sooner than their distance allows, and are looked at again then
    (conservative advancement: Mirtich 1996). Poses count as moved evenly in between;
    `BULGE` of the way is kept for what true motions stray from that.

    Args:
        first, second: the footprints, convex, shapes (n, 2) and (m, 2).
        start, end, its_start, its_end: poses (x, y, theta).
        distance: of the footprints at the start [m].
        corner: room for both, shape (2, M, 2).
    """
    way = way_of_corners(first, start, end) + way_of_corners(second, its_start, its_end)
    n, m = len(first), len(second)
    t = 0.0
    while distance < (1.0 - t) * way:
        if distance < BULGE * way:
            return False
        t += distance / way
        place_between(first, start, end, t, corner[0, :n])
        place_between(second, its_start, its_end, t, corner[1, :m])
        distance = convex_distance(corner[0, :n], corner[1, :m], way)
    return True
