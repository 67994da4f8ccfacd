"""Priority-based search for motions of a fleet without conflicts.

H. Ma, D. Harabor, P. J. Stuckey, J. Li, S. Koenig: Searching with consistent
prioritization for multi-agent path finding, AAAI 2019. Each node is a partial order of
the robots and a motion for each of them that has no conflict with higher ones. Where
two motions conflict, one child gives one robot priority and the other child the other
one. The search goes depth first. Where both orders of two robots lead nowhere, it goes
back to the last choice between robots that had to do with it (P. Prosser: Hybrid
algorithms for the constraint satisfaction problem, Computational Intelligence 9(3),
1993), and from then on looks at these two first (C. Lecoutre, L. Saïs, S. Tabary,
V. Vidal: Reasoning from last conflict(s) in constraint programming, Artificial
Intelligence 173, 2009): in a large fleet, most choices have nothing to do with each
other. Robots that a motion may meet, at a cost, do not count among those that had to do
with it: an order that only they would change may be missed.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Protocol

import numpy as np

from mrmg.planning.path_following.tracking import Motion

SHORTENING_SHARE, SHORTENING_LEAST = 0.25, 4_000
"""Nodes that shortening motions may take, as a share of what finding them took, and in
any case."""

SINCE_SHARES = 0.0, 0.5
"""Shares of a motion after which it is looked for anew, one after the other."""


class MotionPlanning(Protocol):
    """What the search needs to know of motions.

    Attributes:
        nodes: that have been looked at for all motions so far.
    """

    nodes: int

    def find(
        self,
        r: int,
        motions: Sequence[Motion],
        above: np.ndarray,
        *,
        yielding: bool = False,
        since: int = 0,
    ) -> Motion | None:
        """Return a motion of robot r without conflicts with the robots marked.

        A yielding robot makes as much room for the others as it can. Up to step `since`
        the motion is the one in `motions`.
        """

    def conflicts(self, r: int, motions: Sequence[Motion]) -> np.ndarray:
        """Return the step of r's first conflict with each robot, inf for never."""


@dataclass(frozen=True, slots=True)
class _Node:
    """A node of the search.

    Attributes:
        above: whether robot j has priority over robot i, transitively, shape (R, R).
        motions: of all robots.
        conflict: step of the first one of each two robots, inf for never, (R, R).
    """

    above: np.ndarray
    motions: tuple[Motion, ...]
    conflict: np.ndarray

    @property
    def key(self) -> tuple[object, ...]:
        """What equal nodes share, as long as their motions are kept."""
        return self.above.tobytes(), *map(id, self.motions)

    @property
    def cost(self) -> tuple[int, int]:
        """Pairs in conflict, and steps that all motions take."""
        steps = sum(len(motion.control) for motion in self.motions)
        return int(np.isfinite(self.conflict).sum()), steps


def search_priorities(
    motions: Sequence[Motion],
    planning: MotionPlanning,
    most: float,
    halt: np.ndarray,
) -> tuple[Motion, ...] | None:
    """Return motions that do not meet, or None.

    Args:
        motions: one for each robot, found without regard to the others.
        planning: finds motions.
        most: nodes after which no further motion is searched for.
        halt: shape (1,); the search ends soon after it has turned true.
    """
    robots = len(motions)
    conflict = np.stack([planning.conflicts(r, motions) for r in range(robots)])
    if not np.isfinite(conflict).any():
        return tuple(motions)
    root = _Node(np.zeros((robots, robots), bool), tuple(motions), conflict)
    failed = np.zeros((robots, robots), np.int64)
    # Why nodes led nowhere, nobody so far; two may make room in turn.
    known: dict[tuple[object, ...], np.ndarray] = {}
    stack = [_Choice(root, failed, planning)]
    most += planning.nodes
    while stack and planning.nodes < most and not halt[0]:
        choice = stack[-1]
        child = next(choice.children, None)
        if child is None:
            failed[np.ix_(choice.pair, choice.pair)] = failed.max() + 1
            known[stack.pop().key] = choice.reason
            while stack and not choice.reason[stack[-1].pair].all():
                known[stack.pop().key] = choice.reason
            if stack:
                stack[-1].reason |= choice.reason
        elif not np.isfinite(child.conflict).any():
            return child.motions
        elif child.key in known:
            choice.reason |= known[child.key]
        else:
            known[child.key] = np.zeros(robots, bool)
            stack.append(_Choice(child, failed, planning))
    return None


class _Choice:
    """Which of two robots in conflict has priority.

    Attributes:
        key: of the node.
        pair: the robots.
        reason: whether robot r has to do with why the orders before led nowhere, shape
            (R,): the two, those above them, and what those met that found no motion.
        children: nodes of the orders that are left.
    """

    def __init__(
        self, node: _Node, failed: np.ndarray, planning: MotionPlanning
    ) -> None:
        self.key, self.pair = node.key, _pair(node, failed)
        self.reason = np.zeros(len(failed), bool)
        self.reason[self.pair] = True
        self.reason |= node.above[self.pair].any(axis=0)
        self.children = _children(node, self.pair, self.reason, planning)


