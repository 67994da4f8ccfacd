"""Contour lines are where the ground has their height."""

from __future__ import annotations

import numpy as np
import pytest

from mrmg.scene.loading import scene_from_document
from mrmg.scene.types import Scene
from mrmg.viz.contours import contour_lines, levels_m
from mrmg.world.elevation import height_at


def make_scene(**parts: object) -> Scene:
    document = {"format": 1, "name": "hill", "bounds": [0, 0, 40, 30], **parts}
    return scene_from_document(document, source="hill")


def test_lines_run_at_their_heights() -> None:
    hills = [
        {"center": [15, 15], "height": 2.0, "radius": 12},
        {"center": [33, 8], "height": -1.0, "radius": 6},
    ]
    scene = make_scene(elevation={"hills": hills})
    lines = list(contour_lines(scene))
    for level_m, line in lines:
        assert height_at(scene, line) == pytest.approx(level_m, abs=0.01)
    assert {level for level, _ in lines} == set(levels_m(-1.0, 2.0))


def test_flat_ground_has_none() -> None:
    assert list(contour_lines(make_scene())) == []
    assert list(contour_lines(make_scene(elevation={"grid": [[2, 2], [2, 2]]}))) == []


@pytest.mark.parametrize(
    ("low", "high", "step"),
    [(0.0, 1.0, 0.1), (-1.0, 2.0, 0.5), (0.0, 0.05, 0.005), (90.0, 333.0, 50.0)],
)
def test_levels_are_round_and_few(low: float, high: float, step: float) -> None:
    levels = levels_m(low, high)
    assert np.diff(levels) == pytest.approx(step)
    assert low < levels[0] <= low + step
    assert high - step - 1e-9 <= levels[-1] < high
    assert np.abs(levels / step - np.round(levels / step)).max() < 1e-6
    assert len(levels) <= 12
