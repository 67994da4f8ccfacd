"""The GIF: small, of the right length, and clean where nothing moves."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from mrmg.cli.main import main
from mrmg.errors import ExitCode, UsageError
from mrmg.plans import Plan
from mrmg.scene.loading import load_scene
from mrmg.simulation.log import ExecutionLog
from mrmg.viz.gif import LARGEST_BYTES, render_gif, write_gif


def noise(count: int, size: tuple[int, int]) -> list[Image.Image]:
    random = np.random.default_rng(1)
    shape = (size[1], size[0], 3)
    return [
        Image.fromarray(random.integers(0, 256, shape, dtype=np.uint8))
        for _ in range(count)
    ]


def test_gif_of_a_mission_has_a_picture_per_tenth_of_a_second(
    quickstart_run: Path, tmp_path: Path
) -> None:
    scene = load_scene(quickstart_run / "scene.yaml")
    plan, log = Plan.load(quickstart_run), ExecutionLog.load(quickstart_run)
    path = tmp_path / "m.gif"
    render_gif(scene, plan, log, path, speed=10.0, from_s=5.0, to_s=15.0)
    assert path.stat().st_size < LARGEST_BYTES
    with Image.open(path) as gif:
        assert (gif.n_frames, gif.size, gif.info["loop"]) == (11, (800, 450), 0)
        assert gif.info["duration"] == 100
        first = np.asarray(gif.convert("RGB"))
        gif.seek(10)
        last = np.asarray(gif.convert("RGB"))
    moved = (first != last).any(axis=2).mean()
    assert 0.0 < moved < 0.2


def test_what_stays_still_between_things_that_move_costs_nothing(
    tmp_path: Path,
) -> None:
    [still] = noise(1, (160, 90))
    frames = []
    for step in range(10):
        frame = still.copy()
        for corner in ((step, 0), (150 - step, 80)):
            frame.paste((255, 0, 0), (*corner, corner[0] + 6, corner[1] + 6))
        frames.append(frame)
    write_gif(frames[:1], tmp_path / "one.gif")
    write_gif(frames, tmp_path / "all.gif")
    one = (tmp_path / "one.gif").stat().st_size
    assert one < (tmp_path / "all.gif").stat().st_size < 1.5 * one


def test_a_gif_that_is_too_large_gets_smaller_pictures(tmp_path: Path) -> None:
    frames = noise(6, (160, 90))
    write_gif(frames, tmp_path / "large.gif")
    largest = (tmp_path / "large.gif").stat().st_size
    write_gif(frames, tmp_path / "m.gif", largest_bytes=largest)
    assert (tmp_path / "m.gif").stat().st_size < largest
    with Image.open(tmp_path / "m.gif") as gif:
        assert gif.n_frames == 6
        assert gif.size == (128, 72)


def test_a_gif_that_cannot_be_small_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="0.001 MB.*--speed"):
        write_gif(noise(6, (160, 90)), tmp_path / "m.gif", largest_bytes=1000)


def test_too_long_a_gif_is_refused_before_anything_is_drawn(
    quickstart_run: Path, tmp_path: Path
) -> None:
    scene = load_scene(quickstart_run / "scene.yaml")
    plan, log = Plan.load(quickstart_run), ExecutionLog.load(quickstart_run)
    with pytest.raises(UsageError, match="--from and --to"):
        render_gif(scene, plan, log, tmp_path / "m.gif", speed=0.1)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_the_command_shows_a_part_from_a_robot_s_place(
    own_run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    small = ["--size", "320x240", "--fps", "5", "--speed", "4"]
    part = ["--from", "10", "--to", "14", "--view", "chase", "--robot", "r2"]
    assert main(["render", str(own_run), *small, *part, "--gif"]) == ExitCode.OK
    output = capsys.readouterr().out.split()
    assert [Path(line).name for line in output] == [
        "overview.png",
        "energy.png",
        "mission.gif",
        "mission.mp4",
        "report.html",
    ]
    with Image.open(own_run / "mission.gif") as gif:
        assert gif.n_frames == 11
    again = [*small, *part, "--robot", "r1", "--no-gif"]
    assert main(["render", str(own_run), *again]) == ExitCode.OK
    assert not (own_run / "mission.gif").exists()


@pytest.mark.parametrize(
    ("option", "named"),
    [
        (["--robot", "r9"], "use one of r1, r2"),
        (["--from", "20", "--to", "10"], "time window"),
        (["--from", "1e6"], "time window"),
    ],
)
def test_wrong_parts_and_robots_leave_the_run_as_it_was(
    own_run: Path, option: list[str], named: str, capsys: pytest.CaptureFixture[str]
) -> None:
    report = (own_run / "report.html").read_bytes()
    assert main(["render", str(own_run), *option]) == ExitCode.USAGE
    assert named in capsys.readouterr().err
    assert (own_run / "report.html").read_bytes() == report
