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

from mrmg.planning.drafting.detours import Detour, passing_detours, room_made
from mrmg.planning.drafting.errand import Errand
from mrmg.planning.drafting.lanes import (
    apart_m,
    driven_m,
    shared_stretches,
    spacing_m,
    standing_lane,
)
from mrmg.planning.drafting.tracking import Drive, PathPlace, Wait
from mrmg.planning.problem.problem import Problem

MOST = 4
"""Encounters that are resolved at most, for each robot of the fleet."""

NEAR_M = 0.6
"""How much farther apart than they must be robots may get stuck by each other."""

SAME_M = 4.0
"""How near to each other two encounters are one."""

BACK_M = 0.6
"""How far before a shared stretch a robot waits."""

PASSING = (0.6, 1.0, 2.0)
"""Way to both sides of a meeting that is avoided, in sizes of both robots; those that
are tried one after the other ..."""

MOST_TRIED = 3
"""... and how many of the detours that avoid so much."""


@dataclass
class Meeting:
    """Two robots that got in each other's way, and what has been done about it.

    Attributes:
        pair: their numbers.
        place: where, shape (2,).
        options: what else may be done.
        wait: the wait that is in force, if any.
        before: errands of the robots that make detours now, as they were without them.
        detours: that are driven now.
    """

    pair: frozenset[int]
    place: np.ndarray
    options: Iterator[Wait | list[Detour]]
    wait: Wait | None = None
    before: list[Errand] = field(default_factory=list)
    detours: list[Detour] = field(default_factory=list)

    def undo(self, errands: list[Errand]) -> None:
        """Take back what has been done, unless more has been done since."""
        self.wait = None
        if all(errands[one.robot].path is one.path for one in self.detours):
            for one, errand in zip(self.detours, self.before, strict=True):
                errands[one.robot] = errand
        self.detours, self.before = [], []

    def proceed(self, errands: list[Errand]) -> bool:
        """Do what is to be done next; tell whether there was anything."""
        for option in self.options:
            if isinstance(option, Wait):
                self.wait = option
            else:
                self.detours = option
                self.before = [errands[one.robot] for one in option]
                for one in option:
                    errands[one.robot] = one.lead(errands[one.robot])
            return True
        return False


@dataclass
class Encounters:
    """What has been done about robots in each other's way, in one series of drives."""

    meetings: list[Meeting] = field(default_factory=list)
    resolved: int = 0

    @property
    def waits(self) -> list[Wait]:
        """Who waits for whom."""
        return [one.wait for one in self.meetings if one.wait is not None]

    def resolve(self, problem: Problem, errands: list[Errand], outcome: Drive) -> bool:
        """Have one robot wait or make a detour; tell whether there was a way to.

        Args:
            problem: the mission.
            errands: of all robots; some of them may be replaced.
            outcome: of the drive in which a robot got stuck.
        """
        other = in_the_way(problem, errands, outcome)
        meeting = self._meeting(outcome.stuck, other, outcome.place)
        if self.resolved >= MOST * len(errands):
            return False
        if meeting is None and other < 0:
            return False
        if meeting is None:
            pair = frozenset((outcome.stuck, other))
            options = ways_out(problem, list(errands), outcome, other)
            meeting = Meeting(pair, outcome.place, options)
            self.meetings.append(meeting)
        self.resolved += 1
        meeting.undo(errands)
        return meeting.proceed(errands)

    def _meeting(self, r: int, other: int, place: np.ndarray) -> Meeting | None:
        """Return the meeting that a robot is stuck by, known from before.

        Who is stuck with nobody near, but on a detour, is so by what it was led round.
        """
        for meeting in reversed(self.meetings):
            same = meeting.pair == {r, other}
            led = other < 0 and r in [one.robot for one in meeting.detours]
            if (same or led) and np.hypot(*(meeting.place - place)) < SAME_M:
                return meeting
        return None


def ways_out(
    problem: Problem, errands: Sequence[Errand], outcome: Drive, other: int
) -> Iterator[Wait | list[Detour]]:
    """Yield what may help two robots past each other, what costs least first.

    That is to wait, which takes no energy, or where time counts what is over soonest.

    Args:
        problem: the mission.
        errands: of all robots.
        outcome: of the drive in which they met, and one got stuck.
        other: the other one.
    """
    r = outcome.stuck
    waits = waits_at(problem, errands, outcome, r, other)
    # Round a robot that stands it is the same way, however much of a path is avoided.
    first, *more = PASSING if np.isfinite(outcome.driven[other]) else PASSING[:1]
    if problem.minimum_time or problem.preference.objective.makespan_weight > 0.0:
        detours = passing_detours(problem, errands, outcome, r, other, first)
        options: list[tuple[float, Wait | list[Detour]]] = [*waits]
        options += [(_longer_m(errands, led), led) for led in detours[:MOST_TRIED]]
        yield from (option for _, option in sorted(options, key=lambda each: each[0]))
    else:  # to wait takes no energy
        yield from (wait for _, wait in waits)
        detours = passing_detours(problem, errands, outcome, r, other, first)
        yield from detours[:MOST_TRIED]
    if not errands[other].tour:
        yield from room_made(problem, errands, outcome, other, r)
    for way in more:
        yield from passing_detours(problem, errands, outcome, r, other, way)[
            :MOST_TRIED
        ]


def _longer_m(errands: Sequence[Errand], led: Sequence[Detour]) -> float:
    return max(one.cost_m - errands[one.robot].cost_m for one in led)


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
) -> list[tuple[float, Wait]]:
    """Return how either of two robots may wait for the other one, shorter waits first.

    Each with the way that the other one drives in the meantime [m].
    """
    shared = shared_stretches(problem, errands, outcome, r, other)
    if shared is None:
        return []
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
        found.append((leave_m - here_m, Wait(*places)))
    return sorted(found, key=lambda each: each[0])
