"""SelectGroup, SelectVertex and SampleTarget (Algorithm 1, lines 5-8)."""

from __future__ import annotations

from math import cos, exp, pi, sin, sqrt

import numpy as np

from mrmg.compilation import kernel
from mrmg.planning.guided_tree._regions_kernels import point_on_path
from mrmg.planning.routing._random_kernels import random_unit


@kernel
def select_group(tree, rules, draw):
    """Return a group drawn by weight, or with probability `bias` the heaviest.

    Args:
        tree: `MotionTree`.
        rules: `Rules`.
        draw: receives both draws, shape (2,).
    """
    groups = tree.groups
    draw[0], draw[1] = random_unit(tree.random), random_unit(tree.random)
    leaves = len(groups.total) // 2
    left = draw[1] * groups.total[1]
    i = 1
    while i < leaves:
        i *= 2
        if draw[0] < rules.bias:
            i += groups.heaviest[i + 1] > groups.heaviest[i]
        elif left >= groups.total[i] and groups.total[i + 1] > 0.0:
            left -= groups.total[i]
            i += 1
    return i - leaves


@kernel
def select_vertex(tree, rules, g, draw):
    """Return a vertex of a group, drawn by its distance d to its target.

    The probability is in proportion to exp(-d / vertex_spread).

    Args:
        tree: `MotionTree`.
        rules: `Rules`.
        g: the group.
        draw: in [0, 1).
    """
    vertices, groups = tree.vertices, tree.groups
    nearest = np.inf
    v = groups.first[g]
    while v >= 0:
        nearest = min(nearest, vertices.to_target_m[v])
        v = vertices.next[v]
    mass = 0.0
    v = groups.first[g]
    while v >= 0:
        mass += exp((nearest - vertices.to_target_m[v]) / rules.vertex_spread_m)
        v = vertices.next[v]
    left = draw * mass
    v = groups.first[g]
    while True:
        left -= exp((nearest - vertices.to_target_m[v]) / rules.vertex_spread_m)
        if left < 0.0 or vertices.next[v] < 0:
            return v
        v = vertices.next[v]


@kernel
def sample_target(setting, rules, tree, v, target):
    """Write what each robot is to drive at: a point near its path along the roadmap.

    It lies a random way ahead of the robot's region on the path to the first target of
    its tour, moved by a random offset. A robot whose tour is over has none, NaN.

    Args:
        setting: the mission.
        rules: `Rules`.
        tree, v: the vertex.
        target: receives the points, shape (R, 2).
    """
    tours, groups, random = tree.tours, tree.groups, tree.random
    row, g = tree.vertices.tour[v], tree.vertices.group[v]
    for r in range(len(target)):
        t = tours.first[row, r]
        if t < 0:
            target[r, 0] = target[r, 1] = np.nan
            continue
        share = random_unit(random)
        ahead_m = share * rules.ahead_most_m + (1.0 - share) * rules.ahead_least_m
        region = groups.region[g, r]
        point_on_path(setting, r, t, region, ahead_m, target[r])
        offset = rules.target_spread_m * sqrt(random_unit(random))
        angle = 2.0 * pi * random_unit(random)
        target[r, 0] += offset * cos(angle)
        target[r, 1] += offset * sin(angle)
