"""Compiled parts of the roadmap: edges with energy, and the nearest useful vertex."""

from __future__ import annotations

from math import hypot
from typing import NamedTuple

import numpy as np

from mrmg.compilation import by_reference, kernel
from mrmg.planning.roadmap._bucket_kernels import Buckets, bucket_of
from mrmg.world._kernels import (
    clearance_estimate,
    height_in,
    segment_clearance,
    segment_cost,
    segment_is_clear,
    sloped_length,
)


@by_reference
class RoadmapArrays(NamedTuple):
    """The roadmap as the kernels see it; V vertices, T targets, F travel classes.

    Attributes:
        vertex: positions [m], shape (V, 2); the first T are the targets' centres.
        cost_to_go: cost to each target [m of plain ground], shape (F, T, V); inf where
            cut off.
        successor: next vertex on the way to each target, -1 at the end, shape (F, T,
            V).
        slope_price, slope_floor, slope_refund: `slopes.SlopeCost` of each class, shape
            (F,).
        buckets: of the vertices.
    """

    vertex: np.ndarray
    cost_to_go: np.ndarray
    successor: np.ndarray
    slope_price: np.ndarray
    slope_floor: np.ndarray
    slope_refund: np.ndarray
    buckets: Buckets


TIGHT_M = 0.7
"""Clearance beyond the passage below which driving costs more in the roadmap."""

TIGHT_SHARE = 0.35
"""Surcharge of an edge that has no clearance to spare."""


@kernel
def edge_costs(space, terrain, vertex, first, second, passage, price, floor):
    """Return the costs of candidate edges there and back; inf where they are blocked.

    They are metres of plain ground, with heights as a potential (`slopes`). Shape
    (n, 2).

    An edge through a tight passage costs up to TIGHT_SHARE more: driving there takes
    corrections the roadmap does not see, and a detour of equal length is safer.
    """
    cost = np.full((len(first), 2), np.inf)
    for i in range(len(first)):
        ax, ay = vertex[first[i], 0], vertex[first[i], 1]
        bx, by = vertex[second[i], 0], vertex[second[i], 1]
        enough = passage + TIGHT_M
        clearance = segment_clearance(space, ax, ay, bx, by, passage, enough)
        if clearance >= passage:
            tight = TIGHT_SHARE * (1.0 - (clearance - passage) / TIGHT_M)
            there = segment_cost(terrain, ax, ay, bx, by, price, floor)
            back = there
            if terrain.height.shape[0] > 0:
                back = segment_cost(terrain, bx, by, ax, ay, price, floor)
            cost[i, 0] = there * (1.0 + tight)
            cost[i, 1] = back * (1.0 + tight)
    return cost


COMFORT_M = 0.4
"""Clearance beyond the passage that lines of sight keep where they can."""


NEAR_M = 2.5
"""Distance within which a waypoint is passed over for the next one in sight."""


@kernel
def find_waypoint(space, terrain, roadmap, field, target, x, y, passage, view, out):
    """Find the point to drive at from (x, y) on the way to a target.

    The way is the roadmap's: of the near vertices the one with the least energy through
    it to the target, and then its successors as far as they can be seen at no more
    cost. Lines of sight keep COMFORT_M more than the passage if the place allows it, so
    that narrow mouths are driven at head on.

    Args:
        space, terrain: the world.
        roadmap: the roadmap.
        field: index of the cost-to-go fields.
        target: number of the target.
        x, y: position [m].
        passage: clearance the line of sight needs [m].
        view: how far successors are looked for [m].
        out: receives the waypoint (x, y).

    Returns:
        Cost [m of plain ground] from (x, y) to the target, heights as a potential; inf
        if no vertex is in sight.
    """
    here = 0.95 * clearance_estimate(space, x, y)
    successor = roadmap.successor[field, target]
    comfortable = min(passage + COMFORT_M, here)
    v, cost = best_vertex(
        space, terrain, roadmap, field, target, x, y, comfortable, min(passage, here)
    )
    if v < 0:
        return np.inf
    cost_to_go = roadmap.cost_to_go[field, target]
    while successor[v] >= 0:
        after = successor[v]
        ax, ay = roadmap.vertex[after, 0], roadmap.vertex[after, 1]
        # A waypoint this near gives no direction: look on, through the tight place.
        near = hypot(roadmap.vertex[v, 0] - x, roadmap.vertex[v, 1] - y) < NEAR_M
        if hypot(ax - x, ay - y) > view or not segment_is_clear(
            space, x, y, ax, ay, min(passage, here) if near else comfortable
        ):
            break
        straight = cost_to_go[after] + segment_cost(
            terrain,
            x,
            y,
            ax,
            ay,
            roadmap.slope_price[field],
            roadmap.slope_floor[field],
        )
        if straight > cost * (1.0 + 1e-9) + 0.02:
            break
        cost = min(cost, straight)
        v = after
    out[0], out[1] = roadmap.vertex[v, 0], roadmap.vertex[v, 1]
    return cost


@kernel
def best_vertex(space, terrain, roadmap, field, target, x, y, comfortable, needed):
    """Return (vertex in sight with the least energy through it, that energy [m]).

    Looks in growing squares of buckets; vertices seen with comfortable clearance come
    before those seen with the needed one. Returns (-1, inf) if none is in sight.
    """
    cost_to_go = roadmap.cost_to_go[field, target]
    price, floor = roadmap.slope_price[field], roadmap.slope_floor[field]
    here = height_in(terrain, x, y)
    buckets = roadmap.buckets
    column, row = bucket_of(buckets, x, y)
    candidate = np.empty(256, np.int64)
    cost = np.empty(256, np.float64)
    for attempt in range(3):
        reach = 1 + (attempt == 2)
        clearance = comfortable if attempt == 0 else needed
        n = 0
        for r in range(max(0, row - reach), min(buckets.rows, row + reach + 1)):
            for c in range(
                max(0, column - reach), min(buckets.columns, column + reach + 1)
            ):
                b = r * buckets.columns + c
                for i in range(buckets.start[b], buckets.start[b + 1]):
                    v = buckets.member[i]
                    if n < 256 and cost_to_go[v] < np.inf:
                        candidate[n] = v
                        vx, vy = roadmap.vertex[v, 0], roadmap.vertex[v, 1]
                        # Pieces add up to no less than the whole, which is convex.
                        cost[n] = cost_to_go[v] + sloped_length(
                            hypot(vx - x, vy - y),
                            height_in(terrain, vx, vy) - here,
                            price,
                            floor,
                        )
                        n += 1
        best = -1
        best_cost = np.inf
        for _ in range(min(n, 40)):
            cheapest = np.argmin(cost[:n])
            if cost[cheapest] >= best_cost:
                break
            v = candidate[cheapest]
            cost[cheapest] = np.inf
            vx, vy = roadmap.vertex[v, 0], roadmap.vertex[v, 1]
            if segment_is_clear(space, x, y, vx, vy, clearance):
                exact = cost_to_go[v] + segment_cost(
                    terrain, x, y, vx, vy, price, floor
                )
                if exact < best_cost:
                    best_cost = exact
                    best = v
        if best >= 0:
            return best, best_cost
    return -1, np.inf
