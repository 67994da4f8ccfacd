"""Which goals are taken out of routes together, and in what order they are put back."""

from __future__ import annotations

import numpy as np

from mrmg.compilation import kernel
from mrmg.motion._kernels import copy_numbers
from mrmg.planning.routing._random_kernels import random_below, random_unit

RUINED, RUINED_OF_MANY = 10, 20
"""Most goals taken out at a time, as neighbours or as a string, for few and many: not
more than a fifth of them, unless they are few."""

STRINGS = 0.7
"""How often strings of routes are taken out instead of a seed's nearest goals."""

MOST_TAILS = 10
"""Goals next to a goal, itself among them, that may follow it as ends are exchanged."""


@kernel
def choose_ruin(routes, neighbour, random, home, gone):
    """Flag goals to be taken out: strings of routes near a seed, or its neighbours.

    Args:
        routes: the present routes.
        neighbour: goals next to each goal, itself first, nearest first.
        random: state of the generator.
        home: room for each goal's robot, shape (G,).
        gone: receives the flags, shape (G,).
    """
    robots = len(routes.length) - 1
    placed = used = 0
    home[:] = -1
    gone[:] = 0
    for r in range(robots):
        used += routes.length[r] > 0
        placed += routes.length[r]
        for i in range(routes.length[r]):
            home[routes.goal[r, i]] = r
    if placed == 0:
        return
    choice = random_below(random, placed + routes.length[robots])
    r = 0
    while choice >= routes.length[r]:
        choice -= routes.length[r]
        r += 1
    seed = routes.goal[r, choice]
    ruined = max(RUINED, min(RUINED_OF_MANY, placed // 5))
    longest = min(ruined, max(1, placed // used))
    by_string = random_unit(random) < STRINGS
    most = 4 * ruined // (1 + longest) if by_string else min(ruined, placed)
    left = 1 + random_below(random, most)
    for goal in neighbour[seed]:
        r = home[goal]
        if r < 0:
            continue
        if left == 0:
            break
        left -= 1
        gone[goal] = 1
        if by_string:
            cut_string(routes, r, goal, longest, random, gone)
            for i in range(routes.length[r]):
                home[routes.goal[r, i]] = -1


@kernel
def cut_string(routes, r, goal, longest, random, gone):
    """Flag a string of a route that holds a goal."""
    n = routes.length[r]
    index = 0
    while routes.goal[r, index] != goal:
        index += 1
    size = 1 + random_below(random, min(longest, n))
    low = max(0, index - size + 1)
    high = min(index, n - size)
    first = low + random_below(random, high - low + 1)
    for i in range(first, first + size):
        gone[routes.goal[r, i]] = 1


@kernel
def swap_tails(routes, neighbour, random):
    """Exchange the ends of two routes, so that goals next to each other follow.

    Where both are of one route, the goals between them are turned round instead, these
    two as well if the second one comes first.
    """
    robots = len(routes.length) - 1
    goal = random_below(random, len(neighbour))
    near = min(MOST_TAILS, neighbour.shape[1])
    other = neighbour[goal, random_below(random, near)]
    a, i = where(routes, goal)
    b, j = where(routes, other)
    if max(a, b) == robots or goal == other:
        return
    if a != b:
        exchange(routes, a, i + 1, b, j)
        return
    low, high = min(i + 1, j), max(i, j - 1)
    routes.front[a] = low + 1
    routes.back[a] = routes.length[a] - high
    while low < high:
        first, last = routes.goal[a, low], routes.goal[a, high]
        routes.goal[a, low], routes.goal[a, high] = last, first
        low, high = low + 1, high - 1


@kernel
def where(routes, goal):
    """Return the robot that visits a goal, and its place in the route."""
    for r in range(len(routes.length)):
        for i in range(routes.length[r]):
            if routes.goal[r, i] == goal:
                return r, i
    return len(routes.length) - 1, 0


@kernel
def exchange(routes, a, cut_a, b, cut_b):
    """Exchange the ends of two routes from some places on."""
    tail_a, tail_b = routes.length[a] - cut_a, routes.length[b] - cut_b
    for k in range(max(tail_a, tail_b)):
        i, j = cut_a + k, cut_b + k
        routes.goal[a, i], routes.goal[b, j] = routes.goal[b, j], routes.goal[a, i]
    routes.length[a], routes.length[b] = cut_a + tail_b, cut_b + tail_a
    routes.front[a], routes.front[b] = cut_a + 1, cut_b + 1
    routes.back[a] = routes.back[b] = 1


@kernel
def order_absent(legs, routes, random):
    """Put the absent goals into a drawn order, or the farthest or nearest first."""
    robots = len(routes.length) - 1
    absent = routes.goal[robots, : routes.length[robots]]
    rank = np.empty(len(absent))
    draw = random_unit(random)
    for k in range(len(absent)):
        rank[k] = random_unit(random)
        if draw > 0.6:
            remote = legs.remote[absent[k]]
            rank[k] = -remote if draw < 0.85 else remote
    copy_numbers(absent[np.argsort(rank, kind="mergesort")], absent)
