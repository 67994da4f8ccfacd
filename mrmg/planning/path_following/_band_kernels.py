"""An elastic band: the cheapest path of a given kind past a robot's targets.

A path is a chain of nodes. Its cost, in metres of plain ground, adds up terrain, the
scrub of turning, and penalties on curvature no robot can drive, on jumps of curvature,
on footprints too near to obstacles and on targets that are missed.
"""

from __future__ import annotations

from math import ceil, floor, isfinite, sqrt
from typing import NamedTuple

import numpy as np

from mrmg.compilation import borrowed, inlined, kernel
from mrmg.planning.path_following._bending_kernels import (
    add_aim,
    bending_cost,
    write_turns,
)
from mrmg.planning.problem._target_kernels import Targets

CLEARANCE_WEIGHT = 600.0
"""Cost per metre and square metre of missing clearance [m/m^3]."""

TURNING_WEIGHT = 600.0
"""Cost per square metre of clearance that a turn on the spot lacks [m/m^2]."""

TARGET_WEIGHT = 600.0
"""Cost per square metre of a target's distance [m/m^2]."""

EVENNESS_WEIGHT = 0.3
"""Cost of neighbouring segments of unequal length [m/m^2]."""


class CostMap(NamedTuple):
    """What a path is priced on: grids of one robot's clearance and of the terrain.

    Attributes:
        x_min, y_min, cell: of both grids [m].
        distance: signed distance from obstacles, shape (ny, nx).
        multiplier: of energy, smoothed, shape (ny, nx).
        disc: centres of the discs that cover the footprint, ahead of the reference
            point [m], shape (D,).
        length: of the footprint [m].
        room: clearance their centres need [m].
        turning_room: clearance that the reference point needs in turns on the spot [m].
        curvature: greatest [1/m].
        curvature_rate: greatest change of it per metre [1/m^2].
        scrub: plain ground that turning by one radian is worth [m].
    """

    x_min: float
    y_min: float
    cell: float
    distance: np.ndarray
    multiplier: np.ndarray
    disc: np.ndarray
    length: float
    room: float
    turning_room: float
    curvature: float
    curvature_rate: float
    scrub: float


class Stops(NamedTuple):
    """The targets at a path's nodes.

    Attributes:
        targets: all targets.
        node: number of the node, increasing, shape (S,).
        target: number of the target there, shape (S,).
        deeper: how deep the node is to lie inside [m], shape (S,).
        aim: heading that the path is to have there [rad], NaN for any, shape (S,).
    """

    targets: Targets
    node: np.ndarray
    target: np.ndarray
    deeper: np.ndarray
    aim: np.ndarray


@inlined
def value_and_slope(cost_map, grid, x, y):
    """Return (value, d/dx, d/dy) of one of a cost map's grids, bilinear."""
    rows, columns = grid.shape
    cell = cost_map.cell
    fx = (x - cost_map.x_min) / cell - 0.5
    fy = (y - cost_map.y_min) / cell - 0.5
    column = min(max(int(floor(fx)), 0), columns - 2)
    row = min(max(int(floor(fy)), 0), rows - 2)
    fx = min(1.0, max(0.0, fx - column))
    fy = min(1.0, max(0.0, fy - row))
    a, b = grid[row, column], grid[row, column + 1]
    c, d = grid[row + 1, column], grid[row + 1, column + 1]
    low = a + (b - a) * fx
    high = c + (d - c) * fx
    slope_x = ((b - a) * (1.0 - fy) + (d - c) * fy) / cell
    return low + (high - low) * fy, slope_x, (high - low) / cell


@kernel
def outside(stops, i, x, y):
    """Return (distance outside a stop's region, drawn in, d/dx, d/dy); 0 inside."""
    t = stops.target[i]
    region, corner = stops.targets.target[t], stops.targets.corner[t]
    if region.corners == 0:
        dx, dy = x - region.center[0], y - region.center[1]
        far = sqrt(dx * dx + dy * dy)
        off = far - region.reach + stops.deeper[i]
        return (off, dx / far, dy / far) if off > 0.0 else (0.0, 0.0, 0.0)
    worst, nx, ny = 0.0, 0.0, 0.0
    n = region.corners
    for k in range(n):
        j = k + 1 if k + 1 < n else 0
        ex, ey = corner[j, 0] - corner[k, 0], corner[j, 1] - corner[k, 1]
        size = sqrt(ex * ex + ey * ey)
        ox, oy = x - corner[k, 0], y - corner[k, 1]
        off = (ey * ox - ex * oy) / size + stops.deeper[i]
        if off > worst:
            worst, nx, ny = off, ey / size, -ex / size
    return worst, nx, ny


@kernel
def add_terrain_and_clearance(cost_map, p, gear, gradient):
    """Add the cost of the ground under each segment and of what it comes near to.

    A segment is looked at in pieces no longer than the footprint, which is laid on the
    middle of each: so that no wall, however thin, lies between two of them.
    """
    cost_map, p, gear, gradient = borrowed((cost_map, p, gear, gradient))
    total = 0.0
    for i in range(len(p) - 1):
        bx, by = p[i + 1, 0] - p[i, 0], p[i + 1, 1] - p[i, 1]
        size = sqrt(bx * bx + by * by + 1e-12)
        tx, ty = bx / size, by / size
        pieces = int(ceil(size / cost_map.length))
        for piece in range(pieces):
            share = (piece + 0.5) / pieces
            density, gx, gy, across = density_at(
                cost_map, p[i, 0] + share * bx, p[i, 1] + share * by, tx, ty, gear[i]
            )
            part = size / pieces
            total += density * part
            # A cost per metre times the length of the segment, and its gradient.
            away_x = (density * tx - ty * across) / pieces
            away_y = (density * ty + tx * across) / pieces
            gradient[i, 0] += (1.0 - share) * gx * part - away_x
            gradient[i, 1] += (1.0 - share) * gy * part - away_y
            gradient[i + 1, 0] += share * gx * part + away_x
            gradient[i + 1, 1] += share * gy * part + away_y
    return total


