"""Replays: a clock over the log, and the viewers that show it."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import urllib.request
from pathlib import Path

import mujoco
import numpy as np
import pytest

from mrmg.cli.main import main
from mrmg.errors import ExitCode, MachineError, RunFolderError
from mrmg.scene.loading import load_scene
from mrmg.simulation.world_model import build_world
from mrmg.viz import browser_view, native_view
from mrmg.viz.replay import replay_of, spoken
from mrmg.viz.solid_shapes import body_meshes, geom_mesh


@pytest.fixture(scope="module")
def replay(quickstart_run: Path):
    return replay_of(quickstart_run)


@pytest.fixture(autouse=True)
def rewound(replay) -> None:
    replay.time_s, replay.speed, replay.playing = 0.0, 4.0, False


def test_time_passes_only_while_playing(replay) -> None:
    replay.advance(1.0)
    assert replay.time_s == 0.0
    replay.toggle()
    replay.advance(1.5)
    assert replay.time_s == 6.0
    replay.toggle()
    replay.advance(1.0)
    assert replay.time_s == 6.0


def test_a_replay_stops_at_the_end_and_starts_over(replay) -> None:
    replay.toggle()
    replay.advance(1e6)
    assert (replay.time_s, replay.playing) == (replay.end_s, False)
    assert replay.tick == len(replay.film.log.time_s) - 1
    replay.toggle()
    assert (replay.time_s, replay.playing) == (0.0, True)


def test_ticks_are_the_last_ones_not_after_the_time(replay) -> None:
    time_s = replay.film.log.time_s
    for tick in (0, 1, 77, len(time_s) - 1):
        replay.seek(float(time_s[tick]))
        assert replay.tick == tick
    replay.seek(-5.0)
    assert replay.tick == 0
    replay.seek(float(time_s[77]) + 0.4 * float(time_s[1]))
    assert replay.tick == 77


def test_readings_in_words(replay) -> None:
    mission, robots = spoken(replay.film.scene, replay.reading())
    assert mission == "00:00.0, 0 of 4 goals, 0.0 kJ used"
    assert [name for name, _ in robots] == ["r1", "r2"]
    assert robots[0][1].startswith("100 %, 0.0 m/s, to ")
    replay.seek(replay.end_s)
    mission, robots = spoken(replay.film.scene, replay.reading())
    assert "4 of 4 goals" in mission
    assert all(words.endswith("tour done") for _, words in robots)


def test_a_run_that_was_not_driven_names_the_cure(own_run: Path) -> None:
    (own_run / "log.json").unlink()
    with pytest.raises(RunFolderError, match="mrmg execute"):
        replay_of(own_run)


@pytest.mark.parametrize(
    ("key", "time_s", "speed", "playing"),
    [
        (32, 10.0, 4.0, True),
        (262, 15.0, 4.0, False),
        (263, 5.0, 4.0, False),
        (265, 10.0, 8.0, False),
        (264, 10.0, 2.0, False),
        (65, 10.0, 4.0, False),
    ],
)
def test_keys_steer_the_replay(
    replay, key: int, time_s: float, speed: float, playing: bool
) -> None:
    replay.seek(10.0)
    native_view.steer(replay, key)
    assert (replay.time_s, replay.speed, replay.playing) == (time_s, speed, playing)


def test_speeds_end_at_the_fastest_and_the_slowest(replay) -> None:
    for _ in range(10):
        native_view.steer(replay, 265)
    assert replay.speed == 32.0
    for _ in range(10):
        native_view.steer(replay, 264)
    assert replay.speed == 1.0


@pytest.mark.parametrize("room", [3, 40, 1000])
def test_the_window_s_notes_fit_its_room(replay, room: int) -> None:
    film = replay.film
    extra = mujoco.MjvScene(film.world.model, maxgeom=room)
    replay.seek(replay.end_s)
    native_view.annotate(extra, film.scene, replay)
    notes = [extra.geoms[at] for at in range(extra.ngeom)]
    assert extra.ngeom <= room
    labels = [note.label for note in notes if note.label]
    wanted = ["g1", "g2", "g3", "g4", "s1"]
    assert labels[:5] == wanted[: len(labels)]
    if room == 1000:
        charge = replay.reading().robots[0].charge
        assert labels[5] == f"r1 {100 * charge:.0f} %"
        lines = [n for n in notes if n.type == mujoco.mjtGeom.mjGEOM_LINE]
        drawn_m = sum(float(n.size[2]) for n in lines)
        driven_m = np.hypot(*np.diff(film.log.state[:, :, :2], axis=1).T).sum()
        assert drawn_m == pytest.approx(driven_m, rel=0.02)


def test_the_window_s_only_control_is_the_time(replay) -> None:
    film = replay.film
    model = native_view.viewed_model(film.scene, film.world, replay)
    assert [model.actuator(at).name for at in range(model.nu)] == [native_view.TIME]
    assert model.actuator_ctrlrange.tolist() == [[0.0, replay.end_s]]
    # Joints would have sliders that do nothing.
    assert not mujoco.MjvOption().jointgroup[model.jnt_group].any()
    drawn, driven = mujoco.MjData(model), mujoco.MjData(film.world.model)
    drawn.qpos[:] = driven.qpos[:] = film.log.qpos[-1]
    mujoco.mj_kinematics(model, drawn)
    mujoco.mj_kinematics(film.world.model, driven)
    assert np.array_equal(drawn.xpos, driven.xpos)


def test_a_scene_s_window_has_no_controls() -> None:
    scene = load_scene("quickstart")
    model = native_view.viewed_model(scene, build_world(scene), None)
    assert model.nu == 0


def test_the_time_follows_the_slider_where_a_person_moved_it(replay) -> None:
    replay.seek(5.0)
    native_view.follow_slider(replay, 5.0)
    assert replay.time_s == 5.0
    native_view.follow_slider(replay, 12.5)
    assert replay.time_s == 12.5


def test_without_a_screen_the_window_is_refused(quickstart_run: Path) -> None:
    screenless = {
        name: value
        for name, value in os.environ.items()
        if name not in ("DISPLAY", "WAYLAND_DISPLAY")
    }
    answer = subprocess.run(
        [sys.executable, "-m", "mrmg", "view", str(quickstart_run), "--in", "window"],
        capture_output=True,
        text=True,
        env=screenless,
        check=False,
    )
    assert answer.returncode == ExitCode.MACHINE
    assert "'mrmg view --in browser' needs none" in answer.stderr
    assert len(answer.stderr.splitlines()) == 1


def test_shapes_are_where_mujoco_has_them() -> None:
    spec = mujoco.MjSpec.from_string("""
      <mujoco><worldbody><body pos="0 0 5">
        <geom type="box" size="1 2 3" pos="1 0 0" rgba="1 0 0 1"/>
        <geom type="cylinder" size="1 2" euler="90 0 0" rgba="0 1 0 1"/>
        <geom type="capsule" size="1 2" pos="0 3 0" rgba="0 1 0 1"/>
        <geom type="sphere" size="2" rgba="0 0 1 1"/>
        <geom type="ellipsoid" size="1 2 3" rgba="0 0 1 1"/>
        <geom type="box" size="1 1 1" group="3"/>
      </body></worldbody></mujoco>""")
    model = spec.compile()
    half = [[1, 2, 3], [1, 2, 1], [1, 1, 3], [2, 2, 2], [1, 2, 3]]
    centers = [[1, 0, 0], [0, 0, 0], [0, 3, 0], [0, 0, 0], [0, 0, 0]]
    for geom, (reach, center) in enumerate(zip(half, centers, strict=True)):
        low, high = geom_mesh(model, geom).bounds
        assert low == pytest.approx(np.subtract(center, reach), abs=0.05)
        assert high == pytest.approx(np.add(center, reach), abs=0.05)
    found = [(body, color) for body, color, _ in body_meshes(model)]
    assert found == [(1, (255, 0, 0)), (1, (0, 255, 0)), (1, (0, 0, 255))]


def test_every_obstacle_and_robot_of_a_world_has_a_shape() -> None:
    scene = load_scene("quickstart")
    world = build_world(scene)
    drawn = {body for body, _, _ in body_meshes(world.model)}
    for obstacle in scene.obstacles:
        assert world.model.body(f"obstacle:{obstacle.id}").id in drawn
    assert {*world.chassis.tolist()} <= drawn
    height_m = {
        body: mesh.bounds[1, 2]
        for body, _, mesh in body_meshes(world.model)
        if body not in world.chassis
    }
    for obstacle in scene.obstacles:
        body = world.model.body(f"obstacle:{obstacle.id}").id
        assert height_m[body] == pytest.approx(obstacle.height_m)


def test_the_page_shows_what_the_log_says(replay) -> None:
    pytest.importorskip("viser", reason="viser is not installed")
    page = browser_view.BrowserView(
        replay.film.scene, replay, host="127.0.0.1", port=18080
    )
    try:
        with urllib.request.urlopen(page.address) as answer:
            assert b"<html" in answer.read(500).lower()
        replay.seek(replay.end_s)
        page.show(replay.tick)
        scene, film = replay.film.scene, replay.film
        for goal in scene.goals:
            robot = replay.reading().visited[goal.id]
            wanted = [int(film.colors[robot][at : at + 2], 16) for at in (1, 3, 5)]
            assert list(page.targets[goal.id].color) == wanted
        for index, robot in enumerate(scene.robots):
            place = page.tags[robot.id].position
            chassis = film.log.state[index, -1, :2]
            assert np.hypot(*(np.array(place[:2]) - chassis)) < 2.0
            charge = replay.reading().robots[index].charge
            assert page.tags[robot.id].text == f"{robot.id} {100 * charge:.0f} %"
    finally:
        page.close()


def test_without_viser_the_cure_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "viser", None)
    scene = load_scene("quickstart")
    with pytest.raises(MachineError, match=r"pip install 'mrmg\[view\]'"):
        browser_view.BrowserView(scene, None, host="127.0.0.1", port=18081)


def test_an_address_of_another_machine_is_refused() -> None:
    pytest.importorskip("viser", reason="viser is not installed")
    scene = load_scene("quickstart")
    with pytest.raises(MachineError, match=r"cannot listen on 203\.0\.113\.7: "):
        browser_view.BrowserView(scene, None, host="203.0.113.7", port=18083)


@pytest.mark.quick("run")
@pytest.mark.parametrize("what", ["run", "scene"])
def test_the_command_serves_until_it_is_stopped(
    what: str, quickstart_run: Path
) -> None:
    pytest.importorskip("viser", reason="viser is not installed")
    source = str(quickstart_run) if what == "run" else "quickstart"
    arguments = ["view", source, "--in", "browser", "--port", "18082"]
    served = subprocess.Popen(
        [sys.executable, "-m", "mrmg", *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONUNBUFFERED": "1"},
    )
    assert served.stdout is not None
    line = served.stdout.readline()
    assert line.startswith("quickstart: open http://127.0.0.1:")
    with urllib.request.urlopen(line.split()[2]) as answer:
        assert answer.status == 200
    served.send_signal(signal.SIGINT)
    _, output = served.communicate()
    assert (served.returncode, output) == (130, "")


def test_a_file_that_is_neither_run_nor_scene_is_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["view", str(tmp_path / "no.yaml")]) == ExitCode.INVALID_FILE
    assert "no.yaml" in capsys.readouterr().err
