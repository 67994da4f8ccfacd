"""Compiled geometry: distance field, footprint against obstacles, line of sight.

Obstacles are stored as edges (the bounds' four sides included), bucketed on a coarse
grid, and as a signed distance field on a fine one. The field answers the clear cases,
since distance is 1-Lipschitz: d(p) >= d(cell centre) - |p - cell centre|. The edges
answer the close ones exactly.
"""

from __future__ import annotations

from math import ceil, floor, hypot, sqrt
from typing import NamedTuple

import numpy as np

from mrmg.compilation import inlined, kernel
from mrmg.world._polygon_kernels import convex_distance, point_segment_distance


class FreeSpace(NamedTuple):
    """Free space of one set of obstacles as flat arrays.

    Attributes:
        x_min, y_min: corner of all grids [m].
        cell: side of a field cell [m].
        distance: signed distance at cell centres [m], negative inside obstacles and
            outside the bounds, shape (ny, nx).
        bucket: side of a bucket [m].
        bucket_columns, bucket_rows: number of buckets.
        bucket_start: first edge of each bucket, shape (rows * columns + 1,).
        bucket_edge: indices of the edges within `reach` of the bucket.
        reach: every edge within this distance of a point is in the point's bucket [m].
        edge: (x0, y0, x1, y1) [m], shape (n, 4).
        allowance: by how much the margin is smaller in a cell of an opening [m],
            negative in other cells, shape (ny, nx) or (0, 0); `distance` counts it as
            clearance.
        guide: what `distance` counts as clearance in openings besides [m].
    """

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
    allowance: np.ndarray
    guide: float


NO_RELIEF = np.zeros((0, 0))
"""The heights of flat ground."""

UNIFORM_TURNING = np.ones((1, 1))
"""The multipliers of turning where all terrain resists it alike."""


class TerrainGrid(NamedTuple):
    """What the ground costs.

    Attributes:
        x_min, y_min: corner of the grids [m].
        cell: side of a cell of multipliers [m].
        multiplier: energy multiplier at cell centres, shape (ny, nx).
        height: heights at the nodes of a grid of its own [m]; `NO_RELIEF` if flat.
        height_dx, height_dy: extent of a cell of that grid [m].
        turning: multiplier of turning resistance in the cells of `multiplier`;
            `UNIFORM_TURNING` if it is 1 everywhere.
    """

    x_min: float
    y_min: float
    cell: float
    multiplier: np.ndarray
    height: np.ndarray = NO_RELIEF
    height_dx: float = 1.0
    height_dy: float = 1.0
    turning: np.ndarray = UNIFORM_TURNING


@inlined
def clearance_at_least(space, x, y):
    """Return a lower bound of the signed distance from obstacles [m]; -inf off grid.

    In openings the distance is larger by their allowance.
    """
    rows, columns = space.distance.shape
    column = int(floor((x - space.x_min) / space.cell))
    row = int(floor((y - space.y_min) / space.cell))
    if column < 0 or row < 0 or column >= columns or row >= rows:
        return -np.inf
    dx = x - space.x_min - (column + 0.5) * space.cell
    dy = y - space.y_min - (row + 0.5) * space.cell
    bound = space.distance[row, column] - sqrt(dx * dx + dy * dy)
    if space.allowance.shape[0] > 0 and space.allowance[row, column] >= 0.0:
        bound -= space.guide
    return bound


@kernel
def clearance_estimate(space, x, y):
    """Return the signed distance from obstacles [m], bilinear in the field."""
    fx = (x - space.x_min) / space.cell - 0.5
    fy = (y - space.y_min) / space.cell - 0.5
    return bilinear(space.distance, fx, fy)


@kernel
def bilinear(value, column, row):
    """Return a grid's value between its nodes; beyond them, that of the nearest edge.

    Args:
        value: at the nodes, at least two each way, shape (ny, nx).
        column, row: place in units of their distances.
    """
    rows, columns = value.shape
    i = min(max(int(floor(column)), 0), columns - 2)
    j = min(max(int(floor(row)), 0), rows - 2)
    u = min(1.0, max(0.0, column - i))
    v = min(1.0, max(0.0, row - j))
    low = value[j, i] * (1.0 - u) + value[j, i + 1] * u
    high = value[j + 1, i] * (1.0 - u) + value[j + 1, i + 1] * u
    return low * (1.0 - v) + high * v


@inlined
def footprint_is_clear(space, placed, cx, cy, radius, margin):
    """Return whether a placed footprint keeps `margin` [m] from every obstacle; exact.

    Args:
        space: the free space; its `reach` is at least radius + margin.
        placed: corners in the world, shape (m, 2).
        cx: x of the footprint's middle in the world.
        cy: y of it.
        radius: distance of the farthest corner from the middle.
        margin: required distance; with half the robot's width it exceeds a cell. In
            openings it is smaller by their allowance.
    """
    bound = clearance_at_least(space, cx, cy)
    if bound > radius + margin:
        return True
    if bound + 1.5 * space.cell < 0.0:
        return False
    # The grid of cells may reach beyond that of buckets.
    column = min(int((cx - space.x_min) / space.bucket), space.bucket_columns - 1)
    row = min(int((cy - space.y_min) / space.bucket), space.bucket_rows - 1)
    b = row * space.bucket_columns + column
    raised = 0.0
    if space.allowance.shape[0] > 0:
        row = int(floor((cy - space.y_min) / space.cell))
        column = int(floor((cx - space.x_min) / space.cell))
        if space.allowance[row, column] >= 0.0:
            raised = space.guide + space.allowance[row, column]
            margin -= space.allowance[row, column]
    edges = space.bucket_edge[space.bucket_start[b] : space.bucket_start[b + 1]]
    if not edges_are_clear(space.edge, edges, placed, margin):
        return False
    # No edge is near, so the footprint lies wholly inside or wholly outside.
    if raised > 0.0:
        return space.distance[row, column] > raised
    return clearance_estimate(space, cx, cy) > 0.0


