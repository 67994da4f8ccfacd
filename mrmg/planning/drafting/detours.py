"""Leading robots round each other: detours from paths that meet."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from mrmg.planning.drafting._band_kernels import Surface
from mrmg.planning.drafting.band import SPACINGS_M, SPARE_M, Path, tightened
from mrmg.planning.drafting.errand import Errand, lack_m
from mrmg.planning.drafting.lanes import (
    WINDOW_M,
    Lane,
    apart_m,
    disc_radius_m,
    driven_m,
    lane_of,
    spacing_m,
)
from mrmg.planning.drafting.tracking import Drive
from mrmg.planning.problem.problem import Problem

LACK_M = 0.25
"""Clearance that a detour may lack: discs cover more than footprints ..."""

LACK_WORTH = 30.0
"""... and how much longer one that lacks less may be, by what it lacks less."""

ROOMY_M = 0.1
"""Lack of clearance below which one robot alone gives way."""

WIDER = 0.6
"""How much farther to both sides, in their sizes, the first to give way does so."""

ROUNDS = 2
"""Times that each of two robots that both give way is led round the other one."""

ASIDE_M = (1.0, 2.0, 3.0, 4.0, 6.0, 8.0, 10.0)
"""How far a robot that has nothing to do moves out of the way, at least and at most."""


@dataclass(frozen=True, slots=True)
class Detour:
    """A way round another robot's path.

    Attributes:
        robot: that is to drive it.
        surface: on which the other's path is an obstacle.
        path: the way.
        cost_m: what it takes [m of plain ground].
        lack_m: clearance that it lacks at most, from obstacles or the other's path.
    """

    robot: int
    surface: Surface
    path: Path
    cost_m: float
    lack_m: float

    def lead(self, errand: Errand) -> Errand:
        """Return the robot's errand along it."""
        return replace(errand, surface=self.surface, path=self.path, cost_m=self.cost_m)


def passing_detours(
    problem: Problem,
    errands: Sequence[Errand],
    outcome: Drive,
    r: int,
    other: int,
    way: float,
) -> list[list[Detour]]:
    """Return all detours that lead two robots past each other, the cheapest first.

    One of them is led round the other one, or both give way.

    Args:
        problem: the mission.
        errands: of all robots.
        outcome: of the drive in which they met.
        r: the robot that got stuck.
        other: the other one.
        way: to both sides of the meeting that is avoided, in sizes of both robots.
    """
    plain = problem.mission.fleet["plain"]
    driving = [one for one in (r, other) if len(errands[one].path.node) > 1]
    under_way = bool((outcome.driven[[r, other]] < np.inf).all())
    found: list[tuple[float, list[Detour]]] = []
    least_m = np.inf
    for both in (False, True) if under_way else (False,):
        for robot, side in product(driving, (-1.0, 1.0)):
            by = r + other - robot
            turns = [(robot, by, way, 1.0)]
            if both:  # one gives way by half, for longer, then each as far as it must
                turns = [(by, robot, way + WIDER, 0.5)]
                turns += ROUNDS * [(robot, by, way, 1.0), (by, robot, way, 1.0)]
            led: dict[int, Detour] = {}
            changed = list(errands)
            for one, past, along, share in turns:
                given = detour(problem, changed, outcome, one, past, along, side, share)
                led[one] = given
                surface = given.surface if share < 1.0 else changed[one].surface
                changed[one] = replace(given.lead(changed[one]), surface=surface)
            # Who went first is judged by the other one, which came to terms with it.
            lacks_m = [
                lack_m(errands[one].surface, its.path) for one, its in led.items()
            ]
            lacks_m.append(given.lack_m)
            if max(lacks_m) < SPARE_M + LACK_M:
                more_J = [
                    (one.cost_m - errands[one.robot].cost_m) * float(plain[one.robot])
                    for one in led.values()
                ]
                worse_J = LACK_WORTH * max(lacks_m) * float(plain[[r, other]].mean())
                found.append((sum(more_J) + worse_J, list(led.values())))
                least_m = min(least_m, max(lacks_m))
        if least_m < ROOMY_M:  # one alone will do
            break
    return [led for _, led in sorted(found, key=lambda each: each[0])]


