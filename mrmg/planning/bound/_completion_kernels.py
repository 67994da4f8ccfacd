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
    rest = np.empty(n, np.int64)
    single, ahead = np.empty(n), np.full((n, n), np.inf)
    for mask in range((1 << n) - 1, -1, -1):
        left = 0
        for u in range(n):
            if not mask >> u & 1:
                rest[left] = u
                left += 1
        before[mask] = np.inf if left else 0.0
        for i in range(left):
            u = rest[i]
            on = mask | 1 << u
            single[i] = after[on, u]
            before[mask] = min(before[mask], from_start[u] + after[on, u])
            if by_pairs:
                single[i] = to_end[u] + before[on]
                for j in range(left):
                    w = rest[j]
                    ahead[i, j] = after[on | 1 << w, w] if i != j else np.inf
        for g in range(n):
            if not mask >> g & 1:
                continue
            least = to_end[g] + before[mask]
            for i in range(left):
                u = rest[i]
                least = min(least, between[g, u] + single[i])
                for j in range(left if by_pairs else 0):
                    least = min(least, pair[g, u, rest[j]] + ahead[i, j])
            after[mask, g] = least
    return Completions(from_station, to_finish, after, before)
