"""The video of a mission, drawn from the log; nothing is simulated again."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import av
import numpy as np

from mrmg import storage
from mrmg.plans import Plan
from mrmg.scene.types import Scene
from mrmg.simulation.log import ExecutionLog
from mrmg.viz.film import Film, Stage
from mrmg.viz.ground_image import paint_ground
from mrmg.viz.video_options import frame_ticks, video_options
from mrmg.viz.world_view import open_view

Progress = Callable[[float, str], None]

_CRF, _PRESET = "22", "veryfast"
_FITTING_S = 30.0


def render_video(
    scene: Scene,
    plan: Plan,
    log: ExecutionLog,
    path: str | Path,
    *,
    view: str = "top",
    robot: str | None = None,
    speed: float | None = None,
    size: tuple[int, int] = (1280, 720),
    fps: int = 30,
    from_s: float = 0.0,
    to_s: float | None = None,
    on_progress: Progress | None = None,
) -> None:
    """Render the driven mission to an MP4 file (H.264, yuv420p).

    Args:
        scene: the map.
        plan: adds the planned paths and tours.
        log: what is shown.
        path: file to write, atomically.
        view: one of `video_options.VIEWS`.
        robot: id of the robot the chase camera follows; None takes the first.
        speed: mission seconds per second of video; None fits the window to half a
            minute.
        size: width and height [pixels], even.
        fps: frames per second.
        from_s: mission time of the first frame.
        to_s: mission time of the last frame at the latest; None is the log's end.
        on_progress: called with the share done and a text.

    Raises:
        UsageError: if an option is out of its range; names it.
        MachineError: if this machine has no OpenGL that draws offscreen.
    """
    options = video_options(
        scene,
        log,
        view=view,
        robot=robot,
        speed=speed,
        size=size,
        fps=fps,
        from_s=from_s,
        to_s=to_s,
        fitting_s=_FITTING_S,
    )
    ticks = frame_ticks(log, options)
    with storage.atomic_path(Path(path)) as temporary:
        _write_video(temporary, Film(scene, plan, log, options), ticks, on_progress)


def pictures(
    film: Film, ticks: np.ndarray, on_progress: Progress | None = None
) -> Iterator[np.ndarray]:
    """Yield the picture of each tick, shape (height, width, 3) of bytes.

    Args:
        film: what is shown.
        ticks: of the log, not decreasing.
        on_progress: called with the share done and a text.

    Raises:
        MachineError: if this machine has no OpenGL that draws offscreen.
    """
    ground = paint_ground(film.scene, film.plan, film.frame, film.em_m)
    # All of a chase is drawn anew in every frame, where moving edges are seldom seen.
    smooth = film.options.view != "chase"
    with open_view(film.world, ground, film.options.size, smooth=smooth) as view:
        stage = Stage(film, view, ground)
        for number, tick in enumerate(ticks):
            yield stage.draw(int(tick))
            if on_progress is not None:
                on_progress((number + 1) / len(ticks), "rendering video")


def _write_video(
    path: Path, film: Film, ticks: np.ndarray, on_progress: Progress | None
) -> None:
    width, height = film.options.size
    options = {"movflags": "faststart"}
    with av.open(str(path), "w", format="mp4", options=options) as box:
        stream = box.add_stream("libx264", rate=film.options.fps)
        stream.width, stream.height, stream.pix_fmt = width, height, "yuv420p"
        stream.options = {"preset": _PRESET, "crf": _CRF}
        for picture in pictures(film, ticks, on_progress):
            frame = av.VideoFrame.from_ndarray(picture, format="rgb24")
            box.mux(stream.encode(frame))
        box.mux(stream.encode(None))
