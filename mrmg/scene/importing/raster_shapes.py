"""Cells of a raster as polygons that lose no cell and add little beside them.

A cell (row, column) covers column..column + 1 in x and row..row + 1 in y. Outlines are
rings of corners that have their cells on the left.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import shapely
from scipy import ndimage
from shapely.geometry import Polygon

_MAX_STEPS = 100
"""Steps of a staircase that one straight line replaces, at most."""


class _Outlines(NamedTuple):
    """Corners of cells that are connected by their sides, ring after ring.

    Attributes:
        points: of the corners, x and y, shape (n, 2).
        convex: which corners turn left, shape (n,).
        ring: number of the ring of each corner, ascending, shape (n,).
        part: number of the connected cells that each ring bounds, ascending; the first
            ring of a part is the outer one.
    """

    points: np.ndarray
    convex: np.ndarray
    ring: np.ndarray
    part: np.ndarray


def polygons_of_cells(mask: np.ndarray) -> np.ndarray:
    """Return the exact outlines of the cells set in `mask`, an array of polygons."""
    return np.asarray(shapely.get_parts(_exact(_outlines(mask))))


def enclosing_polygons(mask: np.ndarray, tolerance: float) -> list[Polygon]:
    """Return polygons with few corners around the cells set in `mask`.

    They cover every cell, and every point of them is at most `tolerance` [cells] from
    a cell: gaps are closed and staircases straightened as far as that allows.
    """
    if tolerance <= 0.0:
        return list(polygons_of_cells(mask))
    solid = np.asarray(mask, dtype=bool)
    whole = _without_gaps(solid, int(2.0 * tolerance))
    outlines = _outlines(whole)
    # Cells that fill a gap are as far from others as is allowed already.
    kept = _kept(outlines, ~_beside(outlines, whole & ~solid), tolerance)
    polygons = _polygons(outlines, kept)
    crossed = ~shapely.is_valid(polygons)  # a line of one ring meets one of another
    added = _straightened(outlines, kept, crossed) if crossed.any() else []
    polygons[crossed] = _exact(outlines)[crossed]
    joined = shapely.disjoint_subset_union_all([*polygons, *added])
    return list(shapely.get_parts(joined))


def _without_gaps(mask: np.ndarray, cells: int) -> np.ndarray:
    """Return cells, and up to so many between two of them in a row or column."""
    if cells == 0:
        return mask
    padded = np.pad(mask, cells)
    rows, columns = (
        ndimage.binary_closing(padded, np.ones(shape))
        for shape in ((1, cells + 1), (cells + 1, 1))
    )
    return np.asarray((rows | columns)[cells:-cells, cells:-cells])


def _outlines(mask: np.ndarray) -> _Outlines:
    padded = np.pad(np.asarray(mask, dtype=bool), 1)
    # Around each vertex: the cells south-west, south-east, north-east, north-west.
    around = padded[:-1, :-1], padded[:-1, 1:], padded[1:, 1:], padded[1:, :-1]
    corners = []
    for at in range(4):
        own, after, across, before = (around[(at + k) % 4] for k in range(4))
        for corner, turn in (
            (own & ~after & ~before, (1, at + 1, at + 2)),
            (~own & after & across & before, (0, at, at + 3)),
        ):
            y, x = np.nonzero(corner)
            corners.append(np.stack([x, y, *(np.full_like(x, n % 4) for n in turn)]))
    *place, convex, arriving, leaving = np.concatenate(corners, axis=1)
    following = _following(np.stack(place), arriving, leaving)
    points = np.stack(place, axis=1)
    # No staircase goes on past two corners of one turn, which every ring has.
    order, ring = _walked(following, following[convex == convex[following]])
    points, convex, leaving = points[order], convex[order] == 1, leaving[order]
    first = np.flatnonzero(np.diff(ring, prepend=-1))
    x, y = (points + np.array([(0, 0), (-1, 0), (-1, -1), (0, -1)])[leaving])[first].T
    part = ndimage.label(mask)[0][y, x] - 1
    left_turns = np.add.reduceat(np.where(convex, 1, -1), first) if len(first) else part
    rank = np.empty_like(part)
    rank[np.lexsort((left_turns < 0, part))] = np.arange(len(part))
    by_part = np.argsort(rank[ring], kind="stable")
    return _Outlines(
        points[by_part], convex[by_part], np.sort(rank[ring]), np.sort(part)
    )


def _following(
    place: np.ndarray, arriving: np.ndarray, leaving: np.ndarray
) -> np.ndarray:
    """Return the corner after each; directions: 0 east, 1 north, 2 west, 3 south.

    Sides of one direction lie apart on a line, so that the corners where they begin
    and those where they end are pairs in the order of the line.
    """
    following = np.zeros_like(arriving)
    for direction in range(4):
        along, across = place[direction % 2], place[1 - direction % 2]
        order = np.lexsort((along, across))
        begin, end = (order[way[order] == direction] for way in (leaving, arriving))
        following[begin] = end
    return following


def _walked(following: np.ndarray, starts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return all corners ring by ring, and the number of the ring of each."""
    after, seen = following.tolist(), bytearray(len(following))
    order: list[int] = []
    sizes = []
    for at in starts.tolist():
        begun = len(order)
        while not seen[at]:
            seen[at] = 1
            order.append(at)
            at = after[at]
        if len(order) > begun:
            sizes.append(len(order) - begun)
    return np.array(order, dtype=int), np.repeat(np.arange(len(sizes)), sizes)


