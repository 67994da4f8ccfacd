"""Tags and labels: legible, in their place, and inside the picture."""

from __future__ import annotations

import numpy as np
import pytest

from mrmg.viz.tags import Label, Tag


@pytest.mark.parametrize("spot", [(0, 0), (99, 79), (50, 40), (-500, 20), (40, 900)])
def test_tags_are_cut_at_the_edges(make_scene, spot) -> None:
    picture = np.zeros((80, 100, 3), dtype=np.uint8)
    tag = Tag(make_scene().robots[0], "#0072B2", height=720)
    tag.blit(picture, np.array(spot, dtype=float), charge=0.5)
    assert bool(picture.any()) == (spot in {(99, 79), (50, 40)})


def test_tag_of_a_robot_behind_the_camera_is_left_out(make_scene) -> None:
    picture = np.zeros((80, 100, 3), dtype=np.uint8)
    tag = Tag(make_scene().robots[0], "#0072B2", height=720)
    tag.blit(picture, np.array([np.nan, np.nan]), charge=0.5)
    assert not picture.any()


def test_labels_are_dark_on_a_white_rim_about_their_place() -> None:
    picture = np.full((60, 80, 3), 120, dtype=np.uint8)
    Label("g1", "#1F2328", height=720).blit(picture, np.array([30.0, 35.0]))
    rows, columns = np.nonzero((picture != 120).any(axis=2))
    assert columns.min() + columns.max() == pytest.approx(60, abs=2)
    assert rows.min() + rows.max() == pytest.approx(70, abs=2)
    assert 10 <= np.ptp(rows) <= 24
    assert picture.min() < 60
    assert picture.max() > 240
