"""How cars come to targets that want a heading: in which gear, and from which side."""

from __future__ import annotations

from dataclasses import replace
from math import cos, radians, sin

import numpy as np

from mrmg.planning.path_following._band_kernels import CostMap
from mrmg.planning.path_following.band import Path
from mrmg.planning.path_following.gears import other_gear_from, smoothed_cost_m
from mrmg.planning.problem.problem import Problem

LAST_STOPS = 3
"""Stops before such a target at which a car may change gear to get there, ..."""

PASSED_M = 4.0
"""... how far beyond the target it may do so instead, to begin with, ..."""

BEARINGS = (0.0, radians(45.0), radians(-45.0))
"""... and how far off the line of the heading."""


def with_arrivals(problem: Problem, r: int, cost_map: CostMap, path: Path) -> Path:
    """Return the path on which car r has the headings that its targets want.

    Before each of them it keeps its gear, changes it at one of the last stops, or
    passes by and changes it there, whichever looks cheapest.

    Args:
        problem: the mission.
        r: robot, a car.
        cost_map: what the path is priced on.
        path: the path.
    """
    for i in np.flatnonzero(np.isfinite(path.aim) & (path.stop > 0)).tolist():
        earlier = {0, *path.stop[:i].tolist()} - {int(path.stop[i])}
        places = sorted(earlier)[-LAST_STOPS - 1 :]
        before = _part(path, 0, int(path.stop[i]))
        ways = [before, *(other_gear_from(before, at) for at in places[1:])]
        ways += [_passed_by(before, bearing) for bearing in BEARINGS]
        ends = [_part(way, places[0], len(way.gear)) for way in ways]
        costs_m = [smoothed_cost_m(problem, r, cost_map, end) for end in ends]
        path = _joined(ways[int(np.argmin(costs_m))], before, path)
    return path


def _passed_by(path: Path, bearing: float) -> Path:
    """Return the path that passes its end by, changes gear, and drives to it."""
    end, gear = path.node[-1], int(path.gear[-1])
    angle = path.last_aim + bearing
    place = end + gear * PASSED_M * np.array([cos(angle), sin(angle)])
    far = np.hypot(*(path.node - end).T) > PASSED_M
    begun = path.stop[path.stop < len(path.gear)].max(initial=0)
    kept = max(begun, np.flatnonzero(far).max(initial=0)) + 1
    return replace(
        path,
        node=np.vstack([path.node[:kept], place, end]),
        gear=np.append(path.gear[: kept - 1], [gear, -gear]),
        stop=np.where(path.stop < len(path.gear), path.stop, kept + 1),
    )


def _part(path: Path, first: int, last: int) -> Path:
    """Return a path from one node to another; a stop at its beginning is none."""
    within = (path.stop > first) & (path.stop <= last)
    ahead = path.gear[first] * (path.node[first + 1] - path.node[first])
    return replace(
        path,
        node=path.node[first : last + 1],
        gear=path.gear[first:last],
        stop=path.stop[within] - first,
        target=path.target[within],
        deeper=path.deeper[within],
        pause_s=path.pause_s[within],
        aim=path.aim[within],
        heading=path.heading if first == 0 else float(np.arctan2(*ahead[::-1])),
    )


def _joined(new: Path, old: Path, path: Path) -> Path:
    """Return a path with another beginning, and the rest in the gear it leads to."""
    old_size, more = len(old.gear), len(new.gear) - len(old.gear)
    sign = new.gear[-1] * old.gear[-1]
    begun = path.stop <= old_size
    stop = path.stop + more
    stop[begun & (path.stop > 0)] = new.stop
    stop[path.stop == 0] = 0
    return replace(
        path,
        node=np.vstack([new.node, path.node[old_size + 1 :]]),
        gear=np.append(new.gear, sign * path.gear[old_size:]),
        stop=stop,
    )
