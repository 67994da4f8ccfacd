"""Numbers, ids and shapes, as scene files and `robot.yaml` state them."""

from __future__ import annotations

from dataclasses import fields
from typing import Annotated, Any, ClassVar

from pydantic import BaseModel, ConfigDict, Field

from mrmg.errors import Fault
from mrmg.scene.keys import key_of
from mrmg.scene.loading.faults import EntryError

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


class NamedWithUnits(Strict):
    """Entries whose fields have their units in their names, which their keys have not.

    So entries and the values made of them share the names.
    """

    model_config = ConfigDict(
        alias_generator=lambda name: key_of(name).removeprefix("wheel_")
    )


def values_of(kind: type[Any], entry: Strict) -> dict[str, Any]:
    """Return what an entry states of the fields of a dataclass, by their names there.

    What it leaves open is left out; lists become tuples.
    """
    known = type(entry).model_fields
    stated = {item.name: getattr(entry, item.name, None) for item in fields(kind)}
    return {
        name: tuple(value) if isinstance(value, list) else value
        for name, value in stated.items()
        if name in known and value is not None
    }


def _require_one(schema: dict[str, Any], kind: type[OneOf]) -> None:
    schema["oneOf"] = [{"required": [key]} for key in kind.one_of]


class OneOf(Strict):
    """An entry that has exactly one of some keys."""

    model_config = ConfigDict(json_schema_extra=_require_one)

    one_of: ClassVar[tuple[str, ...]]
    """The keys."""
    none_of: ClassVar[str] = "no shape"
    """What an entry has that has none of them."""

    def given(self, path: str) -> str:
        """Return the key that the entry at `path` has.

        Raises:
            EntryError: if it has none of them, or several.
        """
        keys = [key for key in self.one_of if getattr(self, key) is not None]
        if len(keys) != 1:
            found, allowed = " and ".join(keys) or self.none_of, ", ".join(self.one_of)
            message = f"has {found}; expected exactly one of {allowed}"
            raise EntryError(Fault(path, message))
        return keys[0]


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


class ShapedEntry(OneOf, NamedWithUnits):
    """Exactly one of polygon, box, circle."""

    one_of = ("polygon", "box", "circle")

    polygon: Ring | None = None
    """at least 3 corners [x, y] in m"""
    holes: list[Ring] | None = None
    """rings inside the polygon"""
    box: BoxEntry | None = None
    """a rectangle: center and size [length, width] in m, yaw in rad"""
    circle: CircleEntry | None = None
    """a disc: its center [x, y] and its radius in m"""
