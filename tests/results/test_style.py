"""The visual language: distinct, legible, and complete for every scene."""

from __future__ import annotations

from collections.abc import Callable

from mrmg.results import style
from mrmg.scene.types import Scene

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