@kernel
def footprint_distance(space, placed, cx, cy, radius, enough):
    """Return the distance of a placed footprint from the nearest edge [m].

    It is at most `enough`, and what the free space's `reach` has beyond the radius.
    """
    if clearance_at_least(space, cx, cy) >= radius + enough:
        return enough
    column = min(
        max(int((cx - space.x_min) / space.bucket), 0), space.bucket_columns - 1
    )
    row = min(max(int((cy - space.y_min) / space.bucket), 0), space.bucket_rows - 1)
    b = row * space.bucket_columns + column
    nearest = min(enough, space.reach - radius)
    for e in space.bucket_edge[space.bucket_start[b] : space.bucket_start[b + 1]]:
        x0, y0, x1, y1 = space.edge[e]
        if point_segment_distance(cx, cy, x0, y0, x1, y1) >= radius + nearest:
            continue
        edge = space.edge[e].reshape(2, 2)
        nearest = min(nearest, convex_distance(placed, edge, nearest))
    return nearest


@kernel
def edges_are_clear(edge, near, placed, margin):
    """Return whether a placed footprint keeps `margin` from some edges; exact.

    Most edges lie beyond one of the footprint's sides, whose normals are made once.

    Args:
        edge: all edges, shape (n, 4).
        near: numbers of those that are looked at.
        placed: corners in the world, shape (m, 2).
        margin: required distance.
    """
    normal = np.empty((len(placed), 3))
    for k in range(len(placed)):
        ax, ay, ex, ey = placed[k - 1, 0], placed[k - 1, 1], placed[k, 0], placed[k, 1]
        ex, ey = ex - ax, ey - ay
        size = max(sqrt(ex * ex + ey * ey), 1e-12)
        normal[k, 0], normal[k, 1] = ey / size, -ex / size
        normal[k, 2] = (ax * ey - ay * ex) / size
    for e in near:
        x0, y0, x1, y1 = edge[e, 0], edge[e, 1], edge[e, 2], edge[e, 3]
        beyond = -np.inf
        for k in range(len(placed)):
            nx, ny = normal[k, 0], normal[k, 1]
            side = min(nx * x0 + ny * y0, nx * x1 + ny * y1) - normal[k, 2]
            beyond = max(beyond, side)
        if beyond > margin:
            continue
        if convex_distance(placed, edge[e].reshape(2, 2), margin) < margin:
            return False
    return True


@kernel
def cell_value(values, terrain, x, y):
    """Return the value of the cell of a terrain's grid that holds a point."""
    rows, columns = values.shape
    column = int(floor((x - terrain.x_min) / terrain.cell))
    row = int(floor((y - terrain.y_min) / terrain.cell))
    column = min(max(column, 0), columns - 1)
    row = min(max(row, 0), rows - 1)
    return values[row, column]


@kernel
def multiplier_in(terrain, x, y):
    """Return the terrain's energy multiplier of the cell that holds a point."""
    return cell_value(terrain.multiplier, terrain, x, y)


@kernel
def turning_multiplier_in(terrain, x, y):
    """Return the terrain's multiplier of turning in the cell that holds a point."""
    return cell_value(terrain.turning, terrain, x, y)


@kernel
def height_in(terrain, x, y):
    """Return the height of the ground [m], bilinear; 0 on flat ground."""
    if terrain.height.shape[0] == 0:
        return 0.0
    fx = (x - terrain.x_min) / terrain.height_dx
    fy = (y - terrain.y_min) / terrain.height_dy
    return bilinear(terrain.height, fx, fy)


@kernel
def segment_clearance(space, ax, ay, bx, by, needed, enough):
    """Return the smallest clearance [m] along a segment, capped at `enough`.

    Once it is below `needed`, it is returned at once. Steps by the clearance found, as
    no obstacle can be nearer, and at least by half a cell.
    """
    length = hypot(bx - ax, by - ay)
    best = min(enough, clearance_estimate(space, bx, by))
    travelled = 0.0
    while travelled < length and best >= needed:
        t = travelled / length
        here = clearance_estimate(space, ax + t * (bx - ax), ay + t * (by - ay))
        best = min(best, here)
        travelled += max(here - best, 0.5 * space.cell)
    return best


@kernel
def sloped_length(way, rise, slope_price, floor):
    """Return what a way costs on a slope [m of plain ground]; see `roadmap.slopes`.

    Args:
        way: weighted length on the map [m].
        rise: difference of heights [m].
        slope_price: metres of plain ground per metre of rise.
        floor: least cost, as a share of `way`.
    """
    return max(way + slope_price * rise, floor * way)


@kernel
def segment_cost(terrain, ax, ay, bx, by, slope_price, floor):
    """Return the cost of driving along a segment [m of plain ground], by midpoints.

    On flat ground that is the integral of the multiplier. On slopes it depends on the
    direction, and pieces that lead down count at least `floor` times their weighted
    length.
    """
    length = hypot(bx - ax, by - ay)
    n = max(1, int(ceil(length / (2.0 * terrain.cell))))
    total = 0.0
    before = height_in(terrain, ax, ay)
    for i in range(n):
        t = (i + 0.5) / n
        k = multiplier_in(terrain, ax + t * (bx - ax), ay + t * (by - ay))
        t = (i + 1.0) / n
        after = height_in(terrain, ax + t * (bx - ax), ay + t * (by - ay))
        total += sloped_length(k * length / n, after - before, slope_price, floor)
        before = after
    return total
