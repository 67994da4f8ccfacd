"""Certified clearance of moving footprints, between steps too.

A `Gap` gives the exact distance at an instant and a lower bound over an interval of
one step. `bounded_minimum` halves intervals until each is decided: proven clear, or
found to touch. So nothing a robot could cut between two samples goes unseen.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from mrmg.scene.types import Obstacle
from mrmg.verification.swept_footprint import SweptFootprint

MINIMUM_ACCURACY_M = 1e-3
"""How far the certified minimum may lie below the true one."""

RESOLUTION_M = 1e-4
"""A gap that cannot be distinguished from zero at this resolution counts as a touch."""

SHORTEST_S = 1e-9
"""Intervals are not halved below this, so that absurd speeds end the search too."""


@dataclass(frozen=True, slots=True, kw_only=True)
class GapMinimum:
    """The smallest value of a gap over a motion.

    Attributes:
        lower_bound_m: no instant has a smaller gap; zero or less on contact.
        contact_step: step of each instant of contact, increasing, shape (k,).
        contact_time_s: its time within the step, shape (k,).
    """

    lower_bound_m: float
    contact_step: np.ndarray
    contact_time_s: np.ndarray

    @property
    def clearance_m(self) -> float:
        """What is certainly kept clear, 0 on contact."""
        return max(self.lower_bound_m, 0.0)


def bounded_minimum(gap: Gap, steps: np.ndarray, dt_s: float) -> GapMinimum:
    """Return the certified minimum of `gap` over the given steps.

    Args:
        gap: what to bound.
        steps: indices of steps, shape (k,).
        dt_s: length of each step.
    """
    step = steps
    start, end = np.zeros(len(step)), np.full(len(step), dt_s)
    at_start, at_end = gap.at(step, start), gap.at(step, end)
    least_known = np.inf
    least_bound = np.inf
    contact_step: list[np.ndarray] = []
    contact_time: list[np.ndarray] = []
    while len(step):
        nearer = np.minimum(at_start, at_end)
        least_known = min(least_known, float(nearer.min()))
        touching = nearer <= 0.0
        bound = np.where(touching, nearer, gap.over(step, start, end))
        unresolved = ~touching & (bound <= 0.0)
        exhausted = end - start < SHORTEST_S
        hopeless = unresolved & ((nearer - bound < RESOLUTION_M) | exhausted)
        contact_step += [step[touching], step[hopeless]]
        contact_time += [
            np.where(at_start <= at_end, start, end)[touching],
            (0.5 * (start + end))[hopeless],
        ]
        improvable = ~exhausted & (bound < least_known - MINIMUM_ACCURACY_M)
        split = ~touching & ~hopeless & (unresolved | improvable)
        least_bound = float(np.min(bound[~split], initial=least_bound))
        step, start, end = step[split], start[split], end[split]
        middle = 0.5 * (start + end)
        at_middle = gap.at(step, middle)
        at_start = np.concatenate([at_start[split], at_middle])
        at_end = np.concatenate([at_middle, at_end[split]])
        step = np.concatenate([step, step])
        start, end = np.concatenate([start, middle]), np.concatenate([middle, end])
    steps_found = np.concatenate(contact_step or [np.zeros(0, dtype=int)])
    times_found = np.concatenate(contact_time or [np.zeros(0)])
    order = np.lexsort([times_found, steps_found])
    return GapMinimum(
        lower_bound_m=least_bound,
        contact_step=steps_found[order],
        contact_time_s=times_found[order],
    )


class ObstacleGap:
    """Distance of a footprint to the nearest of some obstacles."""

    def __init__(
        self, footprint: SweptFootprint, obstacles: Sequence[Obstacle]
    ) -> None:
        """Index the obstacles; there must be at least one."""
        self._footprint = footprint
        self._tree = shapely.STRtree([obstacle.shape for obstacle in obstacles])

    def at(self, step: np.ndarray, time_s: np.ndarray) -> np.ndarray:
        """Return the exact distance at instants of steps [m], shape (k,)."""
        return self._distance(
            shapely.polygons(self._footprint.corners_at(step, time_s))
        )

    def over(
        self, step: np.ndarray, start_s: np.ndarray, end_s: np.ndarray
    ) -> np.ndarray:
        """Return the swept hull's distance less the sagitta [m], shape (k,)."""
        hulls = _hulls(
            self._footprint.corners_at(step, start_s),
            self._footprint.corners_at(step, end_s),
        )
        straying = self._footprint.sagitta(step, end_s - start_s)
        return np.asarray(self._distance(hulls) - straying)

    def _distance(self, shapes: np.ndarray) -> np.ndarray:
        found, distance = self._tree.query_nearest(
            shapes, return_distance=True, all_matches=False
        )
        nearest = np.zeros(len(shapes))
        nearest[found[0]] = distance
        return nearest


