"""Heights of the ground, as scene files state them."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from mrmg.scene.loading.shape_schema import Height, Length, OneOf, Point, Strict


class HillEntry(Strict):
    """A round hill; hollow if its height is negative."""

    center: Point
    height: Height
    """height of the top in m"""
    radius: Length
    """radius of the foot in m"""


class PackedEntry(Strict):
    """Heights as saved scenes hold them: a compressed grid."""

    rows: Annotated[int, Field(ge=2)]
    """from north to south"""
    columns: Annotated[int, Field(ge=2)]
    """from west to east"""
    heights: str
    """tenths of mm, int32, zlib, base64"""


class ElevationEntry(OneOf):
    """The elevation: exactly one of file, grid, hills, packed."""

    one_of = ("file", "grid", "hills", "packed")
    none_of = "no heights"

    file: Annotated[str, Field(min_length=1)] | None = None
    """path of an .npy or .png file"""
    range: Annotated[list[Height], Field(min_length=2, max_length=2)] | None = None
    """[height of black in m, height of white in m]"""
    grid: Annotated[list[list[Height]], Field(min_length=2)] | None = None
    """rows of heights in m, from north to south"""
    hills: Annotated[list[HillEntry], Field(min_length=1)] | None = None
    """round hills, which add up; heights and radii in m"""
    cell: Length | None = None
    """distance of the samples of hills in m"""
    packed: PackedEntry | None = None
    """heights as saved scenes hold them"""
    slope: Literal["refuse", "avoid"] | None = None
    """ground too steep for a robot: refuse the scene (default), or avoid it, as an
    obstacle for that robot"""
