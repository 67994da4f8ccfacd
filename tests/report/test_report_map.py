"""The report's map and timeline, by the elements they are made of."""

from __future__ import annotations

import re
from dataclasses import replace
from xml.etree import ElementTree

import pytest

from mrmg.energy.battery_curves import shown_curves
from mrmg.report.map import mission_map
from mrmg.report.timeline import timeline
from mrmg.scene.margins import NarrowPassage
from mrmg.simulation.log import Contact
from mrmg.simulation.supervision import Event
from mrmg.viz.activities import activities
from mrmg.viz.map_labels import KINDS, map_labels


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


def test_names_are_where_they_were_placed_and_robots_names_go_with_them(
    mission,
) -> None:
    scene, plan, log = mission
    parts = layers(mission_map(scene, plan, log))
    texts = [item for part in parts.values() for item in part.iter("text")]
    drawn = {
        (item.get("class"), item.text): (float(item.get("x")), float(item.get("y")))
        for item in texts
    }
    labels = map_labels(scene, plan, log, em_m=40.0 / 48.0, kinds=set(KINDS) - {"stop"})
    assert {label.kind for label in labels} >= {"goal", "station", "robot", "obstacle"}
    for label in labels:
        look = "label" if label.kind == "robot" else f"label {label.kind}-name"
        spot = label.x_m, 20.0 - label.y_m
        assert drawn[look, label.text] == pytest.approx(spot, abs=0.011)
    name = next(item for item in texts if item.get("data-beside") and item.text == "r1")
    right, down = map(float, name.get("data-beside").split())
    assert (5.0 + right, 10.0 + down) == pytest.approx(drawn["label", "r1"], abs=0.011)


def test_a_breakdown_is_marked_on_map_and_timeline(mission) -> None:
    scene, plan, log = mission
    event = Event(
        time_s=4.0,
        cause="fault",
        robot="r2",
        action="stop",
        message="r2 has broken down",
    )
    log = replace(log, events=(event,))
    parts = layers(mission_map(scene, plan, log))
    assert "r2 broke down at 4.0 s" in tips(parts["robots"])
    assert [t.text for t in parts["robots"].iter("text")].count("r2 broke down") == 1
    page = timeline(scene, plan, log)
    end_s = log.time_s[-1]
    assert f"r2 has broken down from 4.0 to {end_s:.1f} s" in page
    assert "✖ broken down</em>" in page
    assert "not used" not in page


def test_a_robot_without_a_tour_is_not_used(mission) -> None:
    scene, plan, log = mission
    still = replace(log, state=log.state.copy())
    still.state[1] = still.state[1, 0]
    for shown in (log, still):
        page = timeline(scene, plan, shown)
        assert "not used</em>" in page
        assert "r2 has finished" not in page
        assert "r1 has finished" in page


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


def test_narrow_stretches_are_marked(mission) -> None:
    scene, plan, log = mission
    passage = NarrowPassage(
        robot="r1", start_s=1.0, end_s=2.0, x_m=8.0, y_m=4.0, margin_m=0.12
    )
    parts = layers(mission_map(scene, replace(plan, narrow=(passage,)), log))
    assert tips(parts["planned"])[-1] == "r1 keeps 0.12 m from obstacles here"


def test_finishes_and_headings_are_shown(make_scene) -> None:
    disc = {"circle": {"center": [20, 10], "radius": 1}, "heading": 1.5}
    robot = {"id": "r1", "model": "car", "pose": [5, 10, 0], "finish": disc}
    scene = make_scene(goals=[{"id": "g", **disc, "heading": -3.0}], robots=[robot])
    parts = layers(mission_map(scene, None, None))
    assert tips(parts["targets"]) == [
        "g: goal",
        "finish of r1",
        "g: heading -3.00 rad",
        "finish of r1: heading 1.50 rad",
    ]


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
    output = re.findall(r'data-tip="(r1 [^"]*)"', page)
    assert output[1].startswith("r1 charges at s from 4.")
    assert output[-2:] == [
        f"r1 enters {visit.kind} {visit.target} at {visit.time_s:.1f} s"
        for visit in shown_curves(scene, plan, log)[0].visits
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
    output = re.findall(r'class="tick"[^>]*>([^<]*)<', page)
    assert output[:3] == ticks
    assert len(output) <= 11
