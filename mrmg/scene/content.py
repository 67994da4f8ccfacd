"""The digest of values: a fingerprint of everything that is planned or driven."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import MISSING, Field, fields, is_dataclass
from numbers import Real
from typing import Any

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from mrmg import storage
from mrmg.errors import Fault, SceneError


class ByContent:
    """Makes values equal whose contents are; arrays in them have no other equality."""

    __slots__ = ()

    def __eq__(self, other: object) -> bool:
        return type(self) is type(other) and content(self) == content(other)

    def __hash__(self) -> int:
        return hash(content_digest(self))


def content_digest(value: Any) -> str:
    """Return the fingerprint of a value; values of equal content have equal ones."""
    return storage.digest(storage.canonical_json(content(value)))


def content(value: Any) -> Any:
    """Return a value's content as plain data.

    A class states what counts of it by a method `content`; of any other dataclass all
    fields count. How the rings of a shape are oriented and where they begin does not.
    """
    if hasattr(value, "content"):
        return value.content()
    if is_dataclass(value) and not isinstance(value, type):
        return contents(value)
    if isinstance(value, BaseGeometry):
        flat = shapely.normalize(shapely.force_2d(value))
        return _fingerprint(flat.wkb, shapely.get_coordinates(flat))
    if isinstance(value, np.ndarray):
        # Adding 0.0 makes zeros of both signs equal.
        numbers = np.ascontiguousarray(value, dtype=float) + 0.0
        return [list(value.shape), _fingerprint(numbers.tobytes(), numbers)]
    if isinstance(value, Mapping):
        return {str(key): content(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [content(item) for item in value]
    if isinstance(value, bool | str) or value is None:
        return value
    if isinstance(value, Real):
        number = float(value) + 0.0
        return number if math.isfinite(number) else NotFinite(number)
    raise TypeError(f"{type(value).__name__} has no content: {value!r}")


def _fingerprint(data: bytes, numbers: np.ndarray) -> str:
    digest = storage.bytes_digest(data)
    return digest if np.isfinite(numbers).all() else NotFinite(digest)


class NotFinite(str):
    """Stands in a content for numbers that are not finite."""

    __slots__ = ()


def require_finite(source: str, value: Any) -> None:
    """Refuse a content in which a number is not finite.

    Raises:
        SceneError: naming where they are.
    """
    paths = [*_not_finite(value, "")]
    if paths:
        message = "expected a finite number"
        raise SceneError(source, [Fault(path, message) for path in paths])


def _not_finite(value: Any, path: str) -> Iterator[str]:
    if isinstance(value, NotFinite):
        yield path
    items = value.items() if isinstance(value, dict) else ()
    for key, item in enumerate(value) if isinstance(value, list) else items:
        yield from _not_finite(item, f"{path}.{key}".lstrip("."))


def contents(value: Any, *, without: tuple[str, ...] = ()) -> dict[str, Any]:
    """Return the content of a dataclass's fields by name.

    Fields at their defaults stay out, so that a field that a later version adds leaves
    the digests as they are.
    """
    return {
        field.name: content(getattr(value, field.name))
        for field in fields(value)
        if field.name not in without
        and not _is_default(getattr(value, field.name), field)
    }


def _is_default(value: Any, field: Field[Any]) -> bool:
    if field.default is MISSING:
        return False
    return value is field.default or bool(content(value) == content(field.default))
