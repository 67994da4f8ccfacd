"""Heights of the ground, as scene files state them."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from mrmg.scene.loading.shape_schema import (
    Height,
    Length,
    Point,
    Strict,
    exactly_one,
)


class HillEntry(Strict):
    """A round hill; hollow if its height is negative."""

    center: Point
    height: Height = Field(description="height of the top in m")
    radius: Length = Field(description="radius of the foot in m")


class PackedEntry(Strict):
    """Heights as saved scenes hold them: a compressed grid."""

    rows: Annotated[int, Field(ge=2)] = Field(description="from north to south")
    columns: Annotated[int, Field(ge=2)] = Field(description="from west to east")
    heights: str = Field(description="tenths of mm, int32, zlib, base64")


class ElevationEntry(Strict):
    """The elevation: exactly one of file, grid, hills, packed."""

    model_config = exactly_one("file", "grid", "hills", "packed")

    file: Annotated[str, Field(min_length=1)] | None = Field(
        default=None, description="path of an .npy or .png file"
    )
    range: Annotated[list[Height], Field(min_length=2, max_length=2)] | None = Field(
        default=None, description="[height of black in m, height of white in m]"
    )
    grid: Annotated[list[list[Height]], Field(min_length=2)] | None = Field(
        default=None, description="rows of heights in m, from north to south"
    )
    hills: Annotated[list[HillEntry], Field(min_length=1)] | None = Field(
        default=None, description="round hills, which add up; heights and radii in m"
    )
    cell: Length | None = Field(
        default=None, description="distance of the samples of hills in m"
    )
    packed: PackedEntry | None = Field(
        default=None, description="heights as saved scenes hold them"
    )
    slope: Literal["refuse", "avoid"] | None = Field(
        default=None,
        description="ground too steep for a robot: refuse the scene (default), or "
        "avoid it, as an obstacle for that robot",
    )