def detour(
    problem: Problem,
    errands: Sequence[Errand],
    outcome: Drive,
    r: int,
    other: int,
    way: float,
    side: float,
    share: float,
) -> Detour:
    """Return robot r's way round another one's path.

    Args:
        problem: the mission.
        errands: of all robots.
        outcome: of the drive in which they met.
        r: the robot that makes the detour.
        other: the other one.
        way: to both sides of the meeting that is avoided, in sizes of both robots.
        side: 1 to pass on the left of the other's path, -1 on its right.
        share: of the distance that robots keep.
    """
    errand = errands[r]
    fleet = problem.mission.fleet
    apart_m = spacing_m(problem, r, other)
    at_m = driven_m(errands[other], outcome, other)
    around_m = way * float(fleet["radius"][[r, other]].sum() + apart_m)
    before_m = around_m if np.isfinite(outcome.driven[other]) else 0.0
    lane = lane_of(problem, errands[other], other, at_m - before_m, at_m + around_m)
    radius_m = disc_radius_m(problem, errand.surface, r)
    needed_m = share * (radius_m + lane.radius_m + apart_m + SPARE_M)
    surface = avoiding(errand.surface, lane, needed_m)
    path, cost_m = tightened(
        problem.mission.targets,
        surface,
        _aside(errand.path, lane, side, needed_m),
        SPACINGS_M[-1:],
    )
    return Detour(r, surface, path, cost_m, lack_m(surface, path))


def room_made(
    problem: Problem, errands: Sequence[Errand], outcome: Drive, r: int, other: int
) -> Iterator[list[Detour]]:
    """Yield how a robot without targets moves off another one's path, if it can.

    It drives straight ahead or back, as far as it must.

    Args:
        problem: the mission.
        errands: of all robots.
        outcome: of the drive in which the other one got stuck.
        r: the robot without targets.
        other: the one that is to pass.
    """
    errand, start = errands[r], problem.start[r]
    nose = np.array([np.cos(start[2]), np.sin(start[2])])
    at_m = driven_m(errands[other], outcome, other)
    passing = lane_of(problem, errands[other], other, at_m - WINDOW_M, at_m + WINDOW_M)
    least_m = passing.radius_m + spacing_m(problem, r, other) + SPARE_M
    for far_m, gear in product(ASIDE_M, (1, -1)):
        nodes = 1 + int(np.ceil(far_m / SPACINGS_M[-1]))
        along_m = np.linspace(0.0, gear * far_m, nodes)
        path = replace(
            errand.path,
            node=start[:2] + along_m[:, None] * nose,
            gear=np.full(nodes - 1, gear, np.int64),
        )
        own = lane_of(problem, replace(errand, path=path), r, far_m, far_m)
        apart = apart_m(own.disc[0], passing.disc.reshape(-1, 2)).min() - own.radius_m
        if apart > least_m and lack_m(errand.surface, path) < SPARE_M:
            yield [Detour(r, errand.surface, path, far_m, 0.0)]
            return


def avoiding(surface: Surface, lane: Lane, needed_m: float) -> Surface:
    """Return a surface on which another robot's lane is an obstacle.

    Args:
        surface: what paths are priced on.
        lane: of the other robot.
        needed_m: distance that the discs of both robots must keep.
    """
    around = needed_m + float(np.ptp(surface.disc)) + 2.0 * surface.cell
    disc = lane.disc.reshape(-1, 2)
    origin = np.array([surface.x_min, surface.y_min])
    shape = np.array(surface.distance.shape[::-1])
    low = np.clip(
        np.floor((disc.min(axis=0) - around - origin) / surface.cell), 0, shape
    )
    high = np.clip(
        np.ceil((disc.max(axis=0) + around - origin) / surface.cell), 0, shape
    )
    (left, bottom), (right, top) = low.astype(int), high.astype(int)
    x = surface.x_min + (np.arange(left, right) + 0.5) * surface.cell
    y = surface.y_min + (np.arange(bottom, top) + 0.5) * surface.cell
    nearest = np.full((len(y), len(x)), np.inf)
    for cx, cy in disc:
        np.minimum(nearest, np.hypot(x[None, :] - cx, y[:, None] - cy), out=nearest)
    distance = surface.distance.copy()
    part = distance[bottom:top, left:right]
    np.minimum(part, nearest - needed_m + surface.room, out=part)
    return surface._replace(distance=distance)


def _aside(path: Path, lane: Lane, side: float, needed_m: float) -> Path:
    """Return a path moved aside of a lane; to the left if `side` is 1, right if -1."""
    if len(path.node) < 2:
        return path  # it ends where it begins
    middle = lane.disc.mean(axis=1)
    apart = path.node[:, None] - middle[None]
    nearest = np.hypot(*apart.transpose(2, 0, 1)).argmin(axis=1)
    offset = apart[np.arange(len(path.node)), nearest]
    ahead = np.gradient(path.node, axis=0)
    ahead /= np.maximum(np.hypot(*ahead.T), 1e-9)[:, None]
    aside = side * np.stack([-ahead[:, 1], ahead[:, 0]], axis=1)
    lacks = needed_m - (offset * aside).sum(axis=1)
    near = np.hypot(*offset.T) < needed_m
    near[[0]] = False
    move = np.where(near, np.maximum(lacks, 0.0), 0.0)
    return replace(path, node=path.node + move[:, None] * aside)