@inlined
def density_at(cost_map, x, y, tx, ty, gear):
    """Return the cost per metre at a point, its gradient, and its slope by turning.

    Args:
        cost_map: what the path is priced on.
        x, y: the point [m].
        tx, ty: unit vector along the path there.
        gear: 1 or -1.
    """
    density, gx, gy = value_and_slope(cost_map, cost_map.multiplier, x, y)
    across, distance = 0.0, cost_map.distance
    middle = 0.5 * (cost_map.disc[0] + cost_map.disc[-1]) * gear
    free, _, _ = value_and_slope(cost_map, distance, x + middle * tx, y + middle * ty)
    wide = free > cost_map.room + cost_map.disc[-1] - cost_map.disc[0]
    for j in range(0 if wide else len(cost_map.disc)):
        ahead = cost_map.disc[j] * gear
        free, fx, fy = value_and_slope(
            cost_map, distance, x + ahead * tx, y + ahead * ty
        )
        lack = cost_map.room - free
        if lack > 0.0:
            density += CLEARANCE_WEIGHT * lack * lack
            push = -2.0 * CLEARANCE_WEIGHT * lack
            gx += push * fx
            gy += push * fy
            # Turning the segment swings the disc sideways.
            across += push * (fy * tx - fx * ty) * ahead
    return density, gx, gy, across


@kernel
def add_bending(cost_map, p, gear, pivot, nose, shape, gradient):
    """Add the cost of turning, of too much curvature and of its changes."""
    # At its start a robot that turns on the spot does so, whatever its path is.
    free, _, _ = value_and_slope(cost_map, cost_map.distance, p[0, 0], p[0, 1])
    stiff = TURNING_WEIGHT * max(0.0, cost_map.turning_room - free)
    stiff, free_end = 0.0 if pivot[0] else stiff, not nose[1].any()
    total = bending_cost(cost_map, gear, pivot, stiff, free_end, shape)
    for i in range(len(p) - 1):
        bx, by = p[i + 1, 0] - p[i, 0], p[i + 1, 1] - p[i, 1]
        size = shape.size[i]
        # The segment's direction counts in the turns at both its ends.
        swing = (shape.d_turn[i] - shape.d_turn[i + 1]) / (size * size)
        stretch = shape.d_size[i] / size
        gx, gy = stretch * bx - swing * by, stretch * by + swing * bx
        gradient[i + 1, 0] += gx
        gradient[i + 1, 1] += gy
        gradient[i, 0] -= gx
        gradient[i, 1] -= gy
    return total


@kernel
def add_evenness(p, gear, size, gradient):
    """Add the cost of unequal neighbours, which keeps nodes from gathering."""
    total = 0.0
    for i in range(1, len(gear)):
        if gear[i] != gear[i - 1]:
            continue
        uneven = size[i] - size[i - 1]
        total += EVENNESS_WEIGHT * uneven * uneven
        slope = 2.0 * EVENNESS_WEIGHT * uneven
        for j in range(2):
            ahead = slope * (p[i + 1, j] - p[i, j]) / size[i]
            behind = slope * (p[i, j] - p[i - 1, j]) / size[i - 1]
            gradient[i + 1, j] += ahead
            gradient[i, j] -= ahead + behind
            gradient[i - 1, j] += behind
    return total


@kernel
def band_cost(cost_map, stops, p, gear, pivot, nose, shape, gradient):
    """Return a path's cost [m of plain ground] and write its gradient, shape (n, 2)."""
    gradient[:] = 0.0
    write_turns(p, gear, nose, shape)
    total = add_terrain_and_clearance(cost_map, p, gear, gradient)
    total += add_bending(cost_map, p, gear, pivot, nose, shape, gradient)
    total += add_evenness(p, gear, shape.size, gradient)
    for v in np.flatnonzero(pivot):
        free, fx, fy = value_and_slope(cost_map, cost_map.distance, p[v, 0], p[v, 1])
        lack = max(0.0, cost_map.turning_room - free)
        total += TURNING_WEIGHT * lack * lack
        gradient[v, 0] -= 2.0 * TURNING_WEIGHT * lack * fx
        gradient[v, 1] -= 2.0 * TURNING_WEIGHT * lack * fy
    for i in range(len(stops.node)):
        v = stops.node[i]
        off, dx, dy = outside(stops, i, p[v, 0], p[v, 1])
        if off > 0.0:
            total += TARGET_WEIGHT * off * off
            gradient[v, 0] += 2.0 * TARGET_WEIGHT * off * dx
            gradient[v, 1] += 2.0 * TARGET_WEIGHT * off * dy
        if isfinite(stops.aim[i]) and 0 < v < len(gear):
            for s in range(v - 1, v + 1):
                ends = gradient[s : s + 2]
                total += add_aim(cost_map, p[s], p[s + 1], gear[s], stops.aim[i], ends)
    gradient[0] = 0.0
    return total
