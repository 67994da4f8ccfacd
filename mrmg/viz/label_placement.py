"""Point-feature label placement: each text gets the least costly of its candidates.

Every label has a finite set of candidate positions with a preference (Christensen,
Marks and Shieber 1995). Its cost there is the preference, plus a large constant and the
overlapped area for each overlap with an occupied shape or another label, plus small
terms for what is merely near or crosses a line. Labels are placed greedily, those with
the fewest free candidates first, and then moved one by one to their least costly
candidate until none improves. Pair costs are symmetric, so that the sum of all costs
falls with every move and the sweeps end: at the end no label overlaps anything while
one of its own candidates is free.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry import MultiPoint
from shapely.geometry.base import BaseGeometry

OVERLAP_COST = 100.0
"""Cost of any overlap; above the sum of all other costs a candidate can have."""

_NEAR_COST = 0.6
_LINE_COST_PER_EM = 0.4
_MOST_LINE_COST = 4.0
_GAP_EM = 0.2
"""What lies within this distance of a label is near it."""

_DIRECTIONS = 16
_RINGS_EM = (0.12, 0.5, 1.0)
"""Distances between a shape and the labels around it."""

_RING_COST, _DIRECTION_COST = 1.2, 1.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LabelBox:
    """A rectangle that is to be placed.

    Attributes:
        half_m: half its width and height, shape (2,).
        spots_m: candidates for its centre, shape (n, 2).
        cost: of each candidate, below `OVERLAP_COST`, shape (n,).
        owner: what it names; it may lie on shapes and lines of that owner.
        optional: whether it is left out where no candidate is free.
    """

    half_m: np.ndarray
    spots_m: np.ndarray
    cost: np.ndarray
    owner: str
    optional: bool = False


@dataclass(frozen=True, slots=True)
class Occupied:
    """A shape or line on the map.

    Attributes:
        shape: where it is [m].
        owner: what it belongs to; "" is nobody's.
        weight: what overlapping it costs, against other shapes.
    """

    shape: BaseGeometry
    owner: str
    weight: float = 1.0


def spots_around(
    shape: BaseGeometry, half_m: np.ndarray, em_m: float, preferred_rad: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return candidates for a box beside a shape: centres (n, 2) and their costs.

    A box touches a convex shape exactly when its centre is on the boundary of the
    Minkowski sum of both; the candidates lie on that boundary, and on others further
    out.

    Args:
        shape: what is labelled; its convex hull counts.
        half_m: half the width and height of the box.
        em_m: size of the letters.
        preferred_rad: direction of the candidate that costs least.
    """
    hull = shapely.get_coordinates(shape.convex_hull)
    middle = 0.5 * (hull.min(axis=0) + hull.max(axis=0))
    angle = 2.0 * np.pi * np.arange(_DIRECTIONS) / _DIRECTIONS
    direction = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    turned = np.abs((angle - preferred_rad + np.pi) % (2.0 * np.pi) - np.pi) / np.pi
    signs = np.array([[-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0], [1.0, 1.0]])
    spots, costs = [], []
    for ring, gap_em in enumerate(_RINGS_EM):
        corners = (hull[:, None] + signs * (half_m + gap_em * em_m)).reshape(-1, 2)
        touching = MultiPoint(corners).convex_hull
        beyond = middle + np.ptp(corners, axis=0).sum() * direction
        rays = shapely.linestrings([(middle, end) for end in beyond])
        reach_m = shapely.length(shapely.intersection(rays, touching))
        spots.append(middle + reach_m[:, None] * direction)
        costs.append(_DIRECTION_COST * turned + _RING_COST * ring)
    return np.concatenate(spots), np.concatenate(costs)


def place(
    labels: Sequence[LabelBox],
    shapes: Sequence[Occupied],
    lines: Sequence[Occupied],
    em_m: float,
) -> list[np.ndarray | None]:
    """Return the centre of each label, or None for optional ones without room.

    Args:
        labels: earlier optional labels are placed before later ones.
        shapes: must not be overlapped.
        lines: should not be crossed.
        em_m: size of the letters.
    """
    static = _static_costs(labels, shapes, lines, em_m)
    chosen = np.full((len(labels), 2), np.nan)
    needed = [at for at, label in enumerate(labels) if not label.optional]
    needed.sort(key=lambda at: int((static[at] < OVERLAP_COST).sum()))
    moved = True
    while moved:
        moved = False
        for at in needed:
            moved |= _improve(at, labels, static, chosen, em_m)
    for at, label in enumerate(labels):
        if label.optional:
            _improve(at, labels, static, chosen, em_m)
    return [None if np.isnan(spot[0]) else spot for spot in chosen]


