"""Square maps with boxes at drawn places and headings, for the bench of growth."""

from __future__ import annotations

from collections.abc import Iterator
from math import sqrt
from typing import Any

import numpy as np
import shapely
from shapely import affinity

from mrmg import seeding

SIDE_M = 100.0
COVERED = 0.12
"""Share of a drawn map that its boxes cover."""

APART_M = 3.6
"""Least distance of boxes from each other and from the edge: a road's width."""


def drawn_map(boxes: int, seed: int, side_m: float = SIDE_M) -> dict[str, Any]:
    """Return a square map with boxes at drawn places."""
    rng = seeding.stream(seed, "growth", boxes)
    found = list(_free_boxes(rng, boxes, side_m))
    return {
        "format": 1,
        "name": f"{boxes} boxes, seed {seed}",
        "bounds": [0, 0, side_m, side_m],
        "obstacles": found,
    }


def _free_boxes(
    rng: np.random.Generator, boxes: int, side_m: float
) -> Iterator[dict[str, Any]]:
    """Yield boxes that leave roads between each other, narrower if there is no room."""
    box_m = side_m * sqrt(COVERED / boxes)
    placed = np.empty(boxes, dtype=object)
    count, apart_m, tries = 0, APART_M, 0
    while count < boxes:
        ratio = float(rng.uniform(0.6, 1.6))
        size = (box_m * sqrt(ratio), box_m / sqrt(ratio))
        yaw = float(rng.uniform(0.0, np.pi / 2.0))
        centre = rng.uniform(0.0, side_m, 2)
        box = affinity.rotate(
            shapely.box(-size[0] / 2.0, -size[1] / 2.0, size[0] / 2.0, size[1] / 2.0),
            yaw,
            use_radians=True,
        )
        box = affinity.translate(box, *centre)
        far_m = side_m - apart_m
        inside = shapely.box(apart_m, apart_m, far_m, far_m).contains(box)
        tries += 1
        if tries % 2000 == 0:
            apart_m *= 0.8
        if inside and (shapely.distance(box, placed[:count]) >= apart_m).all():
            placed[count] = box
            count += 1
            yield {
                "id": f"box{count}",
                "box": {
                    "center": [round(float(x), 3) for x in centre],
                    "size": [round(x, 3) for x in size],
                    "yaw": round(yaw, 4),
                },
            }
