"""Maps: everything of the scene is in the picture, in its place."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from mrmg.scene.loading import load_scene
from mrmg.scene.types import Scene
from mrmg.shipped import scene_names
from mrmg.viz import scene_drawing
from mrmg.viz.figures import FORMATS
from mrmg.viz.overview import draw_overview

MakeScene = Callable[..., Scene]


def ground_axes(scene: Scene) -> scene_drawing.Axes:
    _, axes = scene_drawing.new_map_figure(scene)
    scene_drawing.draw_ground(axes, scene)
    return axes


def test_obstacles_are_drawn_where_they_are_and_holes_stay_open(
    make_scene: MakeScene,
) -> None:
    scene = make_scene(
        obstacles=[
            {
                "polygon": [[20, 2], [36, 2], [36, 18], [20, 18]],
                "holes": [[[25, 6], [31, 6], [31, 14], [25, 14]]],
            }
        ]
    )
    *_, drawn = ground_axes(scene).patches
    path = drawn.get_path()
    assert path.get_extents().bounds == pytest.approx((20, 2, 16, 16))
    assert path.contains_point((22, 10))
    assert not path.contains_point((40, 10))
    # The even-odd rule and opposite orientations both leave the hole open.
    rings = path.to_polygons()
    areas = [
        0.5 * float(np.sum(r[:-1, 0] * r[1:, 1] - r[1:, 0] * r[:-1, 1])) for r in rings
    ]
    assert areas[0] * areas[1] < 0


def test_terrain_reaching_beyond_the_bounds_is_cut_off(make_scene: MakeScene) -> None:
    scene = make_scene(
        terrain=[{"box": {"center": [0, 10], "size": [20, 60]}, "multiplier": 2}]
    )
    _, terrain = ground_axes(scene).patches
    assert terrain.get_path().get_extents().bounds == pytest.approx((0, 0, 10, 20))


def test_footprint_follows_the_pose(make_scene: MakeScene) -> None:
    robot = make_scene().robots[0]
    outline = robot.model.footprint_at((3.0, 4.0, np.pi / 2))
    assert outline.min(axis=0) == pytest.approx((3 - 0.55, 4 - 0.3))
    assert outline.max(axis=0) == pytest.approx((3 + 0.55, 4 + 1.5))


def test_legend_names_what_the_scene_holds(make_scene: MakeScene) -> None:
    scene = make_scene(
        terrain=[{"circle": {"center": [30, 5], "radius": 2}, "multiplier": 2.5}],
        obstacles=[{"circle": {"center": [30, 15], "radius": 1}, "blocks": ["r1"]}],
    )
    labels = [handle.get_label() for handle in scene_drawing.map_legend(scene)]
    assert labels == [
        "goal",
        "obstacle for some robots",
        "plain ground ×1",
        "terrain ×2.5",
    ]


@pytest.mark.quick("scene1", "mixed", "hills")
@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=pytest.mark.ci) if name[:-1] == "scene6_r" else name
        for name in scene_names()
    ],
)
def test_every_shipped_scene_can_be_drawn(name: str, tmp_path: Path) -> None:
    draw_overview(load_scene(name), path=tmp_path / "map.png")
    pixels = np.asarray(Image.open(tmp_path / "map.png").convert("RGB"))
    assert pixels.shape[0] >= 300
    assert pixels.shape[1] >= 1000
    assert pixels.std() > 10


@pytest.mark.parametrize("suffix", FORMATS)
def test_equal_scenes_give_equal_files(
    make_scene: MakeScene, tmp_path: Path, suffix: str
) -> None:
    paths = tmp_path / f"a{suffix}", tmp_path / f"b{suffix}"
    for path in paths:
        draw_overview(make_scene(), path=path)
    assert paths[0].read_bytes() == paths[1].read_bytes()
