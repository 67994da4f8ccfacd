"""Robots drive in some order wherever there is one, on a toy model.

Robots on the places of a small grid, some of which are walls; a motion is where a robot
is at each step. The oracle tries all orders.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Collection, Sequence
from itertools import permutations

import numpy as np
import pytest

from mrmg.planning.path_following.coordination.sequencing import in_sequence
from mrmg.planning.path_following.tracking import Motion

Place = tuple[int, int]

WIDTH, ROBOTS = 4, 4


class Grid:
    """Robots that go from their starts to their ends, a place a step."""

    horizon = 200

    def __init__(self, seed: int) -> None:
        rng = np.random.default_rng(seed)
        places = [(x, y) for x in range(WIDTH) for y in range(3)]
        drawn = [places[i] for i in rng.permutation(len(places))]
        self.free = set(drawn[3:])
        self.start, self.end = drawn[3 : 3 + ROBOTS], drawn[-ROBOTS:]
        self.nodes, self.most = 0, np.inf

    def way(self, start: Place, end: Place, taken: Collection[Place]) -> list[Place]:
        """Return a shortest way round places that are taken, none if there is none."""
        before: dict[Place, Place] = {start: start}
        queue = deque([start])
        while queue and end not in before:
            x, y = queue.popleft()
            for place in ((x + 1, y), (x - 1, y), (x, y + 1), (x, y - 1)):
                if place in self.free - set(taken) and place not in before:
                    before[place] = (x, y)
                    queue.append(place)
        if end not in before:
            return []
        way = [end]
        while way[-1] != start:
            way.append(before[way[-1]])
        return way[::-1]

    def find(
        self, r: int, motions: Sequence[Motion], above: np.ndarray, **_: object
    ) -> Motion | None:
        """Return a motion where those above never are."""
        self.nodes += 1
        marked = np.flatnonzero(above)
        taken = {(int(x), int(y)) for i in marked for x, y in motions[i].state[:, :2]}
        way = self.way(self.start[r], self.end[r], taken)
        return motion_along(way) if way and self.nodes <= self.most else None

    def conflicts(self, r: int, motions: Sequence[Motion]) -> np.ndarray:
        """Return the first step at which robot r is where another one is or was."""
        place = [places(motion, self.horizon) for motion in motions]
        return np.array(
            [
                np.inf if i == r else meeting(place[r], other)
                for i, other in enumerate(place)
            ]
        )

    def kept(self, r: int, motion: Motion) -> Motion:
        """Return a motion as it is: nothing is told by identities here."""
        return motion


def motion_along(way: Sequence[Place]) -> Motion:
    """Return the motion that leads along places."""
    state = np.zeros((len(way), 5))
    state[:, :2] = way
    return Motion(state, np.zeros((len(way) - 1, 2)))


def places(motion: Motion, steps: int) -> np.ndarray:
    """Return where a robot is at each step; it stays where its motion ends."""
    at = motion.state[:, :2]
    return np.vstack([at, np.repeat(at[-1:], steps - len(at), axis=0)])


def meeting(one: np.ndarray, other: np.ndarray) -> float:
    """Return the step at which two are in one place, or change places."""
    meet = (one == other).all(axis=1)
    meet[1:] |= (one[1:] == other[:-1]).all(axis=1)
    meet[1:] |= (one[:-1] == other[1:]).all(axis=1)
    return float(meet.argmax()) if meet.any() else np.inf


def has_order(grid: Grid, most: float) -> bool:
    """Return whether robots can drive in some order, all others standing.

    They take what ways they like, or with no nodes the ones they would take alone.
    """
    for order in permutations(range(ROBOTS)):
        at = list(grid.start)
        for r in order:
            others = at[:r] + at[r + 1 :]
            alone = grid.way(at[r], grid.end[r], ())
            way = grid.way(at[r], grid.end[r], others) if most > 0 else alone
            if not way or set(way) & set(others):
                break
            at[r] = grid.end[r]
        else:
            return True
    return False


def from_starts(grid: Grid) -> list[Motion]:
    """Return what robots would do without the others; none if one has no way."""
    ways = [
        grid.way(start, end, ())
        for start, end in zip(grid.start, grid.end, strict=True)
    ]
    return [motion_along(way) for way in ways] if all(ways) else []


@pytest.mark.parametrize("most", [0, np.inf])
def test_an_order_is_found_wherever_there_is_one(most: float) -> None:
    """With no nodes, robots make the motions that they would make alone."""
    ordered, without = 0, 0
    for seed in range(300):
        grid = Grid(seed)
        if not (alone := from_starts(grid)):
            continue
        found = in_sequence(alone, grid, most, np.zeros(1, bool))
        assert (found is not None) == has_order(grid, most), seed
        if found is None:
            without += 1
            continue
        ordered += 1
        for r, motion in enumerate(found):
            assert tuple(motion.state[0, :2]) == grid.start[r]
            assert tuple(motion.state[-1, :2]) == grid.end[r]
            assert not np.isfinite(grid.conflicts(r, found)).any(), seed
    assert min(ordered, without) > 40


@pytest.mark.parametrize(("most", "halted"), [(2, False), (np.inf, True)])
def test_nothing_is_found_with_too_few_nodes_or_halted(
    most: float, halted: bool
) -> None:
    ordered = (seed for seed in range(300) if has_order(Grid(seed), np.inf))
    seed = next(seed for seed in ordered if not has_order(Grid(seed), 0))
    grid = Grid(seed)
    assert in_sequence(from_starts(grid), grid, most, np.array([halted])) is None


def test_robots_set_out_as_soon_as_they_keep_apart() -> None:
    """Two go along one lane, the second one behind the first one."""
    grid = Grid(0)
    grid.free = {(x, 0) for x in range(20)}
    grid.start, grid.end = [(5, 0), (0, 0)], [(19, 0), (14, 0)]
    found = in_sequence(from_starts(grid), grid, np.inf, np.zeros(1, bool))
    assert found is not None
    assert max(len(motion.control) for motion in found) < 18


def test_a_horizon_is_kept() -> None:
    grid = Grid(0)
    grid.free = {(x, 0) for x in range(20)}
    grid.start, grid.end = [(5, 0), (0, 0)], [(19, 0), (14, 0)]
    grid.horizon = 25
    assert in_sequence(from_starts(grid), grid, np.inf, np.zeros(1, bool)) is None


def test_halted_after_the_order_is_found_it_finds_nothing() -> None:
    """A large fleet takes long to set out."""
    grid = Grid(0)
    grid.free = {(x, 0) for x in range(20)}
    grid.start, grid.end = [(5, 0), (0, 0)], [(19, 0), (14, 0)]
    halt = np.zeros(1, bool)

    def conflicts(r: int, motions: Sequence[Motion]) -> np.ndarray:
        halt[0] = True
        return np.full(len(motions), np.inf)

    grid.conflicts = conflicts  # type: ignore[method-assign]
    assert in_sequence(from_starts(grid), grid, np.inf, halt) is None
