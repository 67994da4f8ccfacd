"""Robots that get in each other's way while they drive along paths.

Whoever drives first along its path (`tracking`) may meet another robot that cannot get
on either, or one that has parked. Then one of them waits, where its path does not yet
cross the other's, until the other one has passed; or where neither can, as their paths
share too long a stretch or somebody begins or ends on it, one of them is led round the
other's path; a robot that stands about makes room. All of that is found on the paths
themselves; what has been tried in a place and did not help is not tried there again.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from mrmg.planning.detours import Detour, cheapest_detours, room_made
from mrmg.planning.errand import Errand
from mrmg.planning.lanes import (
    apart_m,
    driven_m,
    shared_stretches,
    spacing_m,
    standing_lane,
)
from mrmg.planning.motion_tree import Problem
from mrmg.planning.tracking import Drive, PathPlace, Wait

MOST = 4
"""Encounters that are resolved at most, for each robot of the fleet."""

NEAR_M = 0.6
"""How much farther apart than they must be robots may get stuck by each other."""

SAME_M = 4.0
"""How near to each other two encounters are one."""

BACK_M = 0.6
"""How far before a shared stretch a robot waits."""

PASSING = (1.0, 0.6, 2.0)
"""Way to both sides of a meeting that is avoided, in sizes of both robots; those that
are tried one after the other."""


@dataclass
class Meeting:
    """Two robots that got in each other's way at a place.

    Attributes:
        pair: their numbers.
        place: where, shape (2,).
        tried: what has been done about it.
        wait: the wait that is in force, if any.
    """

    pair: frozenset[int]
    place: np.ndarray
    tried: set[tuple[str, float]] = field(default_factory=set)
    wait: Wait | None = None

    def tries(self, what: tuple[str, float]) -> bool:
        """Note that something is tried; tell whether it had not been tried before."""
        new = what not in self.tried
        self.tried.add(what)
        return new


@dataclass
class Encounters:
    """What has been done about robots in each other's way, in one series of drives."""

    meetings: list[Meeting] = field(default_factory=list)
    resolved: int = 0

    @property
    def waits(self) -> list[Wait]:
        """Who waits for whom."""
        return [one.wait for one in self.meetings if one.wait is not None]

    def resolve(
        self, problem: Problem, errands: Sequence[Errand], outcome: Drive
    ) -> bool:
        """Have one robot wait or make a detour; tell whether there was a way to.

        Args:
            problem: the mission.
            errands: of all robots; one of them is given another path, maybe.
            outcome: of the drive in which a robot got stuck.
        """
        r = outcome.stuck
        other = in_the_way(problem, errands, outcome)
        if other < 0 or self.resolved >= MOST * len(errands):
            return False
        meeting = self._meeting(frozenset((r, other)), outcome.place)
        meeting.wait = None
        for robot, wait in waits_at(problem, errands, outcome, r, other):
            if meeting.tries(("wait", robot)):
                meeting.wait = wait
                self.resolved += 1
                return True
        for way in PASSING:
            if meeting.tries(("detour", way)):
                detours = cheapest_detours(problem, errands, outcome, r, other, way)
                if self._lead(errands, detours):
                    return True
        if not errands[other].tour and meeting.tries(("room", other)):
            room = room_made(problem, errands, outcome, other, r)
            return self._lead(errands, room)
        return False

    def _lead(self, errands: Sequence[Errand], detours: Sequence[Detour]) -> bool:
        for detour in detours:
            detour.lead(errands[detour.robot])
        self.resolved += bool(detours)
        return bool(detours)

    def _meeting(self, pair: frozenset[int], place: np.ndarray) -> Meeting:
        for meeting in self.meetings:
            if meeting.pair == pair and np.hypot(*(meeting.place - place)) < SAME_M:
                return meeting
        self.meetings.append(Meeting(pair, place))
        return self.meetings[-1]


def in_the_way(problem: Problem, errands: Sequence[Errand], outcome: Drive) -> int:
    """Return the robot that the stuck one cannot get past, -1 if there is none near."""
    r = outcome.stuck
    nearest, gap_m = -1, NEAR_M
    own = standing_lane(problem, errands[r], r, outcome.state[r])
    for other, errand in enumerate(errands):
        if other == r:
            continue
        its = standing_lane(problem, errand, other, outcome.state[other])
        apart = apart_m(own.disc[0], its.disc[0]).min()
        gap = apart - own.radius_m - its.radius_m - spacing_m(problem, r, other)
        if gap < gap_m:
            nearest, gap_m = other, float(gap)
    return nearest


def waits_at(
    problem: Problem,
    errands: Sequence[Errand],
    outcome: Drive,
    r: int,
    other: int,
) -> Iterator[tuple[int, Wait]]:
    """Yield who of two robots may wait for the other one, the shorter wait first."""
    shared = shared_stretches(problem, errands, outcome, r, other)
    if shared is None:
        return
    stretch = dict(zip((r, other), shared, strict=True))
    found = []
    for waiting, passing in ((r, other), (other, r)):
        enter_m, leave_m = stretch[waiting][0], stretch[passing][1]
        if enter_m < 0.0 or np.isinf(leave_m):
            continue
        here_m = driven_m(errands[passing], outcome, passing)
        places = [
            PathPlace(robot, way_m, errands[robot].path.points(np.array([way_m]))[0])
            for robot, way_m in (
                (waiting, max(0.0, enter_m - BACK_M)),
                (passing, leave_m),
            )
        ]
        found.append((leave_m - here_m, waiting, Wait(*places)))
    for _, waiting, wait in sorted(found, key=lambda each: each[0]):
        yield waiting, wait
