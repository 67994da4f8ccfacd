"""Small signs laid over pictures of the world: robots' batteries, targets' names."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from pathlib import Path

import matplotlib
import numpy as np
from PIL import Image, ImageDraw, ImageFont

from mrmg.scene.types import Robot
from mrmg.viz import style

CARD = "#202730"
TEXT = "#F2F4F7"
_EMPTY = "#3A434F"
_FULL = "#5FD0A5"
_LOW = "#FF6B5E"
_LOW_SHARE = 0.2
_MEASURED_PX = 100
_BROKEN = "✖"


_LIFT = 12.0
"""Distance of a tag from what it is laid over, in pixels of a picture 720 high."""


class Tag:
    """A robot's id and battery bar, to be laid beside the robot in a picture."""

    def __init__(self, robot: Robot, color: str, height: int) -> None:
        """Draw what never changes; `height` is that of the picture [pixels]."""
        self._unit = max(height / 720.0, 0.6)
        self._reserve = robot.battery.reserve_fraction
        face = font(max(round(12 * self._unit), 9), bold=True)
        width = max(46.0, (face.getlength(f"{robot.id} {_BROKEN}")) / self._unit + 8.0)
        size = (round(width * self._unit), round(27 * self._unit))
        self._bases = []
        for rim, text in ((color, robot.id), (_LOW, f"{robot.id} {_BROKEN}")):
            base = Image.new("RGB", size, CARD)
            pen = ImageDraw.Draw(base)
            pen.rectangle((0, 0, base.width - 1, base.height - 1), outline=rim, width=2)
            middle = (base.width / 2, 9.5 * self._unit)
            pen.text(middle, text, font=face, fill=TEXT, anchor="mm")
            self._bases.append(base)
        self.half = 0.5 * np.array(base.size, dtype=float)
        self._reach_up = 2.0 * self.half[1] + _LIFT * self._unit
        self._side = 0

    def beside(
        self,
        spot: np.ndarray,
        radius: float,
        taken: Sequence[tuple[np.ndarray, np.ndarray]],
        size: tuple[int, int],
    ) -> np.ndarray:
        """Return the tag's centre on the side of a robot with least in its way.

        The tag stays on the side it was on as long as no other side is freer.

        Args:
            spot: the robot (column, row).
            radius: of a circle that holds the robot [pixels].
            taken: centre and half size of boxes to keep off.
            size: width and height of the picture.
        """
        reach = self.half + radius + 2.0 * self._unit
        sides = np.array([[0.0, -1.0], [0.0, 1.0], [1.0, 0.0], [-1.0, 0.0]])
        centers = spot + sides * reach
        beyond = np.maximum(np.abs(centers - np.array(size) / 2) + self.half, 0.0)
        beyond = np.maximum(beyond - np.array(size) / 2, 0.0)
        cost = (beyond * 2.0 * self.half[::-1]).sum(axis=1)
        for center, half in taken:
            shared = half + self.half - np.abs(centers - center)
            cost += np.prod(np.maximum(shared, 0.0), axis=1)
        if cost[self._side] > cost.min():
            self._side = int(cost.argmin())
        return np.asarray(centers[self._side])

    def below(self, center: np.ndarray) -> np.ndarray:
        """Return the spot above which the tag is laid about `center`."""
        return np.asarray(center + (0.0, self._reach_up - self.half[1]))

    def blit(
        self,
        picture: np.ndarray,
        spot: np.ndarray,
        charge: float,
        *,
        broken: bool = False,
    ) -> None:
        """Lay the tag over `picture`, its lower edge above `spot` (column, row)."""
        if not np.isfinite(spot).all():
            return
        image = self._bases[broken].copy()
        inset, top, bottom = (round(part * self._unit) for part in (5, 17, 23))
        bar = (inset, top, image.width - inset, bottom)
        draw_bar(ImageDraw.Draw(image), bar, charge, self._reserve)
        left, top = np.round(spot - (self.half[0], self._reach_up)).astype(int).tolist()
        _paste(picture, np.asarray(image), left, top)


def place_tags(
    tags: Sequence[Tag],
    spots: np.ndarray,
    reaches: Sequence[float],
    named: Sequence[tuple[np.ndarray, np.ndarray]],
    size: tuple[int, int],
) -> list[np.ndarray]:
    """Return the spot to lay each tag above, off names and other robots.

    Args:
        tags: of the robots.
        spots: middles of the robots (column, row), shape (n, 2).
        reaches: radii of circles that hold the robots [pixels].
        named: centre and half size of each name on the picture.
        size: width and height of the picture.
    """
    taken = list(named)
    taken += [
        (spot, np.full(2, reach)) for spot, reach in zip(spots, reaches, strict=True)
    ]
    centers = []
    for tag, spot, reach in zip(tags, spots, reaches, strict=True):
        centers.append(tag.beside(spot, reach, taken, size))
        taken.append((centers[-1], tag.half))
    return [tag.below(center) for tag, center in zip(tags, centers, strict=True)]


class Label:
    """A name to be laid over a picture, with a white rim unless it is white itself."""

    def __init__(
        self, text: str, color: str, height: int, *, size_em: float = 1.0
    ) -> None:
        """Draw the name; `height` is that of the video [pixels]."""
        rim = 0 if color == style.ON_OBSTACLE else max(round(height / 360.0), 1)
        face = font(max(round(size_em * letter_px(height)), 8), bold=True)
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
        self.half = 0.5 * np.array(size, dtype=float)

    def blit(self, picture: np.ndarray, center: np.ndarray) -> None:
        """Lay the name over `picture`, about `center` (column, row)."""
        if np.isfinite(center).all():
            left, top = np.round(center - self.half).astype(int).tolist()
            _paste(picture, self._pixels, left, top)


def letter_px(height: int) -> int:
    """Return the size of the letters of names in a video of that height [pixels]."""
    return max(round(height / 52.0), 10)


@cache
def font(size: int, *, bold: bool = False) -> ImageFont.FreeTypeFont:
    """Return the typeface of all overlays; it comes with matplotlib."""
    name = "DejaVuSans-Bold.ttf" if bold else "DejaVuSans.ttf"
    path = Path(matplotlib.get_data_path()) / "fonts" / "ttf" / name
    return ImageFont.truetype(str(path), size)


def text_width_em(text: str, *, bold: bool = False) -> float:
    """Return the width of a text, in sizes of its letters."""
    return font(_MEASURED_PX, bold=bold).getlength(text) / _MEASURED_PX


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
    pen.line((mark, top - 1, mark, bottom + 1), fill=TEXT, width=1)


def overlap(
    picture: np.ndarray, patch: np.ndarray, column: int, row: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return the parts of both, as views, where a patch covers a picture.

    Args:
        picture: shape (height, width, ...).
        patch: shape (height, width, ...).
        column: of the patch's upper left corner, which may lie outside the picture.
        row: of that corner.
    """
    height, width = patch.shape[:2]
    top, left = max(row, 0), max(column, 0)
    under = picture[top : max(row + height, 0), left : max(column + width, 0)]
    over = patch[top - row :, left - column :]
    return under, over[: under.shape[0], : under.shape[1]]


def _paste(picture: np.ndarray, patch: np.ndarray, column: int, row: int) -> None:
    under, shown = overlap(picture, patch, column, row)
    cover = shown[:, :, 3:] / 255.0 if patch.shape[2] == 4 else 1.0
    under[:] = np.round(under + cover * (shown[:, :, :3] - under.astype(float)))
