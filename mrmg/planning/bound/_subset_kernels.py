"""Sets of goals as bits of their numbers, shared out among robots."""

from __future__ import annotations

import numpy as np

from mrmg.compilation import kernel


@kernel
def join_robot(fleet, own, longest):
    """Return the least cost of each set of goals with one more robot.

    Args:
        fleet, own: of each set, for the robots so far and the one more, shape (2^G,).
        longest: whether the larger of both counts, not their sum.
    """
    joined = np.full(len(fleet), np.inf)
    for goals in range(len(fleet)):
        part = goals
        while True:
            rest = fleet[goals ^ part]
            value = max(rest, own[part]) if longest else rest + own[part]
            joined[goals] = min(joined[goals], value)
            if part == 0:
                break
            part = (part - 1) & goals
    return joined
