"""Tours of labelled routes: goals and stations in order."""

from __future__ import annotations

from mrmg.compilation import kernel
from mrmg.planning.routing._refuel_kernels import (
    FIRST,
    LAST,
    ORIGIN,
    PATH,
    place_at,
    row_of,
    slot_of,
)


@kernel
def write_tour(legs, labels, r, goal, length, label, tour):
    """Write goals and stations of a labelled route; return their number.

    Args:
        legs, labels, r, goal, length: the route.
        label: as `label_route` returned it.
        tour: receives targets in order; those that do not fit are only counted.
    """
    own, n = legs.table[r], 0
    for step in range(length + 1 if label >= 0 else 0, 0, -1):
        row = row_of(legs, r, goal, length, 0, step)
        path = int(labels.way[row, label, PATH])
        label = int(labels.way[row, label, ORIGIN])
        place = place_at(legs, r, goal, length, 0, step)
        if step <= length:
            n = append(tour, n, goal[step - 1])
        if path >= 0:
            last = place_at(legs, r, goal, length, 0, step - 1)
            slot = slot_of(legs, labels, own, last, place)
            hop = int(labels.path[slot, path, FIRST])
            end = int(labels.path[slot, path, LAST])
            low = n
            n = append(tour, n, legs.goals + hop)
            while hop != end:
                hop = int(legs.follower[own, hop, end])
                n = append(tour, n, legs.goals + hop)
            reverse(tour, low, n)
    low = 0
    reverse(tour, low, n)
    return n


@kernel
def append(tour, n, target):
    """Write a target behind n others if there is room; return n + 1."""
    if n < len(tour):
        tour[n] = target
    return n + 1


@kernel
def reverse(items, first, end):
    """Turn a piece of an array round, if it lies within it."""
    if end > len(items):
        return
    for k in range((end - first) // 2):
        low, high = first + k, end - 1 - k
        items[low], items[high] = items[high], items[low]
