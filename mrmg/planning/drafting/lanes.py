"""What robots cover along their paths, and where two of them cannot be at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mrmg.planning.drafting._band_kernels import Surface
from mrmg.planning.drafting.band import SPARE_M
from mrmg.planning.drafting.errand import Errand
from mrmg.planning.drafting.tracking import Drive
from mrmg.planning.problem.problem import Problem

STEP_M = 0.25
"""Distance of the places at which paths are compared."""

WINDOW_M = 25.0
"""Way to both sides of an encounter on which paths are compared."""

SLACK_M = 0.15
"""Distance beyond the least that robots' paths keep on stretches not shared."""


@dataclass(frozen=True, slots=True)
class Lane:
    """A stretch of a robot's path, sampled.

    Attributes:
        way_m: way along the path to each sample, shape (n,).
        disc: centres of the discs that cover the robot there, shape (n, D, 2).
        radius_m: of the discs.
    """

    way_m: np.ndarray
    disc: np.ndarray
    radius_m: float


def lane_of(
    problem: Problem, errand: Errand, r: int, first_m: float, last_m: float
) -> Lane:
    """Return what robot r covers on a stretch of its path; it is cut to the path."""
    path = errand.path
    length_m = float(path.way[-1])
    first_m, last_m = max(0.0, min(first_m, length_m)), min(last_m, length_m)
    samples = 1 + max(0, int(np.ceil((last_m - first_m) / STEP_M)))
    way_m = np.linspace(first_m, last_m, samples)
    nose = np.array([[np.cos(path.heading), np.sin(path.heading)]])
    if len(path.node) > 1:
        segment = np.searchsorted(path.way, way_m, side="right") - 1
        segment = np.clip(segment, 0, len(path.gear) - 1)
        chord = np.diff(path.node, axis=0)[segment]
        chord /= np.maximum(np.hypot(*chord.T), 1e-9)[:, None]
        nose = chord * path.gear[segment][:, None]
    disc = (
        path.points(way_m)[:, None] + errand.surface.disc[None, :, None] * nose[:, None]
    )
    return Lane(way_m, disc, disc_radius_m(problem, errand.surface, r))


def standing_lane(problem: Problem, errand: Errand, r: int, state: np.ndarray) -> Lane:
    """Return what robot r covers in a state."""
    nose = np.array([np.cos(state[2]), np.sin(state[2])])
    disc = state[:2] + errand.surface.disc[:, None] * nose
    return Lane(np.zeros(1), disc[None], disc_radius_m(problem, errand.surface, r))


def shared_stretches(
    problem: Problem,
    errands: Sequence[Errand],
    outcome: Drive,
    r: int,
    other: int,
) -> tuple[tuple[float, float], tuple[float, float]] | None:
    """Return the stretches of two paths that cannot be driven at once, where they meet.

    Returns:
        Way to the beginning and end of the stretch of each robot's path; -1 for a
        stretch that begins where the path does, or farther away than is looked, and inf
        for one that ends so. None if the paths have no such stretch.
    """
    here = [driven_m(errands[one], outcome, one) for one in (r, other)]
    lanes = [
        lane_of(problem, errands[one], one, way_m - WINDOW_M, way_m + WINDOW_M)
        for one, way_m in zip((r, other), here, strict=True)
    ]
    clash = clashes(lanes[0], lanes[1], spacing_m(problem, r, other) + SLACK_M)
    if not clash.any():
        return None
    rows, columns = np.nonzero(clash)
    far = np.hypot(lanes[0].way_m[rows] - here[0], lanes[1].way_m[columns] - here[1])
    seed = int(far.argmin())
    low, high = hull(clash, int(rows[seed]), int(columns[seed]))
    stretches = []
    for lane, first, last in zip(lanes, low, high, strict=True):
        begin = float(lane.way_m[first]) if first > 0 else -1.0
        end = float(lane.way_m[last]) if last < len(lane.way_m) - 1 else np.inf
        stretches.append((begin, end))
    return stretches[0], stretches[1]


def disc_radius_m(problem: Problem, surface: Surface, r: int) -> float:
    """Return the radius of the discs that cover robot r [m]."""
    return float(surface.room - problem.mission.fleet["margin"][r] - SPARE_M)


def spacing_m(problem: Problem, r: int, other: int) -> float:
    """Return the distance that two robots must keep [m]."""
    return float(problem.mission.fleet["spacing"][[r, other]].max())


def driven_m(errand: Errand, outcome: Drive, r: int) -> float:
    """Return how far along its path robot r has got [m]."""
    return float(np.clip(outcome.driven[r], 0.0, errand.path.way[-1]))


def apart_m(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Return the distances of points, shapes (n, 2) and (m, 2) -> (n, m)."""
    return np.asarray(np.hypot(*(first[:, None] - second[None]).transpose(2, 0, 1)))


def clashes(first: Lane, second: Lane, spacing_m: float) -> np.ndarray:
    """Tell at which samples two robots would be too near to each other, (n, m)."""
    least_m = first.radius_m + second.radius_m + spacing_m
    clash = np.zeros((len(first.way_m), len(second.way_m)), bool)
    for own in first.disc.transpose(1, 0, 2):
        for its in second.disc.transpose(1, 0, 2):
            clash |= apart_m(own, its) < least_m
    return clash


def hull(
    clash: np.ndarray, row: int, column: int
) -> tuple[tuple[int, int], tuple[int, int]]:
    """Return the first and last row and column of the clashes joined to one of them."""
    low, high = np.array([row, column]), np.array([row, column])
    while True:
        first, last = np.maximum(low - 1, 0), high + 2
        rows, columns = np.nonzero(clash[first[0] : last[0], first[1] : last[1]])
        lower = first + (rows.min(), columns.min())
        higher = first + (rows.max(), columns.max())
        if (lower >= low).all() and (higher <= high).all():
            return (int(low[0]), int(low[1])), (int(high[0]), int(high[1]))
        low, high = np.minimum(low, lower), np.maximum(high, higher)