def _improve(
    at: int,
    labels: Sequence[LabelBox],
    static: Sequence[np.ndarray],
    chosen: np.ndarray,
    em_m: float,
) -> bool:
    """Move a label to its least costly candidate; return whether that changed."""
    label = labels[at]
    cost = static[at] + _pair_costs(at, labels, chosen, em_m)
    if not len(cost) or (label.optional and cost.min() >= OVERLAP_COST):
        return False
    same = (label.spots_m == chosen[at]).all(axis=1)
    if same.any() and cost.min() > cost[same].min() - 1e-9:
        return False
    chosen[at] = label.spots_m[int(np.argmin(cost))]
    return True


def _pair_costs(
    at: int, labels: Sequence[LabelBox], chosen: np.ndarray, em_m: float
) -> np.ndarray:
    """Return the cost of each candidate against the other labels where they are."""
    label = labels[at]
    if not len(label.spots_m):
        return np.zeros(0)
    halves = np.array([other.half_m for other in labels])
    reach = halves + label.half_m + _GAP_EM * em_m
    low, high = label.spots_m.min(axis=0), label.spots_m.max(axis=0)
    close = ((chosen + reach > low) & (chosen - reach < high)).all(axis=1)
    close[at] = False
    apart = np.abs(label.spots_m[:, None] - chosen[close]) - halves[close]
    apart -= label.half_m
    across, along = apart[..., 0], apart[..., 1]
    overlaps = (across < 0.0) & (along < 0.0)
    near = ~overlaps & (np.maximum(across, along) < _GAP_EM * em_m)
    cost = np.where(overlaps, 1.0 + across * along / em_m**2, 0.0) * OVERLAP_COST
    return np.asarray((cost + _NEAR_COST * near).sum(axis=1))


def _static_costs(
    labels: Sequence[LabelBox],
    shapes: Sequence[Occupied],
    lines: Sequence[Occupied],
    em_m: float,
) -> list[np.ndarray]:
    """Return the costs of all candidates that no other label changes."""
    counts = [len(label.spots_m) for label in labels]
    if not sum(counts):
        return [np.zeros(0) for _ in labels]
    owner = np.repeat(np.array([label.owner for label in labels]), counts)
    low, high = (
        np.concatenate([label.spots_m + sign * label.half_m for label in labels])
        for sign in (-1.0, 1.0)
    )
    boxes = shapely.box(low[:, 0], low[:, 1], high[:, 0], high[:, 1])
    cost = np.concatenate([label.cost for label in labels]).astype(float)
    at, hit, weight = _foreign(boxes, shapes, owner, _GAP_EM * em_m)
    near = shapely.distance(boxes[at], hit) > 0.0
    np.add.at(cost, at[near], _NEAR_COST)
    at, hit, weight = at[~near], hit[~near], weight[~near]
    area = shapely.area(shapely.intersection(boxes[at], hit)) / em_m**2
    np.add.at(cost, at, OVERLAP_COST * (1.0 + area) * weight)
    at, hit, _ = _foreign(boxes, lines, owner, 0.0)
    length_em = shapely.length(shapely.intersection(boxes[at], hit)) / em_m
    np.add.at(cost, at, np.minimum(_LINE_COST_PER_EM * length_em, _MOST_LINE_COST))
    return np.split(cost, np.cumsum(counts)[:-1])


def _foreign(
    boxes: np.ndarray, things: Sequence[Occupied], owner: np.ndarray, within_m: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return every thing of others within a distance of a box.

    Returns:
        The box's index, the thing's shape and its weight, shape (n,) each.
    """
    shapes = np.array([thing.shape for thing in things], dtype=object)
    if not len(shapes):
        return np.zeros(0, dtype=int), shapes, np.zeros(0)
    at, hit = shapely.STRtree(shapes).query(boxes, "dwithin", within_m)
    whose = np.array([thing.owner for thing in things])[hit]
    foreign = (whose == "") | (owner[at] != whose)
    weight = np.array([thing.weight for thing in things])
    return at[foreign], shapes[hit[foreign]], weight[hit[foreign]]
