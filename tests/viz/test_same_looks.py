"""Map, timeline, report and video tell the same of the same mission."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from markupsafe import Markup
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from mrmg.energy import battery_curves
from mrmg.energy.audit import audit
from mrmg.energy.by_terrain import energy_by_terrain
from mrmg.energy.metering import visits_and_energy
from mrmg.report import page as report_page
from mrmg.report.charts import chart_data
from mrmg.report.formats import percent
from mrmg.report.timeline import timeline
from mrmg.scene.loading import load_scene
from mrmg.simulation.supervision import Event
from mrmg.viz import energy_plot, overview, scene_drawing, style
from mrmg.viz.activities import BROKEN, activities
from mrmg.viz.energy_plot import draw_energy
from mrmg.viz.film import Film
from mrmg.viz.map_shapes import enclosing_circle
from mrmg.viz.overlay import Panel, Reading, RobotReading
from mrmg.viz.tags import Tag, place_tags
from mrmg.viz.timeline_plot import draw_timeline
from mrmg.viz.timeline_rows import HIDDEN, name_lines
from mrmg.viz.video_options import VideoOptions

FAULT = Event(
    time_s=4.0, cause="fault", robot="r2", action="stop", message="r2 has broken down"
)
OPTIONS = VideoOptions(
    view="top", robot=None, speed=2.0, size=(640, 360), fps=10, from_s=0.0, to_s=1e9
)


@pytest.fixture
def mission(make_scene, make_plan, make_log, straight):
    """r1 visits the goal, r2 drives aside, r3 stays; the latter have no tour."""
    scene = make_scene(
        robots=[
            {"id": f"r{n}", "model": "car", "pose": [5, 13 - 3 * n, 0]}
            for n in (1, 2, 3)
        ]
    )
    controls = {"r1": straight(12.0), "r2": straight(8.0), "r3": []}
    plan = make_plan(scene, controls, {"r1": ("g",), "r2": (), "r3": ()})
    return scene, plan, make_log(scene, plan)


def shown(mission) -> tuple[Figure, scene_drawing.Axes, list[str]]:
    figure, axes = scene_drawing.new_map_figure(mission[0])
    handles = overview.draw_mission(axes, *mission)
    return figure, axes, [str(handle.get_label()) for handle in handles]


def test_paths_and_curves_have_one_look_everywhere(mission) -> None:
    scene, plan, log = mission
    _, axes, _ = shown(mission)
    em = scene_drawing.LETTER_POINTS
    expected = [
        (style.PLANNED.width_em * em, style.PLANNED.opacity),
        (style.DRIVEN.width_em * em, style.DRIVEN.opacity),
    ]
    color = style.scene_robot_colors(scene)["r1"]
    (panel,) = (Figure().add_subplot(),)
    planned, driven = (
        battery_curves.shown_curves(scene, plan, of) for of in (None, log)
    )
    energy_plot.draw_battery(panel, scene, (planned[0], driven[0]))
    for lines in (axes.lines, panel.lines):
        looks = [
            (line.get_linewidth(), line.get_alpha())
            for line in lines
            if len(line.get_xdata()) > 2 and to_hex(line.get_color()) == color.lower()
        ]
        assert looks == expected
        assert {line.get_linestyle() for line in lines[:2]} == {"-"}
    page = report_page.page("t", Markup(), colors=1)
    for name, look in (("planned", style.PLANNED), ("driven", style.DRIVEN)):
        assert f"--{name}-width:{look.width_em:g};" in page
        assert f"--{name}-opacity:{look.opacity:g};" in page
        assert f"stroke-width:calc(var(--{name}-width)*1em)" in page


def test_all_that_show_a_drive_read_its_curves_worked_out_once(
    mission, monkeypatch, tmp_path
) -> None:
    contents = []

    def counted(*arguments, **options):
        contents.append(visits_and_energy(*arguments, **options))
        return contents[-1]

    monkeypatch.setattr(battery_curves, "visits_and_energy", counted)
    scene, plan, log = mission
    audit(scene, plan, log)
    energy_by_terrain(scene, plan, log)
    chart_data(scene, plan, log)
    timeline(scene, plan, log)
    draw_energy(scene, plan, log, path=tmp_path / "picture.svg")
    draw_timeline(scene, plan, log, path=tmp_path / "timeline.svg")
    Film(scene, plan, log, OPTIONS)
    assert len(contents) == len(scene.robots)


def test_robots_without_a_tour_are_called_not_used(mission, drawn, tmp_path) -> None:
    scene, plan, log = mission
    _, _, legend = shown(mission)
    assert [label for label in legend if label.startswith("r")][:3] == [
        "r1: 1 goal",
        "r2: not used",
        "r3: not used",
    ]
    film = Film(scene, plan, log, OPTIONS)
    ways = [robot.way("to") for robot in film.reading(len(log.time_s) - 1).robots]
    assert ways == ["tour done", "not used", "not used"]
    page = timeline(scene, plan, log)
    assert page.count("not used</em>") == 2
    draw_timeline(scene, plan, log, path=tmp_path / "picture.png")
    texts = [text.get_text() for text in drawn[-1].axes[0].texts]
    assert texts.count("not used") == 2


def test_a_robot_that_only_drives_to_its_finish_is_used(
    make_scene, make_plan, make_log, straight
) -> None:
    ends = ([13, 10], [5, 4])
    scene = make_scene(
        robots=[
            {
                "id": f"r{n}",
                "model": "car",
                "pose": [5, 16 - 6 * n, 0],
                "finish": {"circle": {"center": center, "radius": 0.5}},
            }
            for n, center in enumerate(ends, start=1)
        ]
    )
    controls = {"r1": straight(8.0), "r2": []}
    plan = make_plan(scene, controls, {"r1": (), "r2": ()})
    log = make_log(scene, plan)
    _, _, legend = shown((scene, plan, log))
    assert legend[:2] == ["r1: to its finish", "r2: not used"]
    film = Film(scene, plan, log, OPTIONS)
    first, last = film.reading(0), film.reading(len(log.time_s) - 1)
    assert [robot.way("to") for robot in first.robots] == [
        "to its finish",
        "not used",
    ]
    assert last.robots[0].way("to") == "tour done"


def test_a_broken_robot_is_marked_on_map_timeline_and_video(
    mission, drawn, tmp_path
) -> None:
    scene, plan, log = mission
    log = replace(log, events=(FAULT,))
    _, axes, legend = shown((scene, plan, log))
    assert "r2: broken down" in legend
    assert "broken down" in legend
    assert "r2 broke down" in [text.get_text() for text in axes.texts]
    middle, _ = enclosing_circle(scene.robot("r2"), tuple(log.state[1, -1, :3]))
    marks = [line.get_xydata()[0] for line in axes.lines if line.get_marker() == "X"]
    assert marks == [pytest.approx(middle)]
    spans = activities(scene, plan.trajectories[1], (), 4.0)
    assert (spans[-1].kind, spans[-1].start_s) == (BROKEN, pytest.approx(4.0))
    assert sum(span.end_s - span.start_s for span in spans) == pytest.approx(
        plan.makespan_s
    )
    draw_timeline(scene, plan, log, path=tmp_path / "picture.png")
    (key,) = drawn[-1].legends
    assert "broken down" in [text.get_text() for text in key.get_texts()]
    film = Film(scene, plan, log, OPTIONS)
    before, after = film.reading(10), film.reading(len(log.time_s) - 1)
    assert before.robots[1].way("to") != "not used"
    assert after.robots[1].way("to") == "broken down"
    tag = Tag(scene.robots[1], "#0072B2", height=720)
    whole, broken = np.zeros((2, 80, 100, 3), dtype=np.uint8)
    tag.blit(whole, np.array([50.0, 70.0]), 0.5)
    tag.blit(broken, np.array([50.0, 70.0]), 0.5, broken=True)
    assert not np.array_equal(whole, broken)


def test_marks_of_ends_go_around_the_parked_robots(mission) -> None:
    scene, plan, log = mission
    _, axes, _ = shown(mission)
    rings = [patch for patch in axes.patches if isinstance(patch, Circle)]
    assert len(rings) == 2  # r3 has not moved
    for ring, robot, state in zip(rings, scene.robots, log.state, strict=False):
        outline = robot.model.footprint_at(tuple(state[-1, :3]))
        assert np.hypot(*(outline - ring.center).T).max() < ring.radius
        assert ring.get_facecolor()[3] == 0.0
        assert ring.get_zorder() < 7  # robots lie above


def test_of_nothing_against_nothing_there_is_no_percentage() -> None:
    assert percent(3.0, 0.09) == percent(0.0, 0.0) == percent(-1.0, 0.05) == "–"
    assert percent(5050.0, 5000.0) == "+1.00 %"
    assert percent(4999.9, 5000.0) == "+0.00 %"


def test_the_video_s_legend_is_the_map_s_and_knows_contour_lines() -> None:
    scene = load_scene("hills")
    labels = [handle.get_label() for handle in scene_drawing.map_legend(scene)]
    assert labels == [entry.label for entry in style.map_key(scene)]
    assert "contour line" in labels
    robot = RobotReading(robot="r1", charge=1.0, speed_m_s=0.0, heading_for="g1")
    twice = (robot, replace(robot, robot="r2"))
    reading = Reading(time_s=0.0, used_J=0.0, visited={}, robots=twice)
    picture = Panel(scene, (333, 720), 2.0, 720).draw(reading)
    line = (picture == style.rgb(style.CONTOUR)).all(axis=2)
    assert 15 <= line.any(axis=0).sum() <= 25  # a stroke across its swatch
    plain = Panel(load_scene("quickstart"), (333, 720), 2.0, 720).draw(reading)
    assert not (plain == style.rgb(style.CONTOUR)).all(axis=2).any()


@pytest.mark.parametrize("debt", [0.0, 0.3])
def test_axes_of_charge_reach_below_empty_where_a_battery_does(
    mission, drawn, tmp_path, debt: float
) -> None:
    scene, plan, log = mission
    capacity_J = scene.robots[0].battery.capacity_J
    spent = replace(log, work_J=log.work_J.copy())
    spent.work_J[0, 5, 0] += (1.0 + debt) * capacity_J
    charts = {chart["id"]: chart for chart in chart_data(scene, plan, spent)["charts"]}
    assert charts["charge-r1"]["range"] == (0, 100)  # at least: the page widens it
    lines = charts["charge-r1"]["series"]
    values = [value for line in lines for value in line["values"] if value is not None]
    assert min(values) < -100.0 * debt
    draw_energy(scene, plan, spent, path=tmp_path / "picture.png")
    axes = drawn[-1].axes[0]
    bottom, top = axes.get_ylim()
    content = np.concatenate([line.get_ydata() for line in axes.lines[:2]])
    assert bottom <= content.min() < 0.0
    assert top >= content.max()


@pytest.mark.parametrize("seed", range(4))
def test_names_in_lines_meet_none_and_stay_on_the_axis(seed: int) -> None:
    rng = np.random.default_rng(seed)
    shares = np.sort(rng.random(25)).tolist()
    sizes = rng.uniform(1.0, 6.0, 25).tolist()
    lines = name_lines(shares, sizes, 40.0)
    spans: dict[int, list[tuple[float, float]]] = {}
    for share, size, line in zip(shares, sizes, lines, strict=True):
        middle = min(max(40.0 * share, size / 2), 40.0 - size / 2)
        spans.setdefault(line, []).append((middle - size / 2, middle + size / 2))
    spans.pop(HIDDEN, None)
    assert sum(map(len, spans.values())) >= 20
    for row in spans.values():
        assert row[0][0] >= 0.0
        assert row[-1][1] <= 40.0 + 1e-9
        assert all(one[1] < two[0] for one, two in zip(row, row[1:], strict=False))
    assert name_lines([0.1, 0.5, 0.9], [2.0, 2.0, 2.0], 40.0) == [0, 0, 0]


def test_tags_keep_off_names_robots_and_the_rim_and_stay_where_they_are(
    make_scene,
) -> None:
    (robot,) = make_scene().robots
    tag = Tag(robot, "#0072B2", height=720)
    spot, size = np.array([300.0, 200.0]), (600, 400)

    def center(
        at: np.ndarray, named: list[tuple[np.ndarray, np.ndarray]]
    ) -> np.ndarray:
        (above,) = place_tags([tag], np.array([at]), [20.0], named, size)
        picture = np.zeros((400, 600, 3), dtype=np.uint8)
        tag.blit(picture, above, 0.5)
        rows, columns = np.nonzero(picture.any(axis=2))
        assert (rows.max() - rows.min() + 1, columns.max() - columns.min() + 1) == (
            2 * tag.half[1],
            2 * tag.half[0],
        )  # nothing was cut off
        return np.array([columns.mean(), rows.mean()])

    assert center(spot, [])[1] < 200.0 - 20.0  # above
    name = (np.array([300.0, 160.0]), np.array([30.0, 12.0]))
    assert center(spot, [name])[1] > 200.0 + 20.0  # below
    assert center(spot, [])[1] > 200.0 + 20.0  # and stays there
    assert center(np.array([300.0, 390.0]), [])[1] < 390.0


def test_page_s_timeline_marks_names_that_have_no_room(make_scene, make_plan) -> None:
    goals = [
        {"id": f"dock_{n:02d}", "circle": {"center": [5.0 + 0.05 * n, 10], "radius": 1}}
        for n in range(30)
    ]
    scene = make_scene(goals=goals)
    still = [(0.0, 0.0)] * 50
    tour = tuple(goal["id"] for goal in goals[:18])
    page = timeline(scene, make_plan(scene, {"r1": still}, {"r1": tour}), None)
    assert len(re.findall(r'<s class="goal', page)) == 18
    assert len(re.findall(r'<s class="goal no-wide no-narrow"', page)) == 18 - 8
