"""Sets of goals as bits of their numbers, shared out among robots."""

from __future__ import annotations

import numpy as np

from mrmg.compilation import kernel


@kernel
def least_division(own, longest):
    """Return the least cost of all goals if robots divide them among each other.

    Args:
        own: of each set of goals, for each robot alone, shape (R, 2^G).
        longest: whether the largest of the robots' costs counts, not their sum.
    """
    fleet = np.full(own.shape[1], np.inf)
    fleet[0] = 0.0
    for r in range(len(own)):
        joined = np.full(len(fleet), np.inf)
        for goals in range(len(fleet)):
            part = goals
            while True:
                rest = fleet[goals ^ part]
                value = max(rest, own[r, part]) if longest else rest + own[r, part]
                joined[goals] = min(joined[goals], value)
                if part == 0:
                    break
                part = (part - 1) & goals
        fleet = joined
    return fleet[-1]
