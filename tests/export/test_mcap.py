"""Recordings, read back by the readers of MCAP and of rosbags."""

from __future__ import annotations

from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely

from mrmg.cli.main import main
from mrmg.errors import ExitCode
from mrmg.export.exporting import export_run
from mrmg.export.ros_messages import ros_names
from mrmg.scene.loading import load_scene
from mrmg.simulation.log import ExecutionLog

reader = pytest.importorskip("mcap.reader")
decoder = pytest.importorskip("mcap_ros2.decoder")
Recording = dict[str, list[tuple[float, Any]]]


def read(path: Path) -> Recording:
    """Return (time, message) by topic, as the reader of MCAP has it."""
    found: Recording = defaultdict(list)
    last_ns = 0
    with path.open("rb") as file:
        factories = [decoder.DecoderFactory()]
        messages = reader.make_reader(file, decoder_factories=factories)
        for _, channel, message, content in messages.iter_decoded_messages(
            log_time_order=False
        ):
            assert message.log_time >= last_ns, "messages are in order of time"
            last_ns = message.log_time
            found[channel.topic].append((message.log_time / 1e9, content))
    return found


@pytest.fixture(scope="module")
def path(quickstart_run: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("export")
    return export_run(quickstart_run, "mcap", out=folder / "drive.mcap")[0]


@pytest.fixture(scope="module")
def recording(path: Path) -> Recording:
    return read(path)


def yaw(turn: Any) -> float:
    return float(2.0 * np.arctan2(turn.z, turn.w))


def test_frames_and_poses_are_those_of_the_log(
    recording: Recording, quickstart_run: Path
) -> None:
    log = ExecutionLog.load(quickstart_run)
    poses: dict[str, list[Any]] = defaultdict(list)
    for time_s, message in recording["/tf"]:
        for each in message.transforms:
            assert each.header.frame_id == "map"
            stamp = each.header.stamp
            assert stamp.sec + 1e-9 * stamp.nanosec == pytest.approx(time_s, abs=1e-9)
            where, turn = each.transform.translation, each.transform.rotation
            robot = each.child_frame_id.removesuffix("/base_link")
            poses[robot].append((time_s, where.x, where.y, where.z, yaw(turn)))
    for robot in log.robots:
        for time_s, message in recording[f"/{robot}/pose"]:
            at, turn = message.pose.position, message.pose.orientation
            poses[f"{robot} pose"].append((time_s, at.x, at.y, at.z, yaw(turn)))
    for index, robot in enumerate(log.robots):
        for name in (robot, f"{robot} pose"):
            rows = np.array(poses[name])
            ticks = np.round(rows[:, 0] / log.control_period_s).astype(int)
            state = log.state[index, ticks]
            assert np.array_equal(rows[:, 1:3], state[:, :2])
            assert (rows[:, 3] == 0.0).all()
            assert np.cos(rows[:, 4] - state[:, 2]) == pytest.approx(1.0)
            assert rows[0, 0] == 0.0
            assert rows[-1, 0] == pytest.approx(log.time_s[-1])
            assert np.diff(rows[:, 0]).max() < 0.11


def test_the_battery_is_that_of_the_audit(recording: Recording) -> None:
    for robot in ("r1", "r2"):
        messages = [message for _, message in recording[f"/{robot}/battery"]]
        share = np.array([message.percentage for message in messages])
        assert share[0] == 1.0
        assert (share > 0.0).all()
        charging = [message.power_supply_status == 1 for message in messages]
        rises = np.diff(share) > 0.0
        assert (rises <= np.logical_or(charging[1:], charging[:-1])).all()


def test_the_map_has_every_obstacle(recording: Recording) -> None:
    scene = load_scene("quickstart")
    (_, grid) = recording["/map"][0]
    info = grid.info
    values = np.reshape(grid.data, (info.height, info.width))
    row, column = np.mgrid[: info.height, : info.width]
    x = info.origin.position.x + info.resolution * column
    y = info.origin.position.y + info.resolution * row
    obstacles = shapely.union_all([item.shape for item in scene.obstacles])
    shapely.prepare(obstacles)

    def touched(wider_m: float) -> np.ndarray:
        end = info.resolution + wider_m
        cells = shapely.box(x - wider_m, y - wider_m, x + end, y + end)
        return np.asarray(shapely.intersects(obstacles, cells))

    rounding_m = 1e-4  # the resolution has single precision
    assert (values[touched(-rounding_m)] == 100).all()
    assert (values[~touched(rounding_m)] == 0).all()


def test_markers_show_scene_goals_and_robots(recording: Recording) -> None:
    scene = load_scene("quickstart")
    (_, things) = recording["/scene"][0]
    areas = {}
    for marker in things.markers:
        corners = np.array([(p.x, p.y, p.z) for p in marker.points]).reshape(-1, 3)
        if marker.ns.startswith("obstacle "):
            triangles = corners.reshape(-1, 3, 3)
            top = triangles[(triangles[:, :, 2] == corners[:, 2].max()).all(axis=1)]
            areas[marker.ns.split()[1]] = shapely.area(shapely.polygons(top)).sum()
    assert areas == pytest.approx(
        {item.id: item.shape.area for item in scene.obstacles}
    )
    names = {(marker.ns, marker.id) for marker in things.markers}
    assert len(names) == len(things.markers), "viewers tell markers apart by these"
    (start_s, goals), *visits = recording["/goals"]
    assert start_s == 0.0
    assert {m.text for m in goals.markers if m.text} == {g.id for g in scene.goals}
    assert {m.text for _, each in visits for m in each.markers if m.text} == {
        goal.id for goal in scene.goals
    }
    (_, robots) = recording["/robots"][0]
    assert {m.header.frame_id for m in robots.markers} == {
        "r1/base_link",
        "r2/base_link",
    }
    assert all(marker.frame_locked for marker in robots.markers)


def test_paths_end_where_robots_do(recording: Recording, quickstart_run: Path) -> None:
    log = ExecutionLog.load(quickstart_run)
    for index, robot in enumerate(log.robots):
        for kind, state in (
            ("planned", log.reference[index]),
            ("driven", log.state[index]),
        ):
            (_, path) = recording[f"/{robot}/{kind}_path"][0]
            points = np.array(
                [(p.pose.position.x, p.pose.position.y) for p in path.poses]
            )
            line = shapely.LineString(points)
            off_m = shapely.distance(shapely.points(state[:, :2]), line)
            assert off_m.max() < 0.03
            assert points[-1] == pytest.approx(state[-1, :2], abs=1e-3)


def test_rosbags_reads_every_message(path: Path, recording: Recording) -> None:
    highlevel = pytest.importorskip("rosbags.highlevel")
    with highlevel.AnyReader([path]) as bag:
        counts: dict[str, int] = defaultdict(int)
        for connection, _, raw in bag.messages():
            bag.deserialize(raw, connection.msgtype)
            counts[connection.topic] += 1
    assert counts == {topic: len(messages) for topic, messages in recording.items()}


@pytest.mark.slow
def test_robots_drive_on_the_slopes(tmp_path: Path) -> None:
    """The frames follow the ground: their z axis is its normal."""
    scene, folder = load_scene("hills"), tmp_path / "run"
    assert main(["plan", "hills", "--out", str(folder)]) == ExitCode.OK
    recorded = read(export_run(folder, "mcap")[0])
    elevation = scene.elevation
    assert elevation is not None
    for _, message in recorded["/tf"][::50]:
        for each in message.transforms:
            at, turn = each.transform.translation, each.transform.rotation
            where = np.array([[at.x, at.y]])
            assert at.z == pytest.approx(elevation.height_at(where)[0])
            x, y, z, w = turn.x, turn.y, turn.z, turn.w
            up = np.array(
                [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)]
            )
            slope = elevation.gradient_at(where)[0]
            normal = np.array([-slope[0], -slope[1], 1.0])
            assert up == pytest.approx(normal / np.linalg.norm(normal))


def test_names_of_topics_are_valid_and_differ() -> None:
    names = ros_names(["r-1", "r.1", "r_1", "1"])
    assert len({*names.values()}) == 4
    assert all(name.isidentifier() for name in names.values())
