"""The search over priorities finds an order wherever one is needed, on a toy model.

Robots on a line of places; a motion is where a robot is at each step. Who must not meet
another one leaves later.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from mrmg.planning.path_following.coordination.priorities import (
    search_priorities,
    shortened,
)
from mrmg.planning.path_following.tracking import Motion

LONG = 40


class Crossing:
    """Robots that cross one place; `slow` ones need so many steps to it."""

    def __init__(self, approach: Sequence[int], latest: Sequence[int]) -> None:
        self.approach, self.latest = approach, latest
        self.asked: list[int] = []

    @property
    def nodes(self) -> int:
        """One for each motion that was asked for, and some from before."""
        return 100 + len(self.asked)

    def motion(self, r: int, delay: int) -> Motion:
        """Return robot r's motion that crosses `delay` steps later than it could."""
        at = np.zeros((LONG, 5))
        at[:, 0] = np.arange(LONG) - self.approach[r] - delay
        return Motion(at, np.zeros((self.approach[r] + delay, 2)))

    def crossing(self, motion: Motion) -> int:
        """Return the step at which a motion crosses."""
        return int(np.flatnonzero(motion.state[:, 0] == 0)[0])

    def find(
        self,
        r: int,
        motions: Sequence[Motion],
        above: np.ndarray,
        *,
        yielding: bool = False,
        since: int = 0,
    ) -> Motion | None:
        """Return the soonest motion that crosses when nobody above does."""
        self.asked.append(r)
        taken = {self.crossing(motions[i]) for i in np.flatnonzero(above)}
        for delay in range(self.latest[r] + 1):
            if self.approach[r] + delay not in taken:
                return self.motion(r, delay)
        return None

    def conflicts(self, r: int, motions: Sequence[Motion]) -> np.ndarray:
        """Return the step at which robot r crosses with each other one."""
        own = self.crossing(motions[r])
        conflict = [own if self.crossing(one) == own else np.inf for one in motions]
        conflict[r] = np.inf
        return np.array(conflict, float)


@pytest.mark.parametrize(
    ("approach", "latest"),
    [
        ([3, 3], [5, 0]),
        ([3, 3], [0, 5]),
        ([3, 3, 3, 3], [3, 2, 1, 0]),
        ([3, 3, 4, 4], [2, 0, 3, 1]),
    ],
)
def test_an_order_is_found_where_only_some_can_wait(
    approach: list[int], latest: list[int]
) -> None:
    planning = Crossing(approach, latest)
    alone = [planning.motion(r, 0) for r in range(len(approach))]
    found = search_priorities(alone, planning, 100, np.zeros(1, bool))
    assert found is not None
    times = [planning.crossing(motion) for motion in found]
    assert len(set(times)) == len(times)
    for r, time in enumerate(times):
        assert approach[r] <= time <= approach[r] + latest[r]


def test_none_is_found_where_nobody_can_wait() -> None:
    planning = Crossing([3, 3], [0, 0])
    alone = [planning.motion(r, 0) for r in range(2)]
    assert search_priorities(alone, planning, 100, np.zeros(1, bool)) is None


def test_it_is_given_up_after_so_many_nodes() -> None:
    alone = [Crossing([3] * 3, [9] * 3).motion(r, 0) for r in range(3)]
    for most, is_found in ((1, False), (100, True)):
        planning = Crossing([3] * 3, [9] * 3)
        found = search_priorities(alone, planning, most, np.zeros(1, bool))
        assert (found is not None) == is_found


def test_halted_it_finds_nothing() -> None:
    planning = Crossing([3, 3], [5, 5])
    alone = [planning.motion(r, 0) for r in range(2)]
    assert search_priorities(alone, planning, 100, np.ones(1, bool)) is None


def test_who_has_lost_time_for_nothing_moves_sooner() -> None:
    planning = Crossing([3, 3, 3], [9, 9, 9])
    alone = [planning.motion(r, 0) for r in range(3)]
    late = [planning.motion(r, delay) for r, delay in enumerate([2, 0, 7])]
    sooner = shortened(late, alone, planning, np.zeros(1, bool))
    assert [len(motion.control) for motion in sooner] == [5, 3, 4]


