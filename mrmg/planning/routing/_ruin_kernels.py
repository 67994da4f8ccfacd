"""Which goals are taken out of routes together, and in what order they are put back."""

from __future__ import annotations

import numpy as np

from mrmg.compilation import kernel
from mrmg.planning.routing._random_kernels import random_below, random_unit

MOST_RUINED = 10
"""Mean number of goals taken out at a time, and longest string of them."""

WHOLE = 0.5
"""How often routes are exchanged as a whole when their ends could be."""

STRINGS = 0.6
"""How often strings of routes are taken out instead of a seed's nearest goals."""


@kernel
def choose_ruin(routes, near, random, home, gone):
    """Flag goals to be taken out: strings of routes near a seed, or its neighbours.

    Args:
        routes: the present routes.
        near: cost from goal to goal and back, shape (G, G).
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
    longest = min(MOST_RUINED, max(1, placed // used))
    by_string = random_unit(random) < STRINGS
    most = min(MOST_RUINED, placed)
    if by_string:
        most = 4 * MOST_RUINED // (1 + longest)
    for _ in range(1 + random_below(random, most)):
        goal = -1
        for g in range(len(home)):
            if home[g] >= 0 and (goal < 0 or near[seed, g] < near[seed, goal]):
                goal = g
        if goal < 0:
            break
        r = home[goal]
        home[goal] = -1
        gone[goal] = 1
        if by_string:
            cut_string(routes, r, goal, longest, random, gone)
            for i in range(routes.length[r]):
                home[routes.goal[r, i]] = -1


@kernel
def cut_string(routes, r, goal, longest, random, gone):
    """Flag a string of a route that holds a goal, or two with a piece kept between."""
    n = routes.length[r]
    index = 0
    while routes.goal[r, index] != goal:
        index += 1
    size = 1 + random_below(random, min(longest, n))
    kept = 0
    if size > 1 and random_unit(random) < 0.5:
        while size + kept < n and random_unit(random) > 0.1:
            kept += 1
    low = max(0, index - size - kept + 1)
    high = min(index, n - size - kept)
    first = low + random_below(random, high - low + 1)
    skip = 1 + random_below(random, size - 1)
    for i in range(size + kept):
        if i < skip or i >= skip + kept:
            gone[routes.goal[r, first + i]] = 1


@kernel
def swap_tails(routes, random):
    """Exchange the ends of two routes from drawn places on, or all of both."""
    robots = len(routes.length) - 1
    a = random_below(random, robots)
    b = (a + 1 + random_below(random, robots - 1)) % robots
    cut_a = random_below(random, routes.length[a] + 1)
    cut_b = random_below(random, routes.length[b] + 1)
    if random_unit(random) < WHOLE:
        cut_a = cut_b = 0
    tail_a, tail_b = routes.length[a] - cut_a, routes.length[b] - cut_b
    for k in range(max(tail_a, tail_b)):
        i, j = cut_a + k, cut_b + k
        routes.goal[a, i], routes.goal[b, j] = routes.goal[b, j], routes.goal[a, i]
    routes.length[a], routes.length[b] = cut_a + tail_b, cut_b + tail_a
    routes.front[a], routes.front[b] = cut_a + 1, cut_b + 1
    routes.back[a] = routes.back[b] = 1


@kernel
def order_absent(legs, routes, random, key):
    """Put the absent goals into a drawn order, or the farthest or nearest first."""
    robots = len(routes.length) - 1
    draw = random_unit(random)
    for k in range(routes.length[robots]):
        goal = routes.goal[robots, k]
        rank = random_unit(random)
        if draw > 0.6:
            rank = np.inf
            for r in range(robots):
                rank = min(rank, legs.cost[legs.table[r], legs.home[r], goal])
            rank = -rank if draw < 0.85 else rank
        i = k
        while i > 0 and key[i - 1] > rank:
            key[i] = key[i - 1]
            routes.goal[robots, i] = routes.goal[robots, i - 1]
            i -= 1
        key[i] = rank
        routes.goal[robots, i] = goal
