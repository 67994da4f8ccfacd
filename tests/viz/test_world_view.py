"""The renderer: things appear in the pixels that projection says."""

from __future__ import annotations

import numpy as np
import pytest

from mrmg.simulation.world_model import build_world
from mrmg.viz.world_view import (
    CHASE_FOVY_DEG,
    chase_camera,
    floor_frame,
    open_view,
    top_camera,
)

SIZE = (320, 240)
RED = (1.0, 0.0, 0.0, 1.0)
POSES = {
    "top": (top_camera(np.array([20.0, 10.0])), 24.0),
    "chase": (chase_camera(3.0, 8.0, 0.0, 0.3), CHASE_FOVY_DEG),
}


@pytest.fixture
def world(make_scene):
    """A small goal and a far station are all that can be coloured."""
    return build_world(
        make_scene(
            goals=[{"id": "g", "circle": {"center": [13, 11.5], "radius": 0.5}}],
            stations=[{"id": "s", "circle": {"center": [35, 3], "radius": 1}}],
            robots=[{"id": "r1", "model": "car", "pose": [3, 17, 0]}],
        )
    )


def white_ground(world) -> np.ndarray:
    width, height = floor_frame(world).size
    return np.full((height, width, 3), 255, dtype=np.uint8)


def red_pixels(picture: np.ndarray) -> np.ndarray:
    red = picture.astype(int)
    return np.argwhere(red[:, :, 0] > red[:, :, 1:].max(axis=2) + 60)


@pytest.mark.parametrize("pose", sorted(POSES))
def test_a_mark_appears_where_it_is_projected(world, pose) -> None:
    camera, fovy = POSES[pose]
    with open_view(world, white_ground(world), SIZE) as view:
        view.color_target("g", RED)
        view.place(world.model.qpos0)
        picture = view.draw(camera, SIZE, fovy=fovy, shadows=False)
        expected = view.project(np.array([[13.0, 11.5, 0.03]]))[0]
    found = red_pixels(picture)
    assert len(found) > 5
    assert found.mean(axis=0)[::-1] + 0.5 == pytest.approx(expected, abs=1.5)


def test_points_behind_the_camera_have_no_place(world) -> None:
    camera, fovy = POSES["chase"]
    with open_view(world, white_ground(world), SIZE) as view:
        view.place(world.model.qpos0)
        view.draw(camera, SIZE, fovy=fovy, shadows=False)
        assert np.isnan(view.project(np.array([[-60.0, -10.0, 0.0]]))).all()


def test_painted_ground_is_seen_after_its_update(world) -> None:
    camera, fovy = POSES["top"]
    with open_view(world, white_ground(world), SIZE) as view:
        view.place(world.model.qpos0)
        before = view.draw(camera, SIZE, fovy=fovy, shadows=False)
        frame = floor_frame(world)
        column, row = frame.to_pixels(np.array([[25.0, 5.0]]))[0].astype(int)
        view.ground[row - 25 : row + 26, column - 25 : column + 26] = (255, 0, 0)
        view.update_ground()
        after = view.draw(camera, SIZE, fovy=fovy, shadows=False)
    assert len(red_pixels(before)) == 0
    center = red_pixels(after).mean(axis=0)
    assert center[1] == pytest.approx(160 + 5.0 * 10.0, abs=1.0)
    assert center[0] == pytest.approx(120 + 5.0 * 10.0, abs=1.0)


def test_robots_can_be_put_out_of_sight(world) -> None:
    camera, fovy = POSES["top"]
    with open_view(world, white_ground(world), SIZE) as view:
        view.place(world.model.qpos0)
        with_robots = view.draw(camera, SIZE, fovy=fovy, shadows=False)
        view.place_robots_away(world.model.qpos0)
        without = view.draw(camera, SIZE, fovy=fovy, shadows=False)
    rows, columns = np.nonzero((with_robots != without).any(axis=2))
    assert 160 + 10 * (3 - 0.6 - 20) <= columns.min() < columns.max() <= 160 - 10 * 15.2
    assert 120 - 10 * 8 <= rows.min() < rows.max() <= 120 - 10 * 6
