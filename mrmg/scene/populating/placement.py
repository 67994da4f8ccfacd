"""Which places get robots, goals and stations, and the capacity that goes with them.

Stations are spread by k-medoids over the road distances, goals by farthest-point
sampling, and the robots start near each other at one end of the map. The capacity is
chosen between two bounds: large enough that every goal and station can be reached from
another station, and so small that no plan can do without recharging.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse.csgraph import minimum_spanning_tree

from mrmg.counted import counted
from mrmg.errors import UsageError

RESERVE = 0.05
"""Share of the capacity that populated scenes hold back."""

_SHORTCUTS = (0.82, 0.9)
"""A robot may find roads this much shorter, in gaps narrower than those counted on;
the first is safe on mazes, the second is tried where the first leaves no capacity."""

_ATTEMPTS = 40


@dataclass(frozen=True)
class Placement:
    """Indices of candidates, and the capacity that suits them [m of plain ground]."""

    robots: list[int]
    goals: list[int]
    stations: list[int]
    capacity_m: float


@dataclass(frozen=True, kw_only=True)
class Sites:
    """Places that may be chosen.

    Attributes:
        road_m: energy between all places [m of plain ground], shape (n, n).
        climb_m: what climbing adds to that at most, shape (n, n).
        points_m: where they are, shape (n, 2).
        start_gap_m: least distance of two robots at the start.
    """

    road_m: np.ndarray
    climb_m: np.ndarray
    points_m: np.ndarray
    start_gap_m: float


def place_mission(
    places: Sites, robots: int, goals: int, stations: int, rng: np.random.Generator
) -> Placement:
    """Return the first placement whose two bounds on the capacity leave room.

    If there is none, the first one of all: its capacity may do without recharging.

    Args:
        places: to choose from.
        robots: how many to place.
        goals: how many to place.
        stations: how many to place.
        rng: what the choice is drawn from.

    Raises:
        UsageError: if no placement is found.
    """
    road_m, uphill_m = places.road_m, places.road_m + places.climb_m
    easy: Placement | None = None
    for attempt in range(len(_SHORTCUTS) * _ATTEMPTS):
        shortcut = _SHORTCUTS[attempt // _ATTEMPTS]
        starts = _depot(places, robots, rng)
        if len(starts) < robots:
            continue
        free = np.setdiff1d(np.arange(len(road_m)), starts)
        posts = [
            int(free[i]) for i in _medoids(road_m[np.ix_(free, free)], stations, rng)
        ]
        rest = np.setdiff1d(free, posts)
        sites = _spread(road_m, rest, [*starts, *posts], goals)
        least = _least_capacity_m(uphill_m, starts, sites, posts)
        most = shortcut * _most_capacity_m(road_m, starts, sites)
        if math.ceil(least) <= most:
            # The largest capacity that still forces recharging is the fairest to drive.
            return Placement(starts, sites, posts, math.floor(most))
        easy = easy or Placement(starts, sites, posts, math.ceil(least))
    if easy is not None:
        return easy
    wanted = counted(robots, "robot")
    raise UsageError(f"found no place where {wanted} can start; ask for fewer robots")


def _depot(places: Sites, robots: int, rng: np.random.Generator) -> list[int]:
    """Return places near each other at one end of the map, one for each robot."""
    road_m, points_m = places.road_m, places.points_m
    eccentricity = road_m.max(axis=1)
    ends = np.flatnonzero(eccentricity >= np.quantile(eccentricity, 0.7))
    first = int(rng.choice(ends))
    starts: list[int] = []
    for index in np.argsort(road_m[first], kind="stable"):
        gap = points_m[starts] - points_m[index]
        if len(starts) < robots and (np.hypot(*gap.T) >= places.start_gap_m).all():
            starts.append(int(index))
    return starts


def _medoids(road_m: np.ndarray, count: int, rng: np.random.Generator) -> list[int]:
    """Return `count` places that serve all others well (k-medoids)."""
    medoids = [int(rng.integers(len(road_m)))]
    while len(medoids) < count:
        medoids.append(int(road_m[medoids].min(axis=0).argmax()))
    for _ in range(20):
        owner = road_m[medoids].argmin(axis=0)
        moved = [
            # The centre of a cluster: least worst distance to its members.
            int(members[road_m[np.ix_(members, members)].max(axis=1).argmin()])
            for members in (np.flatnonzero(owner == k) for k in range(count))
        ]
        if moved == medoids:
            break
        medoids = moved
    return medoids


def _spread(
    road_m: np.ndarray, allowed: np.ndarray, taken: Sequence[int], count: int
) -> list[int]:
    """Return `count` of the allowed places, far from the taken ones and each other."""
    sites: list[int] = []
    near = np.full(len(road_m), -np.inf)
    near[allowed] = road_m[list(taken)][:, allowed].min(axis=0)
    for _ in range(count):
        best = int(near.argmax())
        sites.append(best)
        near = np.minimum(near, road_m[best])
        near[best] = -np.inf
    return sites


def _least_capacity_m(
    road_m: np.ndarray, starts: list[int], sites: list[int], posts: list[int]
) -> float:
    """Return a capacity with which every goal can be served, with room to spare."""
    to_post = road_m[np.ix_(sites, posts)].min(axis=1).max()
    from_start = road_m[np.ix_(starts, posts)].min(axis=1).max()
    return float(
        max(to_post / 0.42, from_start / 0.65, _widest_gap(road_m, posts) / 0.7)
    )


def _widest_gap(road_m: np.ndarray, posts: list[int]) -> float:
    """Return the longest leg one must drive to get from any station to any other."""
    between = road_m[np.ix_(posts, posts)]
    return float(minimum_spanning_tree(between).data.max(initial=0.0))


def _most_capacity_m(road_m: np.ndarray, starts: list[int], sites: list[int]) -> float:
    """Return a capacity with which no plan does without recharging.

    Either some goal is out of reach of every robot, or all batteries together fall
    short of the spanning forest of the goals, rooted at the robots.
    """
    reach = road_m[np.ix_(starts, sites)].min(axis=0)
    from_root = np.append(0.0, reach)  # all robots as one
    rooted = np.vstack([reach, road_m[np.ix_(sites, sites)]])
    forest_m = float(minimum_spanning_tree(np.column_stack([from_root, rooted])).sum())
    need_m = max(float(reach.max()), forest_m / len(starts))
    return need_m / (1.0 - RESERVE)
