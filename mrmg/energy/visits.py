"""What counts as a visit, and what it does to the battery: one rule for everybody.

A robot is at a goal or station while its reference point lies in the region and its yaw
is within the tolerance of the goal's heading, if it has one. A visit is
the first stay, after the visit before it is over, that lasts the target's dwell time
without a break; it begins with the stay and is over when that time is. A station fills
the battery at once as the visit begins, or with its charging power for as long as the
robot is at the station, up to the beginning of its next visit. A station for one robot
at a time holds one reference point at any time.

Planner, verifier, supervision and audit all judge by these functions.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from mrmg.plans import Visit
from mrmg.scene.types import Finish, Goal, Scene, Station

ROUNDING_S = 1e-6
"""Rounding of times that is forgiven in how long a robot stays."""


@dataclass(frozen=True, slots=True)
class Stay:
    """A stay that is long enough for a visit.

    Attributes:
        first: index of its first state.
        over: index of the first state at which the dwell time is over.
    """

    first: int
    over: int


def is_at(
    target: Goal | Station | Finish, poses: np.ndarray, depth_m: float = 0.0
) -> np.ndarray:
    """Return whether a robot is at a target, shape (n,).

    Args:
        target: a goal, station or finish.
        poses: of its reference point, x, y [m], yaw [rad] and what else there is,
            shape (n, 3 or more).
        depth_m: how deep in the region it must be.
    """
    at = np.asarray(target.region.depth(poses[:, :2]) >= depth_m)
    if isinstance(target, Station) or target.heading_rad is None:
        return at
    off_rad = (poses[:, 2] - target.heading_rad + np.pi) % (2.0 * np.pi) - np.pi
    return at & (np.abs(off_rad) <= target.heading_tolerance_rad)


def visit_of(
    robot: str, target: Goal | Station, time_s: np.ndarray, step: int
) -> Visit:
    """Return a robot's visit from a step on, with its battery's content left at 0."""
    return Visit(robot, target.id, target.kind, step, float(time_s[step]), 0.0)


def first_stay(
    target: Goal | Station, time_s: np.ndarray, poses: np.ndarray, start: int
) -> Stay | None:
    """Return the first stay from state `start` on that is a visit, None without one.

    Args:
        target: where to stay.
        time_s: of the states, shape (n,).
        poses: as `is_at` takes them.
        start: index of the first state that counts.
    """
    for first, end in runs(is_at(target, poses[start:])):
        spent_s = time_s[start + first : start + end] - time_s[start + first]
        long_enough = spent_s >= target.dwell_s - ROUNDING_S
        if long_enough.any():
            return Stay(start + first, start + first + int(long_enough.argmax()))
    return None


def runs(flags: np.ndarray) -> list[tuple[int, int]]:
    """Return (start, end) of each run of true flags, the end excluded."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], flags.astype(int), [0]])))
    return [(int(start), int(end)) for start, end in edges.reshape(-1, 2)]


@dataclass(frozen=True, slots=True)
class Crowding:
    """Two robots at a station for one at a time.

    Attributes:
        station: its id.
        robots: their ids.
        first, end: states at which both are there, the end excluded.
    """

    station: str
    robots: tuple[str, str]
    first: int
    end: int


def crowded_stations(
    scene: Scene, points: Mapping[str, np.ndarray]
) -> Iterator[Crowding]:
    """Yield where two robots are at a station for one at a time.

    Args:
        scene: gives the stations.
        points: positions of the reference points [m] by robot, at the same times,
            shape (n, 2) each.
    """
    for station in scene.stations:
        if not station.one_at_a_time:
            continue
        there = {name: station.region.depth(way) >= 0.0 for name, way in points.items()}
        for one, other in combinations(there, 2):
            for first, end in runs(there[one] & there[other]):
                yield Crowding(station.id, (one, other), first, end)
