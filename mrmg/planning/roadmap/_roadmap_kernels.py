"""Compiled parts of the roadmap: edges with energy."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mrmg.compilation import kernel
from mrmg.planning.roadmap._bucket_kernels import Buckets
from mrmg.world._kernels import segment_clearance, segment_cost


class RoadmapArrays(NamedTuple):
    """The roadmap as the kernels see it; V vertices, T targets, F travel classes.

    Attributes:
        vertex: positions [m], shape (V, 2); the first T are the targets' centres.
        cost_to_go: cost to each target [m of plain ground], shape (F, T, V); inf where
            cut off.
        successor: next vertex on the way to each target, -1 at the end, shape (F, T,
            V).
        slope_refund: `slopes.SlopeCost.refund` of each class, shape (F,).
        buckets: of the vertices.
    """

    vertex: np.ndarray
    cost_to_go: np.ndarray
    successor: np.ndarray
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
