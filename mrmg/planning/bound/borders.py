"""Borders of regions: the points and arcs that stand for them, and how far they are."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from shapely.geometry import Point
from shapely.ops import substring

from mrmg.scene.region import Region

SPACING_M = 0.04
"""Distance of the points that stand for a region's border."""

ARCS = 64
"""Arcs into which borders are cut."""


def border(region: Region) -> np.ndarray:
    """Return points on a region's border, SPACING_M apart at most.

    They lie in the middles of equal parts, whose number is a multiple of ARCS.
    """
    parts = max(1, int(np.ceil(_length_m(region) / SPACING_M / ARCS)))
    return _middles(region, ARCS * parts)


def arc_middles(region: Region) -> np.ndarray:
    """Return the middles of arcs, on the border itself, shape (K, 2)."""
    return _middles(region, ARCS)


def _middles(region: Region, count: int) -> np.ndarray:
    """Return the middles of equal parts of a border, shape (count, 2)."""
    share = (np.arange(count) + 0.5) / count
    if len(region.corners):
        points = shapely.line_interpolate_point(
            region.shape.exterior, share, normalized=True
        )
        return np.asarray(shapely.get_coordinates(points))
    angle = 2.0 * np.pi * share
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return np.asarray(region.center + region.radius_m * ring)


def _length_m(region: Region) -> float:
    """Return the length of a region's border [m]."""
    if len(region.corners):
        return float(region.shape.length)
    return 2.0 * np.pi * region.radius_m


def distances_m(regions: Sequence[Region]) -> np.ndarray:
    """Return the distances of regions, (T, T); not positive where they overlap."""
    cores = np.array(
        [
            region.shape if len(region.corners) else Point(*region.center)
            for region in regions
        ]
    )
    radius_m = np.array([region.radius_m for region in regions])
    apart_m = shapely.distance(cores[:, None], cores.copy())  # two views fail in 2.1
    return np.asarray(apart_m - radius_m[:, None] - radius_m)


def arc_lines(region: Region) -> list[shapely.LineString]:
    """Return the arcs of a region's border, those of circles as their chords."""
    if len(region.corners):
        ring = region.shape.exterior
        cuts = np.linspace(0.0, ring.length, ARCS + 1)
        return [substring(ring, *ends) for ends in zip(cuts, cuts[1:], strict=False)]
    angle = np.linspace(0.0, 2.0 * np.pi, ARCS + 1)
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1) * region.radius_m
    ring = ring + region.center
    return [shapely.LineString(ends) for ends in zip(ring, ring[1:], strict=False)]


def chords(region: Region) -> tuple[np.ndarray, np.ndarray]:
    """Return the ends of arcs, shape (K, 2, 2), and how far arcs are off their chords.

    The latter in m, shape (K,): a corner within an arc is off by half of it at most.
    """
    lines = [shapely.get_coordinates(line) for line in arc_lines(region)]
    bent = np.array([len(line) > 2 for line in lines])
    off_m = np.where(bent, half_arc_m(region), sagitta_m(region))
    return np.array([line[[0, -1]] for line in lines]), off_m


def half_arc_m(region: Region) -> float:
    """Return half the length of an arc [m]."""
    return 0.5 * _length_m(region) / ARCS


def sagitta_m(region: Region) -> float:
    """Return how far an arc departs from its line [m]."""
    return region.radius_m * (1.0 - float(np.cos(np.pi / ARCS)))
