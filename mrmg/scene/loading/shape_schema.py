"""Numbers, ids and shapes, as scene files and `robot.yaml` state them."""

from __future__ import annotations

import re
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

# Limits within which sums, squares and quotients of doubles stay finite, and places
# exact to well below a millimetre.
MOST = 1e12
LARGEST_M, SMALLEST_M, FARTHEST_M, HIGHEST_M = 1e6, 1e-4, 1e8, 1e5
Number = Annotated[float, Field(ge=-MOST, le=MOST, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, le=MOST, allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, le=MOST, allow_inf_nan=False)]
Length = Annotated[float, Field(ge=SMALLEST_M, le=LARGEST_M, allow_inf_nan=False)]
Height = Annotated[float, Field(ge=-HIGHEST_M, le=HIGHEST_M, allow_inf_nan=False)]
Coordinate = Annotated[float, Field(ge=-FARTHEST_M, le=FARTHEST_M, allow_inf_nan=False)]
ID_PATTERN = r"^[A-Za-z0-9_][A-Za-z0-9_.\-]*$"
Identifier = Annotated[
    str,
    Field(
        pattern=ID_PATTERN,
        max_length=64,
        description="name, unique in the whole file",
    ),
]
Point = Annotated[
    list[Coordinate], Field(min_length=2, max_length=2, description="[x, y] in m")
]
Ring = Annotated[
    list[Point], Field(min_length=3, description="at least 3 corners [x, y] in m")
]


class Strict(BaseModel):
    """No key that is not named, no text for numbers.

    The docstrings of fields say in messages and schemas what is expected there.
    """

    model_config = ConfigDict(
        extra="forbid", strict=True, frozen=True, use_attribute_docstrings=True
    )


_UNIT = re.compile(r"_(m_s2|m_s|m|kg_m2|kg|W|J|Ohm|Nm_A|V_s|A)$")


class NamedWithUnits(Strict):
    """Entries whose fields have their units in their names, which their keys have not.

    So entries and the values made of them share the names.
    """

    model_config = ConfigDict(
        alias_generator=lambda name: _UNIT.sub("", name).removeprefix("wheel_")
    )


def exactly_one(*keys: str) -> ConfigDict:
    """Return what distinguishes editors that exactly one of some keys is given."""
    return ConfigDict(json_schema_extra={"oneOf": [{"required": [k]} for k in keys]})


class BoxEntry(Strict):
    """A rectangle about its centre."""

    center: Point
    size: Annotated[list[Length], Field(min_length=2, max_length=2)]
    """[length, width] in m"""
    yaw: Number = 0.0
    """turn in rad"""


class CircleEntry(Strict):
    """A disc."""

    center: Point
    radius: Length
    """radius in m"""


class ShapedEntry(Strict):
    """Exactly one of polygon, box, circle."""

    model_config = exactly_one("polygon", "box", "circle")

    polygon: Ring | None = None
    """at least 3 corners [x, y] in m"""
    holes: list[Ring] | None = None
    """rings inside the polygon"""
    box: BoxEntry | None = None
    """a rectangle: center and size [length, width] in m, yaw in rad"""
    circle: CircleEntry | None = None
    """a disc: its center [x, y] and its radius in m"""