class HalfCrossing(Crossing):
    """Robots that find other motions from the middle of theirs on alone."""

    def find(
        self, r: int, motions: Sequence[Motion], above: np.ndarray, **options: int
    ) -> Motion | None:
        """Return a sooner motion if it is to be the old one up to its middle."""
        found = super().find(r, motions, above)
        since = options.get("since", 0)
        return found if since == len(motions[r].control) // 2 else None


def test_motions_are_shortened_from_their_middle_on_too() -> None:
    planning = HalfCrossing([3, 3], [9, 9])
    alone = [planning.motion(r, 0) for r in range(2)]
    late = [planning.motion(0, 0), planning.motion(1, 7)]
    sooner = shortened(late, alone, planning, np.zeros(1, bool))
    assert [len(motion.control) for motion in sooner] == [3, 4]


def test_the_second_order_is_looked_at_only_where_the_first_one_fails() -> None:
    planning = Crossing([3, 3, 6, 6], [5, 5, 5, 5])
    alone = [planning.motion(r, 0) for r in range(4)]
    assert search_priorities(alone, planning, 100, np.zeros(1, bool)) is not None
    assert len(planning.asked) == len(set(planning.asked)) == 2


class TwoCrossings(Crossing):
    """Robots 0-2 cross one place, robots 3 and 4 another one."""

    def conflicts(self, r: int, motions: Sequence[Motion]) -> np.ndarray:
        """Return the step at which robot r crosses with those of its place."""
        elsewhere = (np.arange(len(motions)) < 3) != (r < 3)
        return np.where(elsewhere, np.inf, super().conflicts(r, motions))


def test_conflicts_of_robots_with_priorities_come_before_sooner_ones() -> None:
    # 0 and 1 would cross at step 3; who waits meets 2 at step 4. 3 and 4 do so at 3.
    planning = TwoCrossings([3, 3, 4, 3, 3], [9] * 5)
    alone = [planning.motion(r, 0) for r in range(5)]
    assert search_priorities(alone, planning, 100, np.zeros(1, bool)) is not None
    assert [r < 3 for r in planning.asked] == [True, True, True, False]


def test_other_orders_are_not_tried_of_robots_that_have_nothing_to_do_with_it() -> None:
    # 3 and 4 cannot both cross, in whatever order the others do.
    planning = TwoCrossings([3, 3, 4, 9, 9], [9, 9, 9, 0, 0])
    alone = [planning.motion(r, 0) for r in range(5)]
    assert search_priorities(alone, planning, 1000, np.zeros(1, bool)) is None
    two = Crossing([9, 9], [0, 0])
    assert search_priorities(alone[3:], two, 1000, np.zeros(1, bool)) is None
    assert sum(r > 2 for r in planning.asked) == len(two.asked)


def test_two_of_which_neither_can_wait_end_the_search_soon() -> None:
    # 3 and 5 cross at once; the others are in each other's way before, and in theirs.
    planning = Crossing([4, 5, 4, 5, 3, 5], [2, 1, 0, 0, 1, 0])
    alone = [planning.motion(r, 0) for r in range(6)]
    assert search_priorities(alone, planning, 2000, np.zeros(1, bool)) is None
    assert len(planning.asked) < 50


class Shuttle:
    """Robot 2 is in the way of 0 or of 1, and goes to and fro to let them pass."""

    nodes = 1
    still = Motion(np.zeros((1, 5)), np.zeros((1, 2)))

    def __init__(self) -> None:
        self.places = tuple(Motion(np.zeros((1, 5)), np.zeros((9, 2))) for _ in "01")

    def find(
        self, r: int, motions: Sequence[Motion], above: np.ndarray, **_: object
    ) -> Motion | None:
        """Return the other place of robot 2; others have none to go to."""
        if r == 2:
            return None if above.any() else self.places[motions[2] is self.places[0]]
        in_the_way = above[2] and motions[2] is self.places[r]
        return None if in_the_way else motions[r]

    def conflicts(self, r: int, motions: Sequence[Motion]) -> np.ndarray:
        """Return the step at which robot r is in conflict with each other one."""
        met = self.places.index(motions[2])
        conflict = np.full(3, np.inf)
        if r in (met, 2):
            conflict[2 if r == met else met] = 1.0
        return conflict


def test_robots_that_send_another_one_to_and_fro_end_the_search() -> None:
    planning = Shuttle()
    motions = [planning.still, planning.still, planning.places[0]]
    assert search_priorities(motions, planning, 5, np.zeros(1, bool)) is None
