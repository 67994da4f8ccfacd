"""Options of a video or a GIF: checked, and completed from the log."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass

import numpy as np

from mrmg.errors import UsageError
from mrmg.runs.arguments import VideoArguments
from mrmg.scene.types import Scene
from mrmg.simulation.log import ExecutionLog

MOST_FRAMES = 1_000_000
"""Frames of a video at most: nine hours of it at 30 a second."""


@dataclass(frozen=True, slots=True, kw_only=True)
class VideoOptions(VideoArguments):
    """How a video is made, with nothing left open.

    Attributes:
        speed: mission seconds per second.
        to_s: mission time of the last frame at the latest.
    """

    speed: float = 1.0
    to_s: float = math.inf


def video_options(
    scene: Scene, log: ExecutionLog, asked: VideoArguments, fitting_s: float
) -> VideoOptions:
    """Return options with nothing left open.

    Args:
        scene: of the mission.
        log: what is shown.
        asked: what is given; by default everything is shown, at the least whole speed
            that fits it to `fitting_s`.
        fitting_s: length that is aimed at.

    Raises:
        UsageError: if an option is out of its range; names it.
    """
    given = asdict(asked)
    end_s = float(log.time_s[-1]) if asked.to_s is None else asked.to_s
    fitting = float(max(np.ceil((end_s - asked.from_s) / fitting_s), 1.0))
    speed = asked.speed or fitting
    options = VideoOptions(**{**given, "to_s": end_s, "speed": speed})
    _check(scene, log, options)
    return options


def frame_ticks(log: ExecutionLog, options: VideoOptions) -> np.ndarray:
    """Return the tick of the log each frame shows, shape (frames,)."""
    end_s = min(options.to_s, float(log.time_s[-1]))
    step_s = options.speed / options.fps
    count = int((end_s - options.from_s) / step_s + 1e-9) + 1
    return ticks_at(log, options.from_s + step_s * np.arange(count))


def ticks_at(log: ExecutionLog, time_s: np.ndarray) -> np.ndarray:
    """Return the last tick of a log that is not after each time, at least the first."""
    after = np.searchsorted(log.time_s, time_s + 1e-9, side="right")
    return np.asarray(np.maximum(after - 1, 0))


def _check(scene: Scene, log: ExecutionLog, options: VideoOptions) -> None:
    ids = [robot.id for robot in scene.robots]
    end_s = float(log.time_s[-1])
    width, height = options.size
    frames = (min(options.to_s, end_s) - options.from_s) / options.speed * options.fps
    faults = {
        f"robot {options.robot!r} is not in the scene; use one of {', '.join(ids)}": (
            options.robot is not None and options.robot not in ids
        ),
        f"fps {options.fps} must be 1 to 120": not 1 <= options.fps <= 120,
        f"size {width}x{height} must be even numbers, 320x240 to 3840x2160": (
            width % 2 != 0
            or height % 2 != 0
            or not (320 <= width <= 3840 and 240 <= height <= 2160)
        ),
        f"the time window {options.from_s:g} to {options.to_s:g} s must lie within "
        f"0 to {end_s:g} s": not 0.0 <= options.from_s <= min(options.to_s, end_s),
        f"speed {options.speed:g} makes {frames:.3g} frames, more than "
        f"{MOST_FRAMES:,}; raise it, or narrow the time window": frames > MOST_FRAMES,
    }
    for message, wrong in faults.items():
        if wrong:
            raise UsageError(message)
