"""What is asked of a video or a GIF: checked, and completed from the log."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mrmg.errors import UsageError
from mrmg.scene.types import Scene
from mrmg.simulation.log import ExecutionLog

VIEWS = ("top", "chase", "split")
"""What a video can show."""


@dataclass(frozen=True, slots=True, kw_only=True)
class VideoOptions:
    """How a video is to look.

    Attributes:
        view: one of `VIEWS`.
        robot: id of the robot the chase camera follows; None takes the first.
        speed: mission seconds per second.
        size: width and height [pixels].
        fps: frames per second.
        from_s, to_s: mission time of the first frame, and of the last at the latest.
    """

    view: str
    robot: str | None
    speed: float
    size: tuple[int, int]
    fps: int
    from_s: float
    to_s: float


def video_options(
    scene: Scene,
    log: ExecutionLog,
    *,
    view: str,
    robot: str | None,
    speed: float | None,
    size: tuple[int, int],
    fps: int,
    from_s: float,
    to_s: float | None,
    fitting_s: float,
) -> VideoOptions:
    """Return options with nothing left open.

    Args:
        scene: of the mission.
        log: what is shown.
        view: as in `VideoOptions`, like all that follow.
        robot: followed by the chase camera.
        speed: None takes the least whole number that fits the part of the mission to
            `fitting_s`.
        size: of the pictures [pixels].
        fps: frames per second.
        from_s: mission time of the first frame.
        to_s: None is the log's end.
        fitting_s: length that is aimed at.

    Raises:
        UsageError: if an option is out of its range; names it.
    """
    end_s = float(log.time_s[-1]) if to_s is None else to_s
    options = VideoOptions(
        view=view,
        robot=robot,
        speed=fitting_speed(end_s - from_s, fitting_s) if speed is None else speed,
        size=size,
        fps=fps,
        from_s=from_s,
        to_s=end_s,
    )
    _check(scene, log, options)
    return options


def frame_ticks(log: ExecutionLog, options: VideoOptions) -> np.ndarray:
    """Return the tick of the log each frame shows, shape (frames,)."""
    end_s = min(options.to_s, float(log.time_s[-1]))
    step_s = options.speed / options.fps
    count = int((end_s - options.from_s) / step_s + 1e-9) + 1
    time_s = options.from_s + step_s * np.arange(count)
    after = np.searchsorted(log.time_s, time_s + 1e-9, side="right")
    return np.asarray(np.maximum(after - 1, 0))


def fitting_speed(window_s: float, video_s: float) -> float:
    """Return the least whole speed that fits a window of the mission to `video_s`."""
    return float(max(np.ceil(window_s / video_s), 1.0))


def _check(scene: Scene, log: ExecutionLog, options: VideoOptions) -> None:
    ids = [robot.id for robot in scene.robots]
    end_s = float(log.time_s[-1])
    width, height = options.size
    faults = {
        f"view {options.view!r} is unknown; use one of {', '.join(VIEWS)}": (
            options.view not in VIEWS
        ),
        f"robot {options.robot!r} is not in the scene; use one of {', '.join(ids)}": (
            options.robot is not None and options.robot not in ids
        ),
        f"speed {options.speed:g} must be greater than 0": not options.speed > 0.0,
        f"fps {options.fps} must be 1 to 120": not 1 <= options.fps <= 120,
        f"size {width}x{height} must be even numbers, 320x240 to 3840x2160": (
            width % 2 != 0
            or height % 2 != 0
            or not (320 <= width <= 3840 and 240 <= height <= 2160)
        ),
        f"the time window {options.from_s:g} to {options.to_s:g} s must lie within "
        f"0 to {end_s:g} s": not 0.0 <= options.from_s <= min(options.to_s, end_s),
    }
    for message, wrong in faults.items():
        if wrong:
            raise UsageError(message)
