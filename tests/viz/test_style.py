"""The visual language: distinct, legible, and complete for every scene."""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations

import numpy as np
import pytest

from mrmg.scene.types import Scene
from mrmg.simulation import palette
from mrmg.viz import style

MakeScene = Callable[..., Scene]


def luminance(color: str) -> float:
    """Relative luminance of WCAG 2.2, written out."""
    linear = [
        part / 12.92 if part <= 0.03928 else ((part + 0.055) / 1.055) ** 2.4
        for part in (value / 255.0 for value in style.rgb(color))
    ]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def test_robot_colors_are_distinct_and_stand_out_on_a_white_page() -> None:
    colors = style.robot_colors([f"r{number}" for number in range(8)])
    assert len(set(colors.values())) == 8
    for color in colors.values():
        assert 1.05 / (luminance(color) + 0.05) >= 3.0  # WCAG: graphics need 3


# Machado, Oliveira, Fernandes 2009: what eyes without one kind of cones see.
SEEN = {
    "all cones": np.eye(3),
    "protanopia": [
        [0.152286, 1.052583, -0.204868],
        [0.114503, 0.786281, 0.099216],
        [-0.003882, -0.048116, 1.051998],
    ],
    "deuteranopia": [
        [0.367322, 0.860646, -0.227968],
        [0.280085, 0.672501, 0.047413],
        [-0.011820, 0.042940, 0.968881],
    ],
    "tritanopia": [
        [1.255528, -0.076749, -0.178779],
        [-0.078411, 0.930809, 0.147602],
        [0.004733, 0.691367, 0.303900],
    ],
}
TO_XYZ = np.array(
    [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]
)


def lab(color: str, seen: np.ndarray) -> np.ndarray:
    """Return CIE L*a*b* (D65) of a colour as some eyes see it."""
    part = np.array(style.rgb(color)) / 255.0
    linear = np.where(part <= 0.04045, part / 12.92, ((part + 0.055) / 1.055) ** 2.4)
    xyz = TO_XYZ @ np.clip(np.asarray(seen) @ linear, 0.0, 1.0) / (0.9505, 1.0, 1.089)
    x, y, z = np.where(xyz > 0.008856, np.cbrt(xyz), 7.787 * xyz + 16 / 116)
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


@pytest.mark.parametrize("eyes", SEEN)
@pytest.mark.parametrize("colors_of", [style.robot_colors, style.robot_colors_on_dark])
def test_colour_blind_eyes_can_tell_eight_robots_apart(
    eyes: str, colors_of: Callable[[list[str]], dict[str, str]]
) -> None:
    colors = colors_of([f"r{number}" for number in range(8)])
    places = [lab(color, SEEN[eyes]) for color in colors.values()]
    apart = [np.linalg.norm(a - b) for a, b in combinations(places, 2)]
    assert min(apart) > 9.0  # two or three can be told apart side by side


def test_equal_multipliers_share_a_class_and_hatches_tell_classes_apart(
    make_scene: MakeScene,
) -> None:
    def area(x: float, multiplier: float) -> dict[str, object]:
        return {"circle": {"center": [x, 5], "radius": 2}, "multiplier": multiplier}

    scene = make_scene(terrain=[area(5, 2), area(12, 1.5), area(20, 2), area(28, 0.5)])
    classes = style.terrain_classes(scene)
    assert list(classes) == [0.5, 1.5, 2.0]
    assert classes[2.0].label == "terrain ×2"
    assert len({look.color for look in classes.values()}) == 3
    assert len({look.hatch for look in classes.values()}) == 3


def test_long_ids_are_numbered_and_short_ones_kept(make_scene: MakeScene) -> None:
    def goal(name: str, x: float) -> dict[str, object]:
        return {"id": name, "circle": {"center": [x, 5], "radius": 1}}

    short = make_scene(goals=[goal("a1", 5), goal("b", 20)])
    assert style.goal_labels(short) == {"a1": "a1", "b": "b"}
    long = make_scene(goals=[goal("loading_bay", 5), goal("b", 20)])
    assert style.goal_labels(long) == {"loading_bay": "1", "b": "2"}


def test_obstacles_for_some_robots_have_the_colour_of_the_simulated_world() -> None:
    shown = np.array(style.rgb(style.PARTIAL_OBSTACLE)) / 255.0
    assert shown == pytest.approx(np.array(palette.PARTIAL_OBSTACLE), abs=0.01)
