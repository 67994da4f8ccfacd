"""Rounds of the search for motions: how hard each tries."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

LEAST_INFLATION = -0.5
"""Inflation, in sides of cells, with which robots may enter all cells that they fit
into."""


@dataclass(frozen=True, slots=True)
class Round:
    """How hard one round of the search tries.

    Attributes:
        most: nodes of one robot's search at most.
        weight: of costs-to-go: motions take at most so many times the least cost, but
            where a search has grown greedy.
        fineness: how much shorter motions, and finer cells, are than usual.
        soft_s: cost of conflicts with robots of lower priority [s].
        turning: whether costs-to-go know how long turning takes among obstacles.
        inflation: of other robots in them, beyond the distance to be kept, in sides of
            cells.
    """

    most: int
    weight: float
    fineness: float
    soft_s: float
    turning: bool = True
    inflation: float = LEAST_INFLATION


ROUNDS = (
    Round(most=1_000, weight=1.5, fineness=1.0, soft_s=2.0, turning=False),
    Round(most=4_000, weight=1.5, fineness=1.0, soft_s=4.0),
    Round(most=16_000, weight=2.0, fineness=2.0, soft_s=1.0, inflation=0.5),
)
"""Rounds one after the other, then over again with other orders of the robots. A round
of 64,000 nodes took 5 to 16 s with seven cars, and no bench missed it.

In the first one costs-to-go do not know turning: over cells and few headings it makes
unicycles that meet on open ground (swap2) go the longer way round. In the
last one other robots are inflated, so that searches in mazes are not led to where they
cannot pass each other. They are led round where they just can, too: with inflation in
two rounds, makespans grew by 5 %.
"""

COARSER = 0.7, 0.9
"""Range of the fineness of rounds that begin anew, over that in the first ones: with
the same motions in all attempts, 5 of 60 alcoves had no plan at all."""

GOLDEN = 0.5 * (5.0**0.5 - 1.0)
"""Step through that range from one time that rounds begin anew to the next: a multiple
of it is never near to those before it, relative to their number."""

SEARCHES = 2
"""How many searches of a round's length the search over priorities may take for each
robot: most orders of robots are found with few, so that after these another round, or
other paths, promise more than further orders."""

ROUNDS_ALONE = 2
"""Rounds in which motions are searched for that may meet others: one more than for
those that may not, as all else depends on them."""

SHORTENING_MOST = 2_000
"""Nodes of a search that is to shorten a motion, at least: where two unicycles change
places (swap2), the shorter motion takes 1,800."""

LONGEST = 64_000
"""Nodes of any search at most."""

UNTIMED_SHARE = 5
"""How many times as many nodes a search along several targets may have, where its
costs-to-go do not know when the other robots are where. With more, one search that
fails takes all nodes of a round, so that the other order is not tried; with 2, more
first tours fail."""

YIELDING_WEIGHT = 1.1
"""Weight of the cost-to-go for a robot that makes room for others."""

YIELDING_S = 20.0
"""Cost of conflicts with the others for such a robot [s]."""


def rounds_of(number: int) -> Sequence[Round]:
    """Return the round of an attempt: later ones try harder, then they begin anew.

    Where they do, motions are coarser, so that no search that has failed is repeated.
    """
    anew, which = divmod(number, len(ROUNDS))
    low, high = COARSER
    share = high - (high - low) * (anew * GOLDEN % 1.0) if anew > 0 else 1.0
    return (replace(ROUNDS[which], fineness=share * ROUNDS[which].fineness),)
