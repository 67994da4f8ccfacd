"""The report's map and timeline, by the elements they are made of."""

from __future__ import annotations

import re
from dataclasses import replace
from xml.etree import ElementTree

import pytest

from mrmg.execution.log import Contact
from mrmg.results.mission_series import activities, logged_motions, shown_visits
from mrmg.results.overview import name_spots
from mrmg.results.report_map import mission_map
from mrmg.results.report_timeline import timeline


@pytest.fixture
def mission(make_scene, make_plan, make_log, straight):
    scene = make_scene(
        stations=[{"id": "s", "circle": {"center": [10, 10], "radius": 1}}],
        terrain=[
            {"id": "mud", "circle": {"center": [30, 5], "radius": 3}, "multiplier": 2.5}
        ],
        obstacles=[
            {"id": "wall", "box": {"center": [33, 15], "size": [4, 3]}},
            {
                "id": "curb",
                "box": {"center": [20, 17], "size": [4, 1]},
                "blocks": ["r2"],
            },
        ],
        robots=[
            {"id": "r1", "model": "car", "pose": [5, 10, 0]},
            {"id": "r2", "model": "car", "pose": [5, 5, 0]},
        ],
    )
    controls = {"r1": straight(12.0), "r2": straight(4.0)}
    plan = make_plan(scene, controls, {"r1": ("s", "g"), "r2": ()})
    return scene, plan, make_log(scene, plan)


def layers(svg: str) -> dict[str, ElementTree.Element]:
    root = ElementTree.fromstring(svg)
    return {group.get("data-layer"): group for group in root}


def tips(element: ElementTree.Element) -> list[str]:
    return [item.get("data-tip") for item in element.iter() if item.get("data-tip")]


def corners(path: ElementTree.Element) -> list[tuple[float, float]]:
    return [tuple(map(float, xy.split(","))) for xy in path.get("points").split()]


def test_long_paths_bear_their_robot_s_name_away_from_other_names(
    make_scene, make_plan, make_log, straight
) -> None:
    scene = make_scene(
        robots=[
            {"id": "r1", "model": "car", "pose": [5, 10, 0]},
            {"id": "r2", "model": "car", "pose": [5, 5, 0]},
        ]
    )
    controls = {"r1": straight(30.0), "r2": straight(4.0)}
    plan = make_plan(scene, controls, {"r1": ("g",), "r2": ()})
    spots = name_spots(scene, plan)
    assert list(spots) == ["r1"]  # the other path is too short
    x_m, y_m = spots["r1"]
    assert (x_m, y_m) == pytest.approx((35.0, 10.0), abs=0.5)  # far from the goal
    robots = layers(mission_map(scene, plan, None))["robots"]
    (name,) = [item for item in robots if item.get("class") == "whose"]
    assert (name.get("data-robot"), name.text) == ("r1", "r1")
    assert (float(name.get("x")), float(name.get("y"))) == pytest.approx(
        (x_m, 20.0 - y_m), abs=0.01
    )


def test_everything_on_the_map_says_what_it_is(mission) -> None:
    parts = layers(mission_map(*mission))
    assert tips(parts["ground"]) == [
        "plain ground, terrain ×1",
        "mud: driving costs ×2.5",
        "wall: obstacle",
        "curb: obstacle for r2",
    ]
    assert tips(parts["targets"]) == [
        "g: goal; stop 2 of r1",
        "s: recharging station; stop 1 of r1",
    ]
    assert tips(parts["planned"]) == [
        "r1: planned path, 12.0 m",
        "r2: planned path, 4.0 m",
    ]
    assert tips(parts["driven"])[0] == "r1: driven path, 12.0 m"
    assert [tip.split(":")[0] for tip in tips(parts["robots"])] == ["r1", "r2"]


def test_paths_lie_where_they_are_driven_with_y_downwards(mission) -> None:
    scene, plan, log = mission
    parts = layers(mission_map(scene, plan, log))
    points = corners(parts["driven"][0])
    assert points[0] == (5.0, 10.0)
    assert points[-1] == (pytest.approx(17.0, abs=0.02), 10.0)
    assert corners(parts["driven"][1])[0] == (5.0, 15.0)
    # Points are a quarter of a metre apart, not one per tick.
    assert len(points) == pytest.approx(12.0 / 0.25, abs=3)


def test_contacts_are_marked(mission) -> None:
    scene, plan, log = mission
    touch = Contact(time_s=3.0, robot="r1", other="wall", x_m=8.0, y_m=4.0)
    parts = layers(mission_map(scene, plan, replace(log, contacts=(touch,))))
    assert "r1 touched wall at 3.00 s" in tips(parts["driven"])
    mark = parts["driven"][-1]
    assert (float(mark.get("x")), float(mark.get("y"))) == (8.0, 16.0)


def test_a_scene_alone_has_a_map_without_paths(make_scene) -> None:
    parts = layers(mission_map(make_scene(), None, None))
    assert len(parts["planned"]) == len(parts["driven"]) == 0
    assert tips(parts["targets"]) == ["g: goal"]


def test_the_timeline_s_spans_are_the_activities(mission) -> None:
    scene, plan, log = mission
    page = timeline(scene, plan, log)
    widths = [
        float(w) for w in re.findall(r'class="act \w+" style=".*?width:([\d.]+)%', page)
    ]
    assert sum(widths) == pytest.approx(200.0, abs=0.1)  # two full rows
    told = re.findall(r'data-tip="(r1 [^"]*)"', page)
    assert told[1].startswith("r1 charges at s from 4.")
    assert told[-2:] == [
        f"r1 enters {visit.kind} {visit.target} at {visit.time_s:.1f} s"
        for visit in shown_visits(scene, plan, logged_motions(log)[0])
    ]
    assert "stays where it is" not in page
    spans = activities(scene, plan.trajectories[1], ())
    assert [span.kind for span in spans] == ["driving", "finished"]
    assert page.count('class="act finished"') == 3  # both rows, and the key


@pytest.mark.parametrize(
    ("end_s", "ticks"),
    [
        (0.9, ["0 s", "0.1 s", "0.2 s"]),
        (10.0, ["0 s", "1 s", "2 s"]),
        (38.4, ["0 s", "5 s", "10 s"]),
        (179.0, ["0 s", "20 s", "40 s"]),
        (3600.0, ["0 s", "500 s", "1000 s"]),
    ],
)
def test_ticks_are_round_and_few(
    make_scene, make_plan, end_s: float, ticks: list[str]
) -> None:
    scene = make_scene()
    still = [(0.0, 0.0)] * round(end_s / 0.1)
    page = timeline(scene, make_plan(scene, {"r1": still}, {"r1": ()}), None)
    told = re.findall(r'class="tick"[^>]*>([^<]*)<', page)
    assert told[:3] == ticks
    assert len(told) <= 11
