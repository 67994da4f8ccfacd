"""Compiled bounds of what the rest of a mission costs, were batteries to last for ever.

Dynamic programming over the sets of goals visited (Held and Karp 1962).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mrmg.compilation import kernel


class Completions(NamedTuple):
    """What the rest of a mission costs at least, were batteries to last for ever.

    Robots that have ended may set out again in these bounds, so that one table is that
    of all robots.

    Attributes:
        from_station: least cost from station to goal over any stations, (R, S, G).
        to_finish: least cost from node to finish over any stations, (R, T + 1).
        after: with a robot at a goal and goals visited, shape (2^G, G).
        before: before another robot sets out, shape (2^G,).
    """

    from_station: np.ndarray
    to_finish: np.ndarray
    after: np.ndarray
    before: np.ndarray


@kernel
def completions(between, pair, from_start, to_end, from_station, to_finish):
    """Return the bounds of what visiting the rest of the goals costs.

    Args:
        between: least cost of any robot from goal to goal over any stations, (G, G).
        pair: of two such legs with the same arc in the middle, shape (G, G, G), or
            (0, 0, 0) to know of single legs alone.
        from_start: from any start to goal, shape (G,).
        to_end: from goal to any finish, shape (G,).
        from_station, to_finish: as in `Completions`.
    """
    n, by_pairs = len(between), len(pair) > 0
    after = np.full((1 << n, n), np.inf)
    before = np.zeros(1 << n)
    for mask in range((1 << n) - 1, -1, -1):
        if mask < len(before) - 1:
            before[mask] = np.inf
        for u in range(n):
            if not mask >> u & 1:
                on = from_start[u] + after[mask | 1 << u, u]
                before[mask] = min(before[mask], on)
        for g in range(n):
            if not mask >> g & 1:
                continue
            least = to_end[g] + before[mask]
            for u in range(n):
                if mask >> u & 1:
                    continue
                on = mask | 1 << u
                if not by_pairs:
                    least = min(least, between[g, u] + after[on, u])
                    continue
                least = min(least, between[g, u] + to_end[u] + before[on])
                for w in range(n):
                    if not on >> w & 1:
                        least = min(least, pair[g, u, w] + after[on | 1 << w, w])
            after[mask, g] = least
    return Completions(from_station, to_finish, after, before)
