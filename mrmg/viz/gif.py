"""The mission as a GIF for pages that play no video: small, and without noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image, ImageOps

from mrmg import storage
from mrmg.errors import UsageError
from mrmg.plans import Plan
from mrmg.runs.arguments import VideoArguments
from mrmg.scene.types import Scene
from mrmg.simulation.log import ExecutionLog
from mrmg.viz.film import Film
from mrmg.viz.video import Progress, pictures
from mrmg.viz.video_options import frame_ticks, video_options

LARGEST_BYTES = 5_000_000
"""What pages that show a GIF accept."""

_SIZE = (800, 450)
_SHARES = (1.0, 0.8, 0.6, 0.45)
_FPS = 10
_FITTING_S = 12.0
_MOST_FRAMES = 400
_COLORS = 200
_SAMPLED_FRAMES = 6


def render_gif(
    scene: Scene,
    plan: Plan,
    log: ExecutionLog,
    path: Path,
    *,
    on_progress: Progress | None = None,
    **asked: Any,
) -> None:
    """Render the driven mission to a GIF of less than `LARGEST_BYTES`.

    It is 800 pixels wide, or less where that would be too large a file.

    Args:
        scene: the map.
        plan: adds the planned paths and tours.
        log: what is shown.
        path: file to write, atomically.
        on_progress: called with the share done and a text.
        **asked: fields of `VideoArguments`; by default the speed fits the mission to
            twelve seconds. The GIF has its own size and frames per second.

    Raises:
        UsageError: if an option is out of its range, or the GIF would be too large
            however small its pictures.
        MachineError: if this machine has no OpenGL that draws offscreen.
    """
    video = replace(VideoArguments(**asked), size=_SIZE, fps=_FPS)
    options = video_options(scene, log, video, _FITTING_S)
    ticks = frame_ticks(log, options)
    if len(ticks) > _MOST_FRAMES:
        raise UsageError(
            f"a GIF of {len(ticks)} pictures would be too large; choose a higher "
            "--speed, or a shorter part with --from and --to"
        )
    film = Film(scene, plan, log, options)
    frames = [Image.fromarray(item) for item in pictures(film, ticks, on_progress)]
    with storage.atomic_path(path) as temporary:
        write_gif(frames, temporary)


def write_gif(
    frames: Sequence[Image.Image], path: Path, *, largest_bytes: int = LARGEST_BYTES
) -> None:
    """Write pictures as a GIF, scaled down until it is small enough.

    Args:
        frames: of equal size.
        path: file to write.
        largest_bytes: the file stays below.

    Raises:
        UsageError: if it would be too large at any scale.
    """
    for share in _SHARES:
        small = [ImageOps.scale(one, share, Image.Resampling.LANCZOS) for one in frames]
        _encode(small, path)
        if path.stat().st_size < largest_bytes:
            return
    raise UsageError(
        f"the GIF would be larger than {largest_bytes / 1e6:g} MB; choose a higher "
        "--speed, or a shorter part with --from and --to"
    )


def _encode(frames: Sequence[Image.Image], path: Path) -> None:
    # One palette for all, and no dithering, so that what stays still does not change.
    palette = _palette(frames)
    flat = [
        frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames
    ]
    flat[0].save(
        path,
        format="GIF",
        save_all=True,
        append_images=flat[1:],
        duration=1000 // _FPS,
        loop=0,
        optimize=True,  # what stays still is transparent
    )


def _palette(frames: Sequence[Image.Image]) -> Image.Image:
    wanted = np.linspace(0, len(frames) - 1, _SAMPLED_FRAMES).round().astype(int)
    sampled = np.concatenate([np.asarray(frames[index]) for index in set(wanted)])
    return Image.fromarray(sampled).quantize(
        _COLORS, method=Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE
    )