def _beside(outlines: _Outlines, cells: np.ndarray) -> np.ndarray:
    """Return whether some of `cells` lie along the side from each corner to the next.

    Of the last corner of a ring False is returned.
    """
    beside = np.zeros(len(outlines.ring), dtype=bool)
    at = np.flatnonzero(outlines.ring[1:] == outlines.ring[:-1])
    begin, end = outlines.points[at], outlines.points[at + 1]
    low, high = np.minimum(begin, end), np.maximum(begin, end)
    for axis, lines in enumerate((cells, cells.T)):
        counts = np.cumsum(np.pad(lines, 1), axis=1)
        own = begin[:, axis] != end[:, axis]
        forward = (end > begin)[own, axis]
        # Cells lie north of a side that leads east, and west of one that leads north.
        line = low[own, 1 - axis] + (forward if axis == 0 else ~forward)
        beside[at[own]] = counts[line, high[own, axis]] > counts[line, low[own, axis]]
    return beside


def _kept(outlines: _Outlines, free: np.ndarray, tolerance: float) -> np.ndarray:
    """Return the corners left when straight lines replace steps of staircases.

    Only sides that are `free`, from a corner to the next, are replaced.

    A line from one convex corner to another one replaces a staircase between them if
    all corners lie on its left, and none of the steps is filled too far: a point in a
    step is at most the lesser of its distances along x and y from a cell, so a line
    (dx, dy) adds at most (dx y - dy x) / (|dx| + |dy|) in the step of a corner (x, y).
    Both are bounds of the line's direction.
    """
    points, convex, ring = outlines[:3]
    reach = np.zeros(len(points), dtype=int)
    start = np.flatnonzero(convex)
    at = start
    left = right = np.zeros((len(start), 2))
    for step in range(_MAX_STEPS):
        on = at + 2 < len(points)
        on[on] = (ring[at[on] + 2] == ring[at[on]]) & convex[at[on] + 2]
        on[on] &= ~convex[at[on] + 1] & free[at[on]] & free[at[on] + 1]
        on[on] &= (_cross(right, left) >= 0.0)[on]
        start, at, left, right = start[on], at[on], left[on], right[on]
        inner, outer = points[at + 1] - points[start], points[at + 2] - points[start]
        side = np.sign(outer)
        bound = inner + tolerance * np.stack([side[:, 1], -side[:, 0]], axis=1)
        right = bound if step == 0 else _further(right, bound, _cross(right, bound))
        fits = (_cross(outer, left) >= 0.0) & (_cross(outer, right) <= 0.0)
        at = at + 2
        reach[start[fits]] = at[fits]
        left = outer if step == 0 else _further(left, outer, _cross(outer, left))
    ends, kept, corner = reach.tolist(), [], 0
    while corner < len(ends):
        kept.append(corner)
        corner = ends[corner] or corner + 1
    return np.array(kept, dtype=int)


def _cross(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    return np.asarray(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0])


def _further(now: np.ndarray, other: np.ndarray, by: np.ndarray) -> np.ndarray:
    return np.where((by > 0.0)[:, None], other, now)


def _polygons(outlines: _Outlines, kept: np.ndarray) -> np.ndarray:
    """Return the polygon of each part, which may touch or cross itself."""
    rings = shapely.linearrings(outlines.points[kept], indices=outlines.ring[kept])
    return np.asarray(shapely.polygons(rings, indices=outlines.part))


def _exact(outlines: _Outlines) -> np.ndarray:
    """Return the polygon of each part, of several polygons where it touches itself."""
    polygons = _polygons(outlines, np.arange(len(outlines.ring)))
    touching = ~shapely.is_valid(polygons)
    polygons[touching] = shapely.make_valid(polygons[touching], method="structure")
    return polygons


def _straightened(
    outlines: _Outlines, kept: np.ndarray, parts: np.ndarray
) -> list[Polygon]:
    """Return what straight lines add to the cells of some parts."""
    own = parts[outlines.part[outlines.ring[kept[:-1]]]] & (np.diff(kept) > 1)
    spans = zip(kept[:-1][own], kept[1:][own] + 1, strict=True)
    return [Polygon(outlines.points[slice(*span)]) for span in spans]
