"""The ground of the video: everything lies at its place on the image."""

from __future__ import annotations

import numpy as np
import pytest

from mrmg.viz import style
from mrmg.viz.ground_image import GroundFrame, paint_ground, paint_trail

FRAME = GroundFrame(center_m=np.array([20.0, 10.0]), half_m=np.array([24.0, 14.0]))


def test_corners_of_the_ground_are_corners_of_the_image() -> None:
    width, height = FRAME.size
    corners = np.array([[-4.0, 24.0], [44.0, -4.0]])
    assert FRAME.to_pixels(corners) == pytest.approx(
        np.array([[0.0, 0.0], [width, height]]), abs=0.5
    )


def test_terrain_and_paths_are_painted_where_they_are(
    make_scene, make_plan, straight
) -> None:
    scene = make_scene(
        terrain=[{"box": {"center": [30, 5], "size": [8, 4]}, "multiplier": 3}]
    )
    plan = make_plan(scene, {"r1": straight(12.0)}, {"r1": ("g",)})
    image = paint_ground(scene, plan, FRAME).astype(int)
    assert image.shape == (*FRAME.size[::-1], 3)

    def color_at(x_m: float, y_m: float) -> np.ndarray:
        column, row = FRAME.to_pixels(np.array([[x_m, y_m]]))[0].astype(int)
        return image[row, column]

    terrain = np.array(style.rgb(style.terrain_classes(scene)[3.0].color))
    plain = np.array(style.rgb(style.GROUND))
    assert np.abs(color_at(27.0, 4.0) - terrain).max() <= 1
    assert np.abs(color_at(27.0, 2.0) - plain).max() <= 1
    assert np.abs(color_at(8.0, 10.0) - plain).max() > 60  # planned path
    assert np.abs(color_at(8.0, 11.0) - plain).max() <= 1


def test_trails_change_only_the_pixels_along_the_way() -> None:
    ground = np.full((*FRAME.size[::-1], 3), 200, dtype=np.uint8)
    target = ground.copy()
    way = np.stack([np.linspace(0.0, 30.0, 301), np.full(301, 12.0)], axis=1)
    paint_trail(target, FRAME, way[:1], "#FF0000")
    assert np.array_equal(target, ground)
    paint_trail(target, FRAME, way, "#FF0000")
    rows, columns = np.nonzero((target != ground).any(axis=2))
    on_way = FRAME.to_pixels(way)
    assert np.abs(rows - on_way[0, 1]).max() <= 6
    assert columns.min() == pytest.approx(on_way[0, 0], abs=6)
    assert columns.max() == pytest.approx(on_way[-1, 0], abs=6)
    assert tuple(target[rows[0] + 3, columns.min() + 50]) == (255, 0, 0)