class BoundsGap:
    """Distance of a footprint to the bounds from within; negative outside."""

    def __init__(
        self, footprint: SweptFootprint, bounds: tuple[float, float, float, float]
    ) -> None:
        """Take bounds as (x_min, y_min, x_max, y_max) [m]."""
        self._footprint = footprint
        self._low, self._high = np.array(bounds[:2]), np.array(bounds[2:])

    def at(self, step: np.ndarray, time_s: np.ndarray) -> np.ndarray:
        """Return the exact distance at instants of steps [m], shape (k,)."""
        corners = self._footprint.corners_at(step, time_s)
        inside = np.minimum(corners - self._low, self._high - corners)
        return np.asarray(inside.min(axis=(1, 2)))

    def over(
        self, step: np.ndarray, start_s: np.ndarray, end_s: np.ndarray
    ) -> np.ndarray:
        """Return the ends' distance less the sagitta [m], shape (k,)."""
        ends = np.minimum(self.at(step, start_s), self.at(step, end_s))
        return np.asarray(ends - self._footprint.sagitta(step, end_s - start_s))


class PairGap:
    """Distance of two footprints that move at the same time.

    The footprints are apart by the distance of the origin from the set of all
    differences of their points, which is the hull of the differences of corners. Each
    difference moves nearly straight, so the set over an interval is the hull of both
    ends', grown by both sagittas.
    """

    def __init__(self, one: SweptFootprint, other: SweptFootprint) -> None:
        """Take the footprints of two robots under one clock."""
        self._one = one
        self._other = other

    def at(self, step: np.ndarray, time_s: np.ndarray) -> np.ndarray:
        """Return the exact distance at instants of steps [m], shape (k,)."""
        return np.asarray(
            shapely.distance(
                shapely.polygons(self._one.corners_at(step, time_s)),
                shapely.polygons(self._other.corners_at(step, time_s)),
            )
        )

    def over(
        self, step: np.ndarray, start_s: np.ndarray, end_s: np.ndarray
    ) -> np.ndarray:
        """Return the hull of differences' distance less both sagittas, shape (k,)."""
        hulls = _hulls(self._differences(step, start_s), self._differences(step, end_s))
        duration_s = end_s - start_s
        straying = self._one.sagitta(step, duration_s) + self._other.sagitta(
            step, duration_s
        )
        return np.asarray(shapely.distance(hulls, shapely.Point(0.0, 0.0)) - straying)

    def _differences(self, step: np.ndarray, time_s: np.ndarray) -> np.ndarray:
        one = self._one.corners_at(step, time_s)
        other = self._other.corners_at(step, time_s)
        differences = one[:, :, None, :] - other[:, None, :, :]
        return np.asarray(differences.reshape(len(step), -1, 2))

    def least_apart_m(self) -> float:
        """Return what both are apart at all times at least, judged by circles alone."""
        return float(self._apart().min())

    def close_steps(self) -> np.ndarray:
        """Return the steps that can hold the minimum, judged by circles alone."""
        apart = self._apart()
        known = self.at(np.array([apart.argmin()]), np.zeros(1))
        return np.flatnonzero(apart <= known)

    def _apart(self) -> np.ndarray:
        separation = self._other.state[:, :2] - self._one.state[:, :2]
        models = (self._one.model, self._other.model)
        reach = sum(model.circumscribed_radius_m for model in models)
        travel = self._one.travel_m + self._other.travel_m
        return np.asarray(np.hypot(separation[:, 0], separation[:, 1]) - reach - travel)


Gap = ObstacleGap | BoundsGap | PairGap
"""A distance that changes along a motion; zero or negative means contact."""


def _hulls(start: np.ndarray, end: np.ndarray) -> np.ndarray:
    points = np.concatenate([start, end], axis=1)
    return np.asarray(shapely.convex_hull(shapely.linestrings(points)))
