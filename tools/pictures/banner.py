"""Save one frame of a video as a picture: banner.py VIDEO PICTURE."""

from __future__ import annotations

import sys
from pathlib import Path

import av
from PIL.Image import Dither

SHARE = 0.6
"""Which frame: this share of the way through the video."""


def save_frame(video: Path, picture: Path) -> None:
    """Save the frame of `video` at `SHARE` of its length as `picture`."""
    with av.open(str(video)) as container:
        stream = container.streams.video[0]
        wanted = int(SHARE * stream.frames)
        for index, frame in enumerate(container.decode(stream)):
            if index == wanted:
                palette = frame.to_image().quantize(256, dither=Dither.NONE)
                palette.save(picture, optimize=True)
                return


if __name__ == "__main__":
    save_frame(Path(sys.argv[1]), Path(sys.argv[2]))
