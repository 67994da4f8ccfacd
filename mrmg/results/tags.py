"""Small signs laid over pictures of the world: robots' batteries, targets' names."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import matplotlib
import numpy as np
from PIL import Image, ImageDraw, ImageFont

from mrmg.scene.types import Robot

_CARD = "#202730"
_TEXT = "#F2F4F7"
_EMPTY = "#3A434F"
_FULL = "#5FD0A5"
_LOW = "#FF6B5E"
_LOW_SHARE = 0.2


class Tag:
    """A robot's id and battery bar, to be laid over the robot in a picture."""

    def __init__(self, robot: Robot, color: str, height: int) -> None:
        """Draw what never changes; `height` is that of the picture [pixels]."""
        self._unit = max(height / 720.0, 0.6)
        self._reserve = robot.battery.reserve_fraction
        self._base = Image.new("RGB", self._scaled(46, 27), _CARD)
        pen = ImageDraw.Draw(self._base)
        width, tall = self._base.size
        pen.rectangle((0, 0, width - 1, tall - 1), outline=color, width=2)
        pen.text(
            (width / 2, 9.5 * self._unit),
            robot.id,
            font=font(max(round(12 * self._unit), 9), bold=True),
            fill=_TEXT,
            anchor="mm",
        )

    def blit(self, picture: np.ndarray, spot: np.ndarray, charge: float) -> None:
        """Lay the tag over `picture`, its lower edge above `spot` (column, row)."""
        if not np.isfinite(spot).all():
            return
        image = self._base.copy()
        left, top = self._scaled(5, 17)
        right, bottom = self._scaled(41, 23)
        draw_bar(
            ImageDraw.Draw(image), (left, top, right, bottom), charge, self._reserve
        )
        _paste(
            picture,
            np.asarray(image),
            round(float(spot[0]) - image.width / 2),
            round(float(spot[1]) - image.height - 12 * self._unit),
        )

    def _scaled(self, width: float, height: float) -> tuple[int, int]:
        return round(width * self._unit), round(height * self._unit)


class Label:
    """A target's name with a white rim, to be laid beside it in a picture."""

    def __init__(self, text: str, color: str, height: int) -> None:
        """Draw the name; `height` is that of the video [pixels]."""
        rim = max(round(height / 360.0), 1)
        face = font(max(round(height / 52.0), 10), bold=True)
        left, top, right, bottom = face.getbbox(text, stroke_width=rim)
        size = (round(right - left), round(bottom - top))
        image = Image.new("RGBA", size, (255, 255, 255, 0))
        ImageDraw.Draw(image).text(
            (-left, -top),
            text,
            font=face,
            fill=color,
            stroke_width=rim,
            stroke_fill="white",
        )
        self._pixels = np.asarray(image)

    def blit(self, picture: np.ndarray, spot: np.ndarray) -> None:
        """Lay the name over `picture`, up and right of `spot` (column, row)."""
        if not np.isfinite(spot).all():
            return
        height = self._pixels.shape[0]
        _paste(picture, self._pixels, round(float(spot[0])), round(spot[1]) - height)


@cache
def font(size: int, *, bold: bool = False) -> ImageFont.FreeTypeFont:
    """Return the typeface of all overlays; it comes with matplotlib."""
    name = "DejaVuSans-Bold.ttf" if bold else "DejaVuSans.ttf"
    path = Path(matplotlib.get_data_path()) / "fonts" / "ttf" / name
    return ImageFont.truetype(str(path), size)


def draw_bar(
    pen: ImageDraw.ImageDraw,
    bar: tuple[float, float, float, float],
    charge: float,
    reserve: float,
) -> None:
    """Draw a battery bar (left, top, right, bottom) with a mark at the reserve."""
    left, top, right, bottom = bar
    full = min(max(charge, 0.0), 1.0)
    pen.rectangle(bar, fill=_EMPTY)
    color = _LOW if charge < reserve + _LOW_SHARE * (1.0 - reserve) else _FULL
    pen.rectangle((left, top, left + full * (right - left), bottom), fill=color)
    mark = left + reserve * (right - left)
    pen.line((mark, top - 1, mark, bottom + 1), fill=_TEXT, width=1)


def _paste(picture: np.ndarray, patch: np.ndarray, column: int, row: int) -> None:
    height, width = patch.shape[:2]
    top, left = max(row, 0), max(column, 0)
    bottom = min(row + height, picture.shape[0])
    right = min(column + width, picture.shape[1])
    if top >= bottom or left >= right:
        return
    shown = patch[top - row : bottom - row, left - column : right - column]
    under = picture[top:bottom, left:right]
    cover = shown[:, :, 3:] / 255.0 if patch.shape[2] == 4 else 1.0
    under[:] = np.round(under + cover * (shown[:, :, :3] - under.astype(float)))
