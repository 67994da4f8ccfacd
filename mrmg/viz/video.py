"""The video of a mission, drawn from the log; nothing is simulated again."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import av
import numpy as np

from mrmg import storage
from mrmg.errors import UsageError, require_types
from mrmg.plans import Plan
from mrmg.runs.arguments import VideoArguments
from mrmg.runs.options import documented
from mrmg.scene.types import Scene
from mrmg.simulation.log import ExecutionLog
from mrmg.viz.film import Film, Stage
from mrmg.viz.ground_image import paint_ground
from mrmg.viz.video_options import frame_ticks, video_options
from mrmg.viz.world_view import open_view

Progress = Callable[[float, str], None]

_CRF, _PRESET = "22", "veryfast"
_FITTING_S = 30.0


@documented(VideoArguments)
def render_video(
    scene: Scene,
    plan: Plan,
    log: ExecutionLog,
    path: str | Path,
    *,
    on_progress: Progress | None = None,
    **options: Any,
) -> None:
    """Render the driven mission to an MP4 file (H.264, yuv420p).

    Args:
        scene: the map.
        plan: adds the planned paths and tours.
        log: what is shown.
        path: file to write, atomically.
        on_progress: called with the share done and a text.
        **options: fields of `VideoArguments`, which are the options of `mrmg render`:

    Raises:
        UsageError: if an option is out of its range; names it.
        MachineError: if this machine has no OpenGL that draws offscreen.
    """
    if options.get("gif"):
        raise UsageError("gif: this writes an MP4; viz.gif.render_gif writes a GIF")
    require_types((scene, Scene), (plan, Plan), (log, ExecutionLog))
    made = video_options(scene, log, VideoArguments(**options), _FITTING_S)
    ticks = frame_ticks(log, made)
    with storage.atomic_path(Path(path)) as temporary:
        _write_video(temporary, Film(scene, plan, log, made), ticks, on_progress)


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
        stage = Stage(film, view)
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
