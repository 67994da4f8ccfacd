"""Edges of the roadmap cost more where they are tight."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from mrmg import seeding
from mrmg.planning.roadmap import _roadmap_kernels
from mrmg.planning.roadmap._roadmap_kernels import TIGHT_SHARE
from mrmg.planning.roadmap.roadmap import Roadmap, build_roadmap
from mrmg.scene.loading import scene_from_document
from mrmg.scene.margins import Margins
from mrmg.scene.types import Scene
from mrmg.world.world import CELL_M, World

PASSAGE_M = 0.85


def rectangle(
    name: str, x: tuple[float, float], y: tuple[float, float], **more: Any
) -> dict[str, Any]:
    centre = [0.5 * (x[0] + x[1]), 0.5 * (y[0] + y[1])]
    size = [x[1] - x[0], y[1] - y[0]]
    return {"id": name, "box": {"center": centre, "size": size}, **more}


class Place:
    """A walled yard with mud, its world and its roadmap."""

    def __init__(self) -> None:
        document = {
            "format": 1,
            "name": "yard",
            "bounds": [0, 0, 60, 40],
            "obstacles": [
                rectangle("north", (20, 22), (14, 40), height=1),
                rectangle("south", (38, 40), (0, 26), height=1),
                rectangle("shed", (50, 54), (24, 40), height=1),
            ],
            "terrain": [rectangle("mud", (24, 36), (18, 24), multiplier=4)],
            "goals": [{"id": "a", "circle": {"center": [55, 8], "radius": 1}}],
            "stations": [{"id": "s", "circle": {"center": [8, 34], "radius": 1}}],
            "battery": {"capacity_m": 500},
            "robots": [{"id": "r1", "model": "car", "pose": [5, 20, 0]}],
        }
        self.scene: Scene = scene_from_document(document, source="yard")
        self.world = World.from_scene(self.scene)
        self.roadmap: Roadmap = build_roadmap(
            self.scene,
            self.world,
            samples=800,
            neighbours=12,
            margins=Margins(),
            rng=seeding.stream(0, "roadmap"),
        )


@pytest.fixture(scope="module")
def place() -> Place:
    return Place()


def edge_cost(place: Place, a: tuple[float, float], b: tuple[float, float]) -> float:
    one = np.array([0])
    cost = _roadmap_kernels.edge_costs(
        place.world.spaces[0],
        place.world.terrain,
        np.array([a, b], float),
        one,
        one + 1,
        PASSAGE_M,
        0.0,
        0.0,
    )
    assert cost[0, 0] == cost[0, 1], "flat ground costs the same there and back"
    return float(cost[0, 0])


def test_an_edge_costs_its_weighted_length(place: Place) -> None:
    assert edge_cost(place, (5, 10), (15, 10)) == pytest.approx(10.0)
    assert edge_cost(place, (27, 20), (33, 20)) == pytest.approx(24.0)
    assert edge_cost(place, (15, 10), (5, 10)) == pytest.approx(10.0)


def test_an_edge_through_an_obstacle_is_blocked(place: Place) -> None:
    assert edge_cost(place, (15, 20), (25, 20)) == np.inf
    assert edge_cost(place, (15, 0.3), (18, 0.3)) == np.inf, "along the bounds"


def test_tight_edges_are_dearer_but_not_by_more_than_the_share(place: Place) -> None:
    """Along the wall at x = 20, from its foot away."""
    costs = [
        edge_cost(place, (20 - room, 30), (20 - room, 36))
        for room in np.arange(PASSAGE_M + 0.5 * CELL_M, 3.0, 0.1)
    ]
    assert costs == sorted(costs, reverse=True)
    assert 6.0 * (1.0 + 0.5 * TIGHT_SHARE) < costs[0] <= 6.0 * (1.0 + TIGHT_SHARE)
    assert costs[-1] == pytest.approx(6.0)
