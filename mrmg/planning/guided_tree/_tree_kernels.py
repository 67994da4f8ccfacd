"""The motion tree: vertices, groups and tours, in arrays that are filled as it grows.

Arrays are as long as a tree can get. The system gives memory to the part that is used.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mrmg.compilation import kernel
from mrmg.motion._kernels import copy_numbers


class Vertices(NamedTuple):
    """Vertices of the motion tree; N at most, R robots.

    Attributes:
        state: composite states, shape (N, R, 5).
        energy: battery contents [J], shape (N, R).
        parent: shape (N,); -1 for the root.
        iteration: expansion that made the vertex, -1 for the root, shape (N,).
        depth: number of vertices between it and the root, itself included, shape (N,).
        tour: row of the tours that it carries, shape (N,).
        group: shape (N,).
        next: next vertex of the same group, -1 at the end, shape (N,).
        to_target_m: distance of the robots from what they are to drive at, shape (N,).
    """

    state: np.ndarray
    energy: np.ndarray
    parent: np.ndarray
    iteration: np.ndarray
    depth: np.ndarray
    tour: np.ndarray
    group: np.ndarray
    next: np.ndarray
    to_target_m: np.ndarray


class Groups(NamedTuple):
    """Vertices with the same region of every robot and the same visited goals.

    Attributes:
        region: shape (N, R).
        visited: which goals, shape (N, G).
        unvisited: number of goals that are not, shape (N,).
        dist: depth of the vertex that is nearest to the root, shape (N,).
        visits: number of expansions of its vertices, shape (N,).
        first: its newest vertex, shape (N,).
        slot: open-addressing table; number of the group + 1, 0 if free, shape (P,).
        total, heaviest: binary trees over the groups' weights, in which node i holds
            the sum and the largest of nodes 2 i and 2 i + 1; leaves from half of the
            length on.
        scale: largest `dist` that beta is scaled for, a power of two, shape (1,).
    """

    region: np.ndarray
    visited: np.ndarray
    unvisited: np.ndarray
    dist: np.ndarray
    visits: np.ndarray
    first: np.ndarray
    slot: np.ndarray
    total: np.ndarray
    heaviest: np.ndarray
    scale: np.ndarray


class Tours(NamedTuple):
    """Tours that vertices carry; a row for each call of CreateNewTour that found some.

    Attributes:
        move: robot and target of each move in order, robot -1 after the last, shape
            (N, L, 2).
        first: first target of each robot, -1 for none, shape (N, R).
        need: energy above the reserve that the robot needs on arrival at its first
            target to get to its next station or end [J], shape (N, R).
    """

    move: np.ndarray
    first: np.ndarray
    need: np.ndarray


class Trace(NamedTuple):
    """What happened in each iteration; I at most.

    Attributes:
        group, vertex: selected, shape (I,).
        group_draw: whether to take the heaviest, and which one else, shape (I, 2).
        vertex_draw: shape (I,).
        scale: of beta at the selection, shape (I,).
        target: what each robot drives at, NaN for none, shape (I, R, 2).
        steer_draw: compared with Decay, shape (I, R).
        control: held by each robot, shape (I, R, 2).
        ended: why the expansion ended, one of ENDS, shape (I,).
    """

    group: np.ndarray
    vertex: np.ndarray
    group_draw: np.ndarray
    vertex_draw: np.ndarray
    scale: np.ndarray
    target: np.ndarray
    steer_draw: np.ndarray
    control: np.ndarray
    ended: np.ndarray


class MotionTree(NamedTuple):
    """A motion tree and all that changes as it grows.

    Attributes:
        vertices, groups, tours: what it consists of.
        trace: what happened in each iteration.
        counts: shape (N_COUNTS,).
        random: state of the generator, shape (1,).
        stop: controls by which all robots brake at the end, shape (S, R, 2).
    """

    vertices: Vertices
    groups: Groups
    tours: Tours
    trace: Trace
    counts: np.ndarray
    random: np.ndarray
    stop: np.ndarray


ENDS = ("all k steps", "collision", "rejected by Insert", "solved")
"""How an expansion ends."""

HELD, COLLIDED, REJECTED, SOLVED = range(len(ENDS))

N_COUNTS = 6
(
    VERTICES,
    GROUPS,
    TOURS,
    ROUTER_CALLS,
    ITERATIONS,
    ROUTING_NS,
) = range(N_COUNTS)
"""Places in the array of counts; the last is the time that router calls took."""


BETA_SHARE = 0.01
"""Largest value of beta dist in eq. (5), as a share of alpha / m for m goals."""


@kernel
def group_weight(groups, g, rules):
    """Return a group's weight by eq. (5).

    w = lambda^VISITS (alpha / |unvisited goals| + beta dist(group)), with
    beta = BETA_SHARE alpha / (m scale) for m goals, so that beta dist is at most
    BETA_SHARE alpha / m. A group whose goals are all visited counts as if one were not.
    """
    goals = max(groups.visited.shape[1], 1)
    beta = BETA_SHARE * rules.alpha / (goals * groups.scale[0])
    return rules.decline ** groups.visits[g] * (
        rules.alpha / max(groups.unvisited[g], 1) + beta * groups.dist[g]
    )


@kernel
def weigh(groups, g, rules):
    """Bring the binary trees up to date with a group's weight."""
    i = len(groups.total) // 2 + g
    groups.total[i] = groups.heaviest[i] = group_weight(groups, g, rules)
    i //= 2
    while i > 0:
        groups.total[i] = groups.total[2 * i] + groups.total[2 * i + 1]
        groups.heaviest[i] = max(groups.heaviest[2 * i], groups.heaviest[2 * i + 1])
        i //= 2


@kernel
def find_group(tree, region, visited):
    """Return the group of regions and visited goals; a new one if there is none."""
    groups = tree.groups
    key = np.uint64(0xCBF29CE484222325)
    prime = np.uint64(0x100000001B3)
    for r in range(len(region)):
        key = (key ^ np.uint64(region[r])) * prime
    for goal in range(len(visited)):
        key = (key ^ np.uint64(1 + visited[goal])) * prime
    last = np.uint64(len(groups.slot) - 1)
    at = (key ^ (key >> np.uint64(29))) & last
    while groups.slot[at] > 0:
        g = groups.slot[at] - 1
        same = True
        for r in range(len(region)):
            same &= groups.region[g, r] == region[r]
        for goal in range(len(visited)):
            same &= groups.visited[g, goal] == visited[goal]
        if same:
            return g
        at = (at + np.uint64(1)) & last
    g = tree.counts[GROUPS]
    tree.counts[GROUPS] += 1
    groups.slot[at] = g + 1
    groups.visits[g] = 0
    groups.first[g] = -1
    groups.unvisited[g] = len(visited) - visited.sum()
    copy_numbers(region, groups.region[g])
    copy_numbers(visited, groups.visited[g])
    return g


@kernel
def add_to_group(tree, rules, g, n):
    """Add vertex n to group g."""
    vertices, groups = tree.vertices, tree.groups
    depth = vertices.depth[n]
    if groups.first[g] < 0 or depth < groups.dist[g]:
        groups.dist[g] = depth
    vertices.group[n] = g
    vertices.next[n] = groups.first[g]
    groups.first[g] = n
    if depth > groups.scale[0]:
        while depth > groups.scale[0]:
            groups.scale[0] *= 2
        for other in range(tree.counts[GROUPS]):
            weigh(groups, other, rules)
    else:
        weigh(groups, g, rules)
