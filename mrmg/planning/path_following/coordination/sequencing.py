"""Motions of robots that find their ways one after the other, while all others stand.

An order in which each robot drives once, from where it starts to its end, is a monotone
plan: M. Stilman, J.-U. Schamburek, J. Kuffner, T. Asfour: Manipulation planning among
movable obstacles, ICRA 2007. It needs no search in time, so that what leads nowhere
fails soon. The motions that robots would make alone come first: each robot waits for
those that start on its way, and for those whose ways its end is on. Where that goes
round in a circle, other motions are looked for.

Robots then set out as soon as they keep apart from those before them in the order as
these move, and from those after them as they stand; or they move otherwise among these,
where that is sooner. Setting out once the others are through is left to them all the
while, as in the revised prioritized planning of M. Cap, P. Novak, A. Kleiner,
M. Selecky: Prioritized planning algorithms for trajectory coordination of multiple
mobile robots, T-ASE 2015; unless another one ends elsewhere than in the order, or the
steps that motions may last are over. Then there are no motions.
"""

from __future__ import annotations

from collections.abc import Sequence
from graphlib import CycleError, TopologicalSorter

import numpy as np

from mrmg.planning.path_following.coordination.priorities import MotionPlanning
from mrmg.planning.path_following.tracking import Motion

DELAYS = 50
"""Times at which a robot may set out, until those before it are through."""


def in_sequence(
    alone: Sequence[Motion],
    planning: MotionPlanning,
    most: float,
    halt: np.ndarray,
) -> tuple[Motion, ...] | None:
    """Return motions of robots that drive in some order, or None.

    Args:
        alone: what robots would do without the others; who drives longer is first.
        planning: finds motions.
        most: nodes that searches for other motions may look at; with none, robots make
            the motions that they would make alone.
        halt: shape (1,); the search ends soon after it has turned true.
    """
    starts = [_standing(r, motion.state[0], planning) for r, motion in enumerate(alone)]
    drives = _in_order(alone, starts, planning)
    if drives is None and most > 0:
        order = sorted(range(len(alone)), key=lambda r: -len(alone[r].control))
        planning.most = planning.nodes + most
        drives = _drives(starts, tuple(order), planning, halt, set())
    planning.most = np.inf
    return None if drives is None else _overlapping(starts, drives, planning, halt)


def _in_order(
    alone: Sequence[Motion], starts: Sequence[Motion], planning: MotionPlanning
) -> dict[int, Motion] | None:
    """Return the motions that robots would make alone, in an order; None without one.

    Args:
        alone: these motions.
        starts: motions that lead nowhere, from where robots start.
        planning: tells where motions meet.
    """
    ends = [_standing(r, motion.state[-1], planning) for r, motion in enumerate(alone)]
    before: dict[int, set[int]] = {r: set() for r in range(len(alone))}
    for r, motion in enumerate(alone):
        for at, first in ((starts, True), (ends, False)):
            meeting = planning.conflicts(r, [*at[:r], motion, *at[r + 1 :]])
            for other in np.flatnonzero(np.isfinite(meeting)).tolist():
                before[r if first else other].add(other if first else r)
    try:
        return {r: alone[r] for r in TopologicalSorter(before).static_order()}
    except CycleError:
        return None


def _drives(
    standing: Sequence[Motion],
    waiting: tuple[int, ...],
    planning: MotionPlanning,
    halt: np.ndarray,
    stuck: set[tuple[int, ...]],
) -> dict[int, Motion] | None:
    """Return motions of the robots that wait, in the order in which they drive.

    None if there are none. Orders are looked at depth first and back; where the same
    robots wait, the others stand at their ends, so that the same ones get through.

    Args:
        standing: motions that lead nowhere, from where each robot is.
        waiting: robots that have not driven yet.
        planning: finds motions.
        halt: shape (1,); the search ends soon after it has turned true.
        stuck: robots that were found to have no order; receives those that have none.
    """
    if not waiting:
        return {}
    for i, r in enumerate(waiting):
        others = waiting[:i] + waiting[i + 1 :]
        if others in stuck or halt[0]:
            continue
        motion = planning.find(r, standing, np.arange(len(standing)) != r)
        if motion is None:
            continue
        after = list(standing)
        after[r] = _standing(r, motion.state[-1], planning)
        further = _drives(after, others, planning, halt, stuck)
        if further is not None:
            return {r: motion, **further}
    stuck.add(waiting)
    return None


def _standing(r: int, state: np.ndarray, planning: MotionPlanning) -> Motion:
    """Return the motion of robot r that stands."""
    return planning.kept(r, Motion(state[None].copy(), np.zeros((0, 2))))


def _overlapping(
    starts: Sequence[Motion],
    drives: dict[int, Motion],
    planning: MotionPlanning,
    halt: np.ndarray,
) -> tuple[Motion, ...] | None:
    """Return motions of robots that set out as soon as they keep apart.

    Args:
        starts: motions that lead nowhere, from where robots start.
        drives: of each robot, in the order in which they get through.
        planning: finds motions.
        halt: shape (1,); it ends soon after it has turned true.
    """
    motions = list(starts)
    for r, drive in drives.items():
        through = max(len(motion.control) for motion in motions)
        if halt[0] or through + len(drive.control) > planning.horizon:
            return None
        for delay in np.linspace(0, through, DELAYS).astype(int):
            motions[r] = planning.kept(r, _delayed(drive, delay))
            if not np.isfinite(planning.conflicts(r, motions)).any():
                break
        else:  # one before it has ended elsewhere than in the order
            return None
        found = planning.find(r, motions, np.arange(len(motions)) != r)
        if found is not None and len(found.control) < len(motions[r].control):
            motions[r] = found
    return tuple(motions)


def _delayed(motion: Motion, steps: int) -> Motion:
    """Return a motion before which a robot stands."""
    return Motion(
        np.vstack([np.repeat(motion.state[:1], steps, axis=0), motion.state]),
        np.vstack([np.zeros((steps, 2)), motion.control]),
    )
