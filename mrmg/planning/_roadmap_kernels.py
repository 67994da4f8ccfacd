"""Compiled parts of the roadmap: edges with energy, and the nearest useful vertex."""

from __future__ import annotations

from math import hypot

import numpy as np

from mrmg.compilation import kernel
from mrmg.world._kernels import (
    clearance_estimate,
    segment_clearance,
    segment_is_clear,
    segment_weighted_length,
)

TIGHT_M = 0.7
"""Clearance beyond the passage below which driving is made dearer in the roadmap."""

TIGHT_SHARE = 0.35
"""Surcharge of an edge that has no clearance to spare."""


@kernel
def edge_costs(space, terrain, vertex, first, second, passage):  # type: ignore[no-untyped-def]
    """Return the weighted length [m] of candidate edges; inf where they are blocked.

    An edge through a tight passage costs up to TIGHT_SHARE more: driving there takes
    corrections the roadmap does not see, and a detour of equal length is safer.
    """
    cost = np.full(len(first), np.inf)
    for i in range(len(first)):
        ax, ay = vertex[first[i], 0], vertex[first[i], 1]
        bx, by = vertex[second[i], 0], vertex[second[i], 1]
        clearance = segment_clearance(space, ax, ay, bx, by, passage + TIGHT_M)
        if clearance >= passage:
            tight = TIGHT_SHARE * (1.0 - (clearance - passage) / TIGHT_M)
            cost[i] = segment_weighted_length(terrain, ax, ay, bx, by) * (1.0 + tight)
    return cost


@kernel
def find_waypoint(  # type: ignore[no-untyped-def]
    space, terrain, roadmap, field, target, x, y, passage, view, out
):
    """Find the point to drive at from (x, y) on the way to a target.

    The way is the roadmap's: of the near vertices the one with the least energy through
    it to the target, and then its successors as far as they can be seen at no more cost.

    Args:
        space, terrain: the world.
        roadmap: `roadmap.RoadmapArrays`.
        field: index of the cost-to-go fields.
        target: number of the target.
        x, y: position [m].
        passage: clearance the line of sight needs [m].
        view: how far successors are looked for [m].
        out: receives the waypoint (x, y).

    Returns:
        Weighted length [m] from (x, y) to the target; inf if no vertex is in sight.
    """
    needed = min(passage, 0.95 * clearance_estimate(space, x, y))
    cost_to_go = roadmap.cost_to_go[field, target]
    successor = roadmap.successor[field, target]
    column = int((x - roadmap.x_min) / roadmap.bucket)
    row = int((y - roadmap.y_min) / roadmap.bucket)
    candidate = np.empty(256, np.int64)
    cost = np.empty(256, np.float64)
    n = 0
    for reach in range(1, 4):
        n = 0
        for r in range(max(0, row - reach), min(roadmap.rows, row + reach + 1)):
            for c in range(
                max(0, column - reach), min(roadmap.columns, column + reach + 1)
            ):
                b = r * roadmap.columns + c
                for i in range(roadmap.bucket_start[b], roadmap.bucket_start[b + 1]):
                    v = roadmap.bucket_vertex[i]
                    if n < 256 and cost_to_go[v] < np.inf:
                        candidate[n] = v
                        cost[n] = cost_to_go[v] + hypot(
                            roadmap.vertex[v, 0] - x, roadmap.vertex[v, 1] - y
                        )
                        n += 1
        best = -1
        best_cost = np.inf
        for _ in range(min(n, 32)):
            i = np.argmin(cost[:n])
            if cost[i] >= best_cost:
                break
            v = candidate[i]
            vx, vy = roadmap.vertex[v, 0], roadmap.vertex[v, 1]
            if segment_is_clear(space, x, y, vx, vy, needed):
                exact = cost_to_go[v] + segment_weighted_length(terrain, x, y, vx, vy)
                if exact < best_cost:
                    best_cost = exact
                    best = v
            cost[i] = np.inf
        if best >= 0:
            break
    if best < 0:
        return np.inf
    v = best
    while successor[v] >= 0:
        after = successor[v]
        ax, ay = roadmap.vertex[after, 0], roadmap.vertex[after, 1]
        if hypot(ax - x, ay - y) > view or not segment_is_clear(
            space, x, y, ax, ay, needed
        ):
            break
        straight = segment_weighted_length(terrain, x, y, ax, ay) + cost_to_go[after]
        if straight > best_cost * (1.0 + 1e-9) + 0.02:
            break
        best_cost = min(best_cost, straight)
        v = after
    out[0], out[1] = roadmap.vertex[v, 0], roadmap.vertex[v, 1]
    return best_cost