def _pair(node: _Node, failed: np.ndarray) -> list[int]:
    """Return the two robots whose motions conflict soonest.

    Those of which both orders have led nowhere come before all others, the last ones
    first, then conflicts of robots that have been given priorities: so a dead end is
    met soon after the choice that leads there. One that stands comes last, else the
    robot with the longer motion.

    Args:
        node: in which motions conflict.
        failed: when the orders of each two robots led nowhere; 0 for never, (R, R).
    """
    ordered = node.above.any(axis=0) | node.above.any(axis=1)
    conflict = np.where(np.logical_or.outer(ordered, ordered), node.conflict, np.inf)
    if not np.isfinite(conflict).any():
        conflict = node.conflict
    hard = np.where(np.isfinite(node.conflict), failed, 0)
    if hard.any():
        conflict = -hard
    pair = divmod(int(conflict.argmin()), len(node.motions))
    return sorted(pair, key=lambda r: len(node.motions[r].control) or np.inf)


def _children(
    node: _Node, pair: Sequence[int], reason: np.ndarray, planning: MotionPlanning
) -> Iterator[_Node]:
    """Yield the nodes in which one of two robots in conflict has priority.

    The second one is given priority first; the other order is looked at only where that
    leaves as many conflicts, or leads nowhere. `reason` receives who keeps a robot from
    a motion.
    """
    found = []
    for one, other in (pair, pair[::-1]):
        if node.above[other, one]:
            continue
        child = _with_priority(node, one, other, reason, planning)
        if child is not None and child.cost < node.cost:
            yield child
        elif child is not None:
            found.append(child)
    yield from sorted(found, key=lambda child: child.cost)


def _with_priority(
    node: _Node, low: int, high: int, reason: np.ndarray, planning: MotionPlanning
) -> _Node | None:
    """Return the node in which one more robot has priority.

    None where a robot finds no motion; `reason` receives it and those above it.
    """
    above = node.above.copy()
    upper = np.append(np.flatnonzero(above[high]), high)
    lower = np.append(np.flatnonzero(above[:, low]), low)
    above[np.ix_(lower, upper)] = True
    motions, conflict = list(node.motions), node.conflict.copy()
    for r in sorted(lower.tolist(), key=lambda r: int(above[r].sum())):
        if not np.isfinite(conflict[r, above[r]]).any():
            continue
        found = planning.find(r, motions, above[r])
        if found is None and r == low:
            found = _giving_way(low, high, above, motions, planning)
            conflict[high] = conflict[:, high] = planning.conflicts(high, motions)
        if found is None:
            reason |= above[r]
            reason[r] = True
            return None
        motions[r] = found
        conflict[r] = conflict[:, r] = planning.conflicts(r, motions)
    return _Node(above, tuple(motions), conflict)


def _giving_way(
    low: int,
    high: int,
    above: np.ndarray,
    motions: list[Motion],
    planning: MotionPlanning,
) -> Motion | None:
    """Return a motion of a robot that passes another one where both make room.

    Each of them makes as much room for the other one as it can, until the other one
    gets past; `motions` receives that of the other one.
    """
    trial = list(motions)
    beside = above[low].copy()
    beside[high] = False
    for one, other, blocked in ((high, low, above[high]), (low, high, beside)):
        aside = planning.find(one, trial, blocked, yielding=True)
        if aside is None:
            return None
        trial[one] = aside
        must = (beside if other == low else above[high]).copy()
        must[one] = True
        passing = planning.find(other, trial, must)
        if passing is not None:
            trial[other] = passing
            motions[high] = trial[high]
            return trial[low]
    return None


def shortened(
    motions: Sequence[Motion],
    alone: Sequence[Motion],
    planning: MotionPlanning,
    halt: np.ndarray,
) -> tuple[Motion, ...]:
    """Return motions in which robots lose less time to each other.

    Those that lose time move anew among all others, then from the middle of their
    motion on, where as long a search looks closer. The one that loses most comes first,
    while nodes are left.

    Args:
        motions: that have no conflicts.
        alone: what robots would do without the others.
        planning: finds motions.
        halt: shape (1,); the search ends soon after it has turned true.
    """
    best = list(motions)
    nodes = planning.nodes
    most = nodes + max(SHORTENING_LEAST, SHORTENING_SHARE * nodes)
    lost = {
        r: len(motions[r].control) - len(one.control) for r, one in enumerate(alone)
    }
    losing = [r for r in sorted(lost, key=lambda r: -lost[r]) if lost[r] > 0]
    for r, share in product(losing, SINCE_SHARES):
        if planning.nodes >= most or halt[0]:
            break
        since, others = int(share * len(best[r].control)), np.arange(len(best)) != r
        found = planning.find(r, best, others, yielding=True, since=since)
        if found is not None and len(found.control) < len(best[r].control):
            best[r] = found
    return tuple(best)
