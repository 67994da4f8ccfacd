"""Compiled part of visibility graphs: costs of straight pieces and of whole paths."""

from __future__ import annotations

from math import cos, hypot, pi
from typing import NamedTuple

import numpy as np

from mrmg.compilation import kernel
from mrmg.world._polygon_kernels import corners_from_sides

SAMPLING = 0.7
"""Distance of the points at which prices along a piece are read, over a cell's side,
where prices change."""


class Places(NamedTuple):
    """Where straight pieces of paths end.

    Attributes:
        end: both ends of a line on which the piece's end lies [m], shape (n, 2, 2).
        sagitta: how far it may be off that line, as arcs are off their chords [m],
            shape (n,).
        slack: half the length of the piece of a border that the place stands for, as
            its middle [m], shape (n,); 0 for others.
        border: number of that border, -1 of others, shape (n,).
        along: how far along it the place is [m], shape (n,).
        turned: by how much it has turned until there, and from there on [rad], which
            differ at a corner, shape (n, 2).
    """

    end: np.ndarray
    sagitta: np.ndarray
    slack: np.ndarray
    border: np.ndarray
    along: np.ndarray
    turned: np.ndarray


class Cells(NamedTuple):
    """Prices on square cells.

    Attributes:
        price: least within reach of each cell, shape (Y, X).
        even: how many cells about each, to all sides, have its price, shape (Y, X).
        x_min, y_min: corner of the first cell [m].
        side: of a cell [m].
    """

    price: np.ndarray
    even: np.ndarray
    x_min: float
    y_min: float
    side: float


@kernel
def straight_costs(cells, first, second):
    """Return the least cost of straight pieces between places, shape (n, m).

    A piece lies in ground of one price. No price read here is above the true one, so
    none along the piece is above that of its ground: the highest read is a bound.

    A piece of a border stands for the point at which a path crosses it. In the shortest
    path the derivatives by that point cancel out over what comes before and after it.
    What is left of the error is at most s^2 / 2 times the curvature of the distance,
    1 / r at a distance of r or more, and at most 2 s, with s the slack of both ends.

    Between places on one border the distance is at least l cos(a / 2), with l the way
    along the border and a the angle that all its directions lie in. That is linear in
    both places, so that nothing is left of the error.

    Args:
        cells: prices.
        first, second: the places.
    """
    cost = np.full((len(first.slack), len(second.slack)), np.inf)
    for i in range(cost.shape[0]):
        for j in range(cost.shape[1]):
            cost[i, j] = _straight(cells, first, i, second, j)
    return cost


@kernel
def costs_between(cells, places):
    """Return the least costs of straight pieces from place to place, shape (n, n)."""
    cost = np.full((len(places.slack), len(places.slack)), np.inf)
    for i in range(len(cost)):
        for j in range(i):
            cost[i, j] = cost[j, i] = _straight(cells, places, i, places, j)
    return cost


@kernel
def _straight(cells, first, i, second, j):
    """Return the least cost of a straight piece between two places."""
    ax = 0.5 * (first.end[i, 0, 0] + first.end[i, 1, 0])
    ay = 0.5 * (first.end[i, 0, 1] + first.end[i, 1, 1])
    bx = 0.5 * (second.end[j, 0, 0] + second.end[j, 1, 0])
    by = 0.5 * (second.end[j, 0, 1] + second.end[j, 1, 1])
    highest = _highest(cells, ax, ay, bx, by)
    if highest == np.inf:
        return np.inf
    a, b = first.end[i], second.end[j]
    length = min(corners_from_sides(a, b), corners_from_sides(b, a))
    length -= first.sagitta[i] + second.sagitta[j]
    slack = first.slack[i] + second.slack[j]
    if slack > 0.0:
        least = max(length - slack, 0.125 * slack)
        length -= min(2.0 * slack, 0.5 * slack * slack / least)
    if 0 <= first.border[i] == second.border[j]:
        length = max(length, _along_border(first, i, second, j))
    return highest * max(0.0, length)


@kernel
def _along_border(first, i, second, j):
    """Return a bound of the distance of two places on one border."""
    length = second.along[j] - first.along[i]
    angle = second.turned[j, 0] - first.turned[i, 1]
    if length < 0.0:
        length = -length
        angle = first.turned[i, 0] - second.turned[j, 1]
    return length * cos(0.5 * max(0.0, angle)) if angle < pi else 0.0


@kernel
def _highest(cells, ax, ay, bx, by):
    """Return the highest price met at points between two; inf where it is blocked."""
    rows, columns = cells.price.shape
    size = hypot(bx - ax, by - ay) / cells.side
    x, y = (ax - cells.x_min) / cells.side, (ay - cells.y_min) / cells.side
    step_x, step_y = 0.0, 0.0
    if size > 0.0:
        step_x = (bx - ax) / cells.side / size
        step_y = (by - ay) / cells.side / size
    at, highest = 0.0, 0.0
    while at <= size and highest < np.inf:
        row = min(max(int(y + at * step_y), 0), rows - 1)
        column = min(max(int(x + at * step_x), 0), columns - 1)
        highest = max(highest, cells.price[row, column])
        at += max(SAMPLING, cells.even[row, column])
    return highest


@kernel
def least_costs(between, first, last, direct):
    """Return the costs of the shortest paths from k sources to m sinks, shape (k, m).

    Dijkstra's algorithm from each source; a row of all costs is read for each node.

    Args:
        between: cost from node to node, shape (n, n).
        first: from sources to nodes, shape (k, n).
        last: from nodes to sinks, shape (n, m).
        direct: from sources to sinks, shape (k, m).
    """
    found = direct.copy()
    for source in range(len(first)):
        cost = first[source].copy()
        open_ = np.ones(len(cost), np.bool_)
        while True:
            node, least = -1, np.inf
            for v in range(len(cost)):
                if open_[v] and cost[v] < least:
                    node, least = v, cost[v]
            if node < 0 or least >= found[source].max():
                break
            open_[node] = False
            for v in range(len(cost)):
                cost[v] = min(cost[v], least + between[node, v])
            for sink in range(found.shape[1]):
                whole = least + last[node, sink]
                found[source, sink] = min(found[source, sink], whole)
    return found
