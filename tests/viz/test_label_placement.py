"""Names on maps keep off each other, obstacles, goals and the border where they can."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
import pytest
import shapely
from matplotlib.backends.backend_agg import FigureCanvasAgg

from mrmg.scene.loading import load_scene, scene_from_document
from mrmg.scene.types import Scene
from mrmg.shipped import scene_names
from mrmg.viz import overview, scene_drawing
from mrmg.viz.label_placement import LabelBox, Occupied, place, spots_around
from mrmg.viz.map_labels import MapLabel, half_size_m, map_labels
from mrmg.viz.map_shapes import drawn_region, drawn_start

NEEDED = {"goal", "station", "robot", "stop", "breakdown"}


def overlaps(
    scene: Scene,
    labels: tuple[MapLabel, ...],
    em_m: float,
    asked: Sequence[int] | None = None,
) -> dict[int, list[str]]:
    """Return what labels overlap but that which they name, by their numbers.

    Args:
        scene: where they are.
        labels: all there are.
        em_m: letter size.
        asked: the numbers of those to look at; all by default.
    """
    looked_at = np.arange(len(labels)) if asked is None else np.array(asked)
    half = np.array([half_size_m(item.kind, item.text, em_m) for item in labels])
    middle = np.array([(item.x_m, item.y_m) for item in labels])
    boxes = shapely.box(*(middle - half).T, *(middle + half).T)
    things = {item.id: item.shape for item in scene.obstacles}
    things |= {item.id: item.region.shape for item in scene.targets()}
    x_min, y_min, x_max, y_max = scene.bounds
    around = shapely.box(x_min - 99, y_min - 99, x_max + 99, y_max + 99)
    things["the border"] = around.difference(shapely.box(*scene.bounds))
    shapes = np.array([*things.values(), *boxes])
    names = [*things, *(item.text for item in labels)]
    owned = [*things, *(None for _ in labels)]
    shared = shapely.area(shapely.intersection(boxes[looked_at, None], shapes))
    shared[np.arange(len(looked_at)), len(things) + looked_at] = 0.0
    found: dict[int, list[str]] = {}
    for row, other in np.argwhere(shared > 1e-9 * em_m**2).tolist():
        at = int(looked_at[row])
        if not (labels[at].kind == "obstacle" and labels[at].of == owned[other]):
            found.setdefault(at, []).append(
                f"{labels[at].text} overlaps {names[other]}"
            )
    return found


def crowded(
    seed: int, *, bounds: tuple[float, float], goals: int, letters: int
) -> Scene:
    """Return a scene with goals and obstacles anywhere, many of them at the border."""
    rng = np.random.default_rng(seed)
    size = np.array(bounds)
    radius = 0.012 * float(size.max())

    def spots(count: int) -> np.ndarray:
        at = radius + rng.random((count, 2)) * (size - 2.0 * radius)
        edge = rng.random((count, 2)) < 0.25
        return np.round(
            np.where(edge, np.where(at < size / 2, radius, size - radius), at), 3
        )

    places = spots(goals + 2)
    circles = [{"center": at.tolist(), "radius": radius} for at in places]
    walls = []
    for number, at in enumerate(spots(8)):
        half = radius * rng.uniform(0.5, 6.0, 2)
        box = shapely.box(*(at - half), *(at + half))
        if shapely.distance(shapely.points(places), box).min() > 0.2 * radius:
            shape = {"center": at.tolist(), "size": (2 * half).tolist()}
            walls.append({"id": f"wall{number}", "box": shape})
    return scene_from_document(
        {
            "format": 1,
            "name": "crowded",
            "bounds": [0, 0, *bounds],
            "goals": [
                {"id": f"p{n}".ljust(letters, "x"), "circle": circle}
                for n, circle in enumerate(circles[2:])
            ],
            "stations": [
                {"id": f"s{n}", "circle": circle}
                for n, circle in enumerate(circles[:2])
            ],
            "obstacles": walls,
            "terrain": [
                {
                    "circle": {"center": at.tolist(), "radius": 5 * radius},
                    "multiplier": 2.0,
                }
                for at in spots(2)
            ],
        },
        source="crowded",
    )


def could_be_free(
    scene: Scene, labels: tuple[MapLabel, ...], em_m: float
) -> Iterator[str]:
    """Yield labels that overlap something though one of their places is free."""
    regions = {item.id: drawn_region(item.region, em_m) for item in scene.targets()}
    regions |= {robot.id: drawn_start(robot, em_m) for robot in scene.robots}
    for at, faults in overlaps(scene, labels, em_m).items():
        label = labels[at]
        if label.kind not in NEEDED:
            yield f"{faults}, and is not needed"
            continue
        half_m = half_size_m(label.kind, label.text, em_m)
        spots, _ = spots_around(regions[label.of], half_m, em_m, 0.0)
        for x_m, y_m in spots:
            moved = replace(label, x_m=float(x_m), y_m=float(y_m))
            elsewhere = (*labels[:at], moved, *labels[at + 1 :])
            if not overlaps(scene, elsewhere, em_m, [at]):
                yield f"{faults}, and could be at {x_m:.2f}, {y_m:.2f}"


@pytest.mark.quick("scene1", "mixed", "hills", "scene4")
@pytest.mark.parametrize("name", scene_names())
def test_no_name_of_a_shipped_scene_overlaps_anything(name: str) -> None:
    scene = load_scene(name)
    needed = len(scene.targets()) + len(scene.robots)
    size_m = max(scene.bounds[2] - scene.bounds[0], scene.bounds[3] - scene.bounds[1])
    too_narrow = {"scene4": {"g3", "g5"}}  # bays in which their names have no room
    for letters_per_map in (60.0, 50.0, 48.0):  # overview, video, report
        em_m = size_m / letters_per_map
        labels = map_labels(scene, em_m=em_m)
        faults = overlaps(scene, labels, em_m)
        assert {labels[at].text for at in faults} <= too_narrow.get(name, set()), faults
        assert list(could_be_free(scene, labels, em_m)) == []
        assert sum(label.kind in NEEDED for label in labels) == needed


@pytest.mark.parametrize(
    ("bounds", "goals", "letters"),
    [((100, 100), 40, 3), ((200, 20), 20, 3), ((20, 200), 20, 3), ((5, 5), 12, 10)],
)
@pytest.mark.parametrize("seed", range(3))
def test_a_name_overlaps_nothing_while_one_of_its_places_is_free(
    seed: int, bounds: tuple[float, float], goals: int, letters: int
) -> None:
    """The oracle tries every place of every name against all others as they lie."""
    scene = crowded(seed, bounds=bounds, goals=goals, letters=letters)
    em_m = max(bounds) / 50.0
    labels = map_labels(scene, em_m=em_m)
    assert {label.of for label in labels if label.kind == "goal"} == {
        goal.id for goal in scene.goals
    }
    assert list(could_be_free(scene, labels, em_m)) == []


def test_boxes_around_a_shape_touch_it_at_the_gap() -> None:
    shape = shapely.Polygon([(0, 0), (4, 0), (5, 2), (1, 3)])
    half = np.array([1.5, 0.5])
    spots, cost = spots_around(shape, half, 1.0, 0.25 * math.pi)
    boxes = shapely.box(*(spots - half).T, *(spots + half).T)
    apart = shapely.distance(boxes, shape)
    assert apart.min() > 0.0
    assert apart[: len(spots) // 3].max() < 0.12 * math.sqrt(2.0) + 1e-9
    best = spots[int(cost.argmin())] - (2.5, 1.5)
    assert best[0] > 0 and best[1] > 0  # up and right


def test_two_labels_share_a_gap_and_an_optional_one_is_left_out() -> None:
    half = np.array([1.0, 0.5])

    def label(spots: list[tuple[float, float]], *, optional: bool = False) -> LabelBox:
        cost = np.arange(len(spots), dtype=float)
        at = np.array(spots, dtype=float)
        return LabelBox(half_m=half, spots_m=at, cost=cost, owner="", optional=optional)

    first, second = label([(0, 0), (0, 5)]), label([(0, 0)])
    third = label([(0, 0.4), (0, 5.4)], optional=True)
    wall = Occupied(shapely.box(-9, 8, 9, 9), "")
    chosen = place([first, second, third], [wall], [], 1.0)
    assert [None if at is None else at.tolist() for at in chosen] == [
        [0.0, 5.0],
        [0.0, 0.0],
        None,
    ]


def test_written_names_are_no_larger_than_their_boxes(case) -> None:
    """The renderer that measures is the one that draws the picture."""
    scene, plan = case(
        goals=[
            {"id": "loading", "circle": {"center": [15, 10], "radius": 1}},
            {"id": "g", "circle": {"center": [39, 19], "radius": 1}},
        ],
        stations=[{"id": "s", "circle": {"center": [10, 10], "radius": 1}}],
        obstacles=[{"id": "hall", "box": {"center": [30, 10], "size": [9, 5]}}],
        terrain=[{"box": {"center": [5, 3], "size": [9, 5]}, "multiplier": 2.5}],
        tour=("s", "loading"),
    )
    figure, axes = scene_drawing.new_map_figure(scene)
    overview.draw_mission(axes, scene, plan, None)
    figure.draw_without_rendering()
    canvas = figure.canvas
    assert isinstance(canvas, FigureCanvasAgg)
    em_m = scene_drawing.letter_m(axes)
    kinds = set()
    for label in map_labels(scene, plan, em_m=em_m):
        kinds.add(label.kind)
        (text,) = (
            text
            for text in axes.texts
            if text.get_text() == label.text
            and text.get_position() == (label.x_m, label.y_m)
        )
        box = text.get_window_extent(canvas.get_renderer())
        (left, bottom), (right, top) = axes.transData.inverted().transform(box)
        half = half_size_m(label.kind, label.text, em_m)
        assert right - left <= 2.0 * half[0]
        assert top - bottom <= 2.0 * half[1]
        assert (left + right) / 2 == pytest.approx(label.x_m, abs=0.1 * em_m)
        assert (bottom + top) / 2 == pytest.approx(label.y_m, abs=0.1 * em_m)
    assert kinds == {"goal", "station", "stop", "robot", "path", "obstacle", "terrain"}


def test_obstacles_without_a_name_in_the_file_show_none(make_scene) -> None:
    hall = {"box": {"center": [30, 10], "size": [9, 5]}}
    for entry, shown in ((hall, []), ({**hall, "id": "hall"}, ["hall"])):
        labels = map_labels(make_scene(obstacles=[entry]), em_m=1.0)
        assert [label.text for label in labels if label.kind == "obstacle"] == shown
