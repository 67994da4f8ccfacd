"""Letting an elastic band slip into the nearest minimum of its cost, by L-BFGS.

The order of targets, the gears and the way round obstacles stay as they are.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from mrmg.compilation import kernel
from mrmg.planning.path_following._band_kernels import band_cost
from mrmg.planning.path_following._bending_kernels import new_shape

MEMORY = 8
"""Pairs of steps and changes of the gradient that L-BFGS remembers."""

MOST_M = 0.5
"""Farthest that a node moves in one step [m]."""

LEAST_M = 1e-6
"""Shortest step that counts [m]."""

WINDOW = 10
"""Steps after which it is asked what they gained ..."""

LEAST_GAIN = 2e-5
"""... and the share of the cost that they must gain to be followed by more."""


@kernel
def dot(a, b):
    """Return the scalar product of two arrays of shape (n, 2)."""
    total = 0.0
    for i in range(len(a)):
        total += a[i, 0] * b[i, 0] + a[i, 1] * b[i, 1]
    return total


@kernel
def add_scaled(a, factor, b, out):
    """Write a + factor b, shapes (n, 2)."""
    for i in range(len(a)):
        out[i, 0] = a[i, 0] + factor * b[i, 0]
        out[i, 1] = a[i, 1] + factor * b[i, 1]


@kernel
def descent(gradient, steps, changes, scale, pairs, out):
    """Write the L-BFGS direction: minus the approximate Newton step (two loops)."""
    weight = np.zeros(MEMORY)
    add_scaled(gradient, -2.0, gradient, out)
    for back in range(min(pairs, MEMORY)):
        m = (pairs - 1 - back) % MEMORY
        weight[m] = scale[m] * dot(steps[m], out)
        add_scaled(out, -weight[m], changes[m], out)
    if pairs > 0:
        m = (pairs - 1) % MEMORY
        newest = 1.0 / (scale[m] * dot(changes[m], changes[m]))
        add_scaled(out, newest - 1.0, out, out)
    for back in range(min(pairs, MEMORY) - 1, -1, -1):
        m = (pairs - 1 - back) % MEMORY
        add_scaled(out, weight[m] - scale[m] * dot(changes[m], out), steps[m], out)


@kernel
def longest_row(a):
    """Return the length of the longest row, shape (n, 2)."""
    most = 0.0
    for i in range(len(a)):
        most = max(most, a[i, 0] * a[i, 0] + a[i, 1] * a[i, 1])
    return sqrt(most)


@kernel
def relax(cost_map, stops, p, gear, pivot, nose, rounds):
    """Let a path slip into the nearest minimum of its cost; return the cost.

    Args:
        cost_map, stops: what it is priced on and must pass.
        p: nodes, the first one fixed; changed in place, shape (n, 2).
        gear: of each segment, 1 or -1, shape (n - 1,).
        pivot: whether the robot turns on the spot before it, shape (n - 1,).
        nose: unit vectors of the robot's headings at the start and at the end; zero if
            it is free, shape (2, 2).
        rounds: steps of L-BFGS at most.
    """
    n = len(p)
    shape = new_shape(n)
    gradient = np.zeros((n, 2))
    trial = np.zeros((n, 2))
    trial_gradient = np.zeros((n, 2))
    direction = np.zeros((n, 2))
    steps = np.zeros((MEMORY, n, 2))
    changes = np.zeros((MEMORY, n, 2))
    scale = np.zeros(MEMORY)
    pairs = 0
    cost = band_cost(cost_map, stops, p, gear, pivot, nose, shape, gradient)
    before = cost
    for round in range(1, rounds + 1):
        descent(gradient, steps, changes, scale, pairs, direction)
        slope = dot(direction, gradient)
        if slope >= 0.0:
            add_scaled(gradient, -2.0, gradient, direction)
            slope = -dot(gradient, gradient)
            pairs = 0
        longest = longest_row(direction)
        if longest < LEAST_M:
            break
        length = min(1.0, MOST_M / longest)
        after = np.inf
        while after > cost + 1e-4 * length * slope and length * longest > LEAST_M:
            add_scaled(p, length, direction, trial)
            after = band_cost(
                cost_map, stops, trial, gear, pivot, nose, shape, trial_gradient
            )
            length *= 0.4
        if after >= cost:
            break
        m = pairs % MEMORY
        add_scaled(trial, -1.0, p, steps[m])
        add_scaled(trial_gradient, -1.0, gradient, changes[m])
        along = dot(steps[m], changes[m])
        pairs = pairs + 1 if along > 1e-12 else 0
        scale[m] = 1.0 / along if along > 1e-12 else 0.0
        add_scaled(trial, 0.0, trial, p)
        add_scaled(trial_gradient, 0.0, trial_gradient, gradient)
        cost = after
        if round % WINDOW == 0:
            if before - cost < LEAST_GAIN * cost:
                break
            before = cost
    return cost
