"""The motion tree's vertices and the groups they are chosen by."""

from __future__ import annotations

from math import floor
from typing import NamedTuple

import numpy as np

from mrmg.compilation import by_reference, kernel
from mrmg.planning.routing._random_kernels import random_below, random_unit

AGAIN = 0.005
"""Share of the first tours' energy that each expansion a vertex has had counts as."""

SPELL_S = 1.0
"""Length of the spells that tell groups apart in which a robot stays somewhere."""

NEAREST_SHARE = 0.7
"""How often the vertex nearest to its targets is taken from a group, not any."""


@by_reference
class Tree(NamedTuple):
    """The motion tree; N vertices at most, R robots.

    Attributes:
        state: composite states, shape (N, R, 5).
        energy: battery contents [J], shape (N, R).
        parent: shape (N,); -1 for the root.
        control: controls from the parent, shape (N, k, R, 2).
        steps: number of steps from the parent, shape (N,).
        visited: goals visited, shape (N, G).
        serving: target at which each robot stays, -1 for none, shape (N, R).
        spent: for how long it has stayed there [s], shape (N, R).
        tour: which row of the tour table a vertex follows, shape (N,).
        position: place in its tour each robot has reached, shape (N, R).
        gear: shape (N, R).
        stalled: how often in a row a robot has not got on, shape (N, R).
        expanded: how often a vertex has been expanded, shape (N,).
        remaining: energy estimate of the rest of the tours [J], shape (N,).
        group: shape (N,).
        sibling: next vertex of the same group, -1 at the end, shape (N,).
    """

    state: np.ndarray
    energy: np.ndarray
    parent: np.ndarray
    control: np.ndarray
    steps: np.ndarray
    visited: np.ndarray
    serving: np.ndarray
    spent: np.ndarray
    tour: np.ndarray
    position: np.ndarray
    gear: np.ndarray
    stalled: np.ndarray
    expanded: np.ndarray
    remaining: np.ndarray
    group: np.ndarray
    sibling: np.ndarray


class Groups(NamedTuple):
    """Vertex groups: same regions of the robots, same visited goals."""

    key: np.ndarray
    slot: np.ndarray
    first: np.ndarray
    size: np.ndarray
    visits: np.ndarray
    unvisited: np.ndarray
    remaining: np.ndarray


@kernel
def new_tree(n, robots, goals, steps):
    """Return an empty tree."""
    return Tree(
        np.empty((n, robots, 5)),
        np.empty((n, robots)),
        np.full(n, -1, np.int64),
        np.empty((n, steps, robots, 2)),
        np.zeros(n, np.int64),
        np.zeros((n, goals), np.bool_),
        np.full((n, robots), -1, np.int64),
        np.zeros((n, robots)),
        np.zeros(n, np.int64),
        np.zeros((n, robots), np.int64),
        np.ones((n, robots), np.int64),
        np.zeros((n, robots), np.int64),
        np.zeros(n, np.int64),
        np.zeros(n),
        np.zeros(n, np.int64),
        np.full(n, -1, np.int64),
    )


@kernel
def new_groups(n):
    """Return an empty set of groups over a hash table of 4 n slots."""
    return Groups(
        np.zeros(n, np.uint64),
        np.full(4 * n, -1, np.int64),
        np.full(n, -1, np.int64),
        np.zeros(n, np.int64),
        np.zeros(n, np.int64),
        np.zeros(n, np.int64),
        np.full(n, np.inf),
    )


@kernel
def group_key(state, visited, spent, region):
    """Return the hash of the robots' regions, the visited goals and what was stayed."""
    key = np.uint64(0xCBF29CE484222325)
    prime = np.uint64(0x100000001B3)
    for r in range(len(state)):
        key = (key ^ np.uint64(int(floor(state[r, 0] / region)) + 32768)) * prime
        key = (key ^ np.uint64(int(floor(state[r, 1] / region)) + 32768)) * prime
    for g in range(len(visited)):
        key = (key ^ np.uint64(1 + visited[g])) * prime
    for r in range(len(spent)):
        if spent[r] > 0.0:
            spell = np.uint64(int(spent[r] / SPELL_S) + 1)
            key = (key ^ (spell * np.uint64(r + 3))) * prime
    return key ^ (key >> np.uint64(29))


@kernel
def add_to_group(groups, tree, n_groups, v, region):
    """Put a vertex into its group, a new one if need be; return their number."""
    key = group_key(tree.state[v], tree.visited[v], tree.spent[v], region)
    place = np.int64(key % np.uint64(len(groups.slot)))
    while groups.slot[place] >= 0 and groups.key[groups.slot[place]] != key:
        place = (place + 1) % len(groups.slot)
    g = groups.slot[place]
    if g < 0:
        g = n_groups
        n_groups += 1
        groups.slot[place] = g
        groups.key[g] = key
        left = 0
        for i in range(tree.visited.shape[1]):
            left += not tree.visited[v, i]
        groups.unvisited[g] = left
    tree.group[v] = g
    tree.sibling[v] = groups.first[g]
    groups.first[g] = v
    groups.size[g] += 1
    groups.remaining[g] = min(groups.remaining[g], tree.remaining[v])
    return n_groups


@kernel
def group_weight(groups, g, params, initial):
    """Return w = lambda^visits (alpha / |unvisited| + beta dist).

    dist is the share of the first tours' energy that is already behind the
    group, so that groups nearer to the end weigh more.
    """
    progress = 1.0 - groups.remaining[g] / initial
    return params.group_lambda ** groups.visits[g] * (
        params.group_alpha / max(1, groups.unvisited[g]) + params.group_beta * progress
    )


@kernel
def select_vertex(groups, tree, n_groups, params, initial, random):
    """Choose a group by weight, then a vertex in it by distance to its target."""
    chosen = 0
    if random_unit(random) < params.group_bias:
        best = -np.inf
        for g in range(n_groups):
            weight = group_weight(groups, g, params, initial)
            if weight > best:
                best = weight
                chosen = g
    else:
        mass = 0.0
        for g in range(n_groups):
            mass += max(0.0, group_weight(groups, g, params, initial))
        draw = random_unit(random) * mass
        for g in range(n_groups):
            chosen = g
            draw -= max(0.0, group_weight(groups, g, params, initial))
            if draw < 0.0:
                break
    groups.visits[chosen] += 1
    v = groups.first[chosen]
    if random_unit(random) < NEAREST_SHARE:
        # The nearest to its targets; each expansion it has had counts as some way.
        best = np.inf
        nearest = v
        while v >= 0:
            rating = tree.remaining[v] + AGAIN * initial * tree.expanded[v]
            if rating < best:
                best = rating
                nearest = v
            v = tree.sibling[v]
        v = nearest
    else:
        for _ in range(random_below(random, groups.size[chosen])):
            v = tree.sibling[v]
    tree.expanded[v] += 1
    return v
