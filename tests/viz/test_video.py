"""The video: a playable file that shows what the log says, frame by frame."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import av
import numpy as np
import pytest

from mrmg.energy.audit import audit
from mrmg.errors import UsageError
from mrmg.runs.arguments import VideoArguments
from mrmg.simulation.disturbance import Disturbance, RobotDisturbance
from mrmg.simulation.simulation import simulate
from mrmg.viz import style
from mrmg.viz.film import Film, Stage
from mrmg.viz.ground_image import paint_ground
from mrmg.viz.video import render_video
from mrmg.viz.video_options import VideoOptions, frame_ticks, video_options
from mrmg.viz.world_view import open_view, top_camera

OPTIONS = VideoOptions(
    view="top", robot=None, speed=2.0, size=(640, 360), fps=10, from_s=0.0, to_s=1e9
)


@pytest.fixture
def mission(make_scene, make_plan, straight):
    """Two cars drive 12 m side by side; the first passes a station and a goal."""
    scene = make_scene(
        stations=[{"id": "s", "circle": {"center": [10, 10], "radius": 1}}],
        terrain=[{"circle": {"center": [30, 5], "radius": 3}, "multiplier": 2}],
        obstacles=[{"box": {"center": [33, 15], "size": [4, 3]}}],
        robots=[
            {"id": "r1", "model": "car", "pose": [5, 10, 0]},
            {"id": "r2", "model": "car", "pose": [5, 15, 0]},
        ],
    )
    controls = {"r1": straight(12.0), "r2": straight(12.0)}
    plan = make_plan(scene, controls, {"r1": ("s", "g"), "r2": ()})
    return scene, plan, simulate(scene, plan)


def decoded(path: Path) -> list[av.VideoFrame]:
    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        assert stream.codec_context.name == "h264"
        return list(container.decode(stream))


@pytest.mark.quick("split")
@pytest.mark.parametrize("view", ["top", "chase", "split"])
def test_file_plays_with_all_frames_and_is_not_blank(mission, view, tmp_path) -> None:
    scene, plan, log = mission
    path, output = tmp_path / "mission.mp4", []
    render_video(
        scene,
        plan,
        log,
        path,
        view=view,
        speed=4.0,
        size=(640, 360),
        fps=5,
        on_progress=lambda fraction, _: output.append(fraction),
    )
    frames = decoded(path)
    assert len(frames) == int(log.time_s[-1] / (4.0 / 5)) + 1
    assert output == pytest.approx([(n + 1) / len(frames) for n in range(len(frames))])
    for frame in (frames[0], frames[-1]):
        assert (frame.width, frame.height) == (640, 360)
        assert frame.format.name == "yuv420p"
        assert frame.to_ndarray(format="rgb24").std() > 20
    assert [item.name for item in tmp_path.iterdir()] == ["mission.mp4"]


def test_frames_show_the_log_at_their_time(mission) -> None:
    scene, _, log = mission
    ticks = frame_ticks(log, replace(OPTIONS, from_s=1.0, to_s=3.0))
    expected_s = 1.0 + 0.2 * np.arange(11)
    assert log.time_s[ticks] == pytest.approx(expected_s, abs=log.control_period_s)
    whole = frame_ticks(log, OPTIONS)
    assert log.time_s[whole[-1]] == pytest.approx(log.time_s[-1], abs=0.2)


def test_fast_drawing_from_above_equals_drawing_everything(mission) -> None:
    """The oracle is one plain picture of the whole world at the same time."""
    scene, plan, log = mission
    film = Film(scene, plan, log, OPTIONS)
    ground = paint_ground(scene, plan, film.frame)
    with open_view(film.world, ground, OPTIONS.size) as view:
        stage = Stage(film, view)
        tick = len(log.time_s) // 2
        pane = stage.draw(tick)[film.main_pane].astype(int)
        view.place(log.qpos[tick])
        camera = top_camera(film.map_frame.center_m)
        size, height_m = film.map_frame.size, 2.0 * film.map_frame.half_m[1]
        whole = view.draw(camera, size, fovy=height_m, shadows=False)
    # Trails and tags are extra; where neither is, the pictures agree.
    different = np.abs(pane - whole.astype(int)).max(axis=2) > 12
    assert different.mean() < 0.03
    for at_m in log.state[:, tick, :2]:
        # Ahead of the rear axle there is the body, and no trail yet.
        column, row = film.map_frame.to_pixels(at_m + (0.9, 0.0))
        body = np.s_[int(row) - 2 : int(row) + 3, int(column) - 3 : int(column) + 4]
        assert not different[body].any()


def test_visited_goals_and_driven_trails_take_the_robot_s_color(mission) -> None:
    scene, plan, log = mission
    film = Film(scene, plan, log, OPTIONS)
    ground = paint_ground(scene, plan, film.frame)

    def pixel(picture: np.ndarray, x_m: float, y_m: float) -> np.ndarray:
        column, row = film.map_frame.to_pixels(np.array([x_m, y_m]))
        return picture[film.main_pane][int(row), int(column)].astype(int)

    with open_view(film.world, ground, OPTIONS.size) as view:
        stage = Stage(film, view)
        first = stage.draw(0)
        last = stage.draw(len(log.time_s) - 1)
    blue = np.array(style.rgb(film.colors["r1"]))
    orange = np.array(style.rgb(film.colors["r2"]))
    beside_path = (14.6, 9.4)
    assert pixel(first, *beside_path).min() > 200
    assert np.abs(pixel(last, *beside_path) - blue).max() < 50
    assert np.abs(pixel(last, 10.0, 15.0) - orange).max() < 25


def test_readings_are_those_of_the_log(mission) -> None:
    scene, plan, log = mission
    film = Film(scene, plan, log, OPTIONS)
    start, end = film.reading(0), film.reading(len(log.time_s) - 1)
    assert start.visited == {}
    assert [robot.heading_for for robot in start.robots] == ["⚡s", ""]
    assert start.robots[0].charge == 1.0
    assert end.visited == {"g": "r1"}
    assert end.robots[0].heading_for == ""
    drawn_J = sum(
        robot.battery.capacity_J * (1.0 - reading.charge)
        for robot, reading in zip(scene.robots[1:], end.robots[1:], strict=True)
    )
    assert 0.0 < drawn_J < end.used_J
    assert end.used_J == pytest.approx(plan.cost_J, rel=0.05)


def test_a_robot_heads_for_what_follows_its_last_visit(missing, make_log) -> None:
    scene, plan = missing()
    log = make_log(scene, plan)
    film = Film(scene, plan, log, OPTIONS)
    ends = [film.reading(tick).robots[0] for tick in (0, len(log.time_s) - 1)]
    assert [robot.heading_for for robot in ends] == ["h", ""]  # it never was at h


def test_charge_is_that_of_the_battery_a_robot_really_has(
    make_scene, make_plan, make_log, straight
) -> None:
    scene = make_scene()
    plan = make_plan(scene, {"r1": straight(12.0)}, {"r1": ("g",)})
    less = RobotDisturbance(robot="r1", capacity=-0.5)
    log = replace(
        make_log(scene, plan), disturbance=Disturbance(seed=0, robots=(less,))
    )
    film = Film(scene, plan, log, OPTIONS)
    charges = [film.reading(at).robots[0].charge for at in range(len(log.time_s))]
    assert charges[0] == 1.0
    found = audit(scene, plan, log).robot("r1")
    assert min(charges) == pytest.approx(found.min_charge_fraction)
    assert film.scene.robots[0].battery.reserve_fraction == pytest.approx(0.1)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"view": "side"}, "view: 'side'; allowed: top, chase, split"),
        ({"robot": "r9"}, "use one of r1, r2"),
        ({"speed": 0.0}, "speed: 0.0 is not a positive number"),
        ({"speed": float("nan")}, "speed: nan is not a positive number"),
        ({"fps": 0}, "fps: 0 is not a whole number of at least 1"),
        ({"fps": 121}, "1 to 120"),
        ({"size": (641, 360)}, "even numbers"),
        ({"size": (64, 36)}, "even numbers"),
        ({"from_s": 5.0, "to_s": 3.0}, "time window"),
        ({"from_s": 1e6}, "time window"),
        ({"speed": 1e-9}, r"speed 1e-09 makes .* frames, more than 1,000,000; raise"),
        ({"speed": 1e-320}, "makes inf frames, more than 1,000,000"),
    ],
)
def test_options_out_of_range_are_refused(
    change, words, make_scene, make_plan, make_log, straight
) -> None:
    scene = make_scene(
        robots=[
            {"id": "r1", "model": "car", "pose": [5, 10, 0]},
            {"id": "r2", "model": "car", "pose": [5, 15, 0]},
        ]
    )
    controls = {"r1": straight(12.0), "r2": straight(12.0)}
    log = make_log(scene, make_plan(scene, controls, {"r1": ("g",), "r2": ()}))
    with pytest.raises(UsageError, match=words):
        video_options(scene, log, VideoArguments(**change), 30.0)


def test_a_gif_is_no_video(mission, tmp_path) -> None:
    with pytest.raises(UsageError, match="render_gif"):
        render_video(*mission, tmp_path / "mission.mp4", gif=True)
