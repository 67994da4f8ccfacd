"""A small random generator whose state is an array, so that kernels stay pure."""

from __future__ import annotations

import numpy as np

from mrmg.compilation import kernel


@kernel
def random_unit(state):
    """Return a number in [0, 1) by splitmix64; advances `state` (uint64, (1,))."""
    state[0] += np.uint64(0x9E3779B97F4A7C15)
    z = state[0]
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    z = z ^ (z >> np.uint64(31))
    return np.float64(z >> np.uint64(11)) * (1.0 / 9007199254740992.0)


@kernel
def random_below(state, n):
    """Return an integer in [0, n)."""
    return int(random_unit(state) * n)
