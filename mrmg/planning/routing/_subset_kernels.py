"""Sets of goals as bits of their numbers, shared out among robots."""

from __future__ import annotations

import numpy as np

from mrmg.compilation import kernel


@kernel
def join_robot(fleet, own, longest):
    """Return the least cost of each set of goals with one more robot, and its share.

    Args:
        fleet, own: of each set, for the robots so far and the one more, shape (2^G,).
        longest: whether the larger of both counts, not their sum.
    """
    joined = np.full(len(fleet), np.inf)
    share = np.zeros(len(fleet), np.int64)
    for goals in range(len(fleet)):
        part = goals
        while True:
            rest = fleet[goals ^ part]
            value = max(rest, own[part]) if longest else rest + own[part]
            if value < joined[goals]:
                joined[goals] = value
                share[goals] = part
            if part == 0:
                break
            part = (part - 1) & goals
    return joined, share
