"""Named tuples that kernels pass on as one pointer.

numba hands a named tuple to a function as all that its arrays consist of, seven numbers
each, one by one: to generate and optimise that at every call takes most of the time to
compile functions that have a whole mission among their arguments. By pointer, a call
hands over one number, and a function reads what it uses.

The arrays belong to whoever made the tuple, for as long as the call lasts: kernels that
are handed it do not count references to them, and may return them, parts of them or the
pointer to nobody but a kernel that has the tuple, too.
"""

from __future__ import annotations

import hashlib
from typing import Any, TypeVar

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.datamodel import models
from numba.core.typing.templates import AttributeTemplate
from numba.extending import (
    NativeValue,
    box,
    infer_getattr,
    lower_getattr_generic,
    register_model,
    typeof_impl,
    unbox,
)

C = TypeVar("C", bound=type)

_CLASSES: set[type] = set()
"""What is passed by pointer."""


class ByPointer(types.Type):
    """A named tuple that lies in memory and does not change.

    Args:
        pointee: type of the named tuple.
    """

    def __init__(self, pointee: types.NamedTuple) -> None:
        self.pointee = pointee
        cls = pointee.instance_class
        kind = hashlib.sha256(f"{cls.__module__}.{pointee}".encode()).hexdigest()[:12]
        super().__init__(f"{cls.__name__}_{kind}")

    @property
    def key(self) -> Any:
        """What tells types apart."""
        return self.pointee


@register_model(ByPointer)
class _Model(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: ByPointer) -> None:
        pointee = manager.lookup(kind.pointee).get_value_type()
        super().__init__(manager, kind, pointee.as_pointer())


def by_pointer(cls: C) -> C:
    """Have kernels pass a class of named tuples by pointer.

    Args:
        cls: fields are numbers, arrays and such tuples. Kernels read them by name.
    """
    _CLASSES.add(cls)

    @typeof_impl.register(cls)
    def _type_of(value: Any, context: Any) -> ByPointer | None:
        kinds = [typeof_impl(field, context) for field in value]
        return None if None in kinds else ByPointer(types.NamedTuple(kinds, cls))

    return cls


def lent(kind: Any) -> Any:
    """Return the type as which a kernel gets an argument of a type from another."""
    by_pointer = isinstance(kind, types.NamedTuple) and kind.instance_class in _CLASSES
    return ByPointer(kind) if by_pointer else kind


def lend(builder: Any, kind: Any, value: Any) -> Any:
    """Return the value of an argument of a type as `lent`; it is good for one call."""
    if lent(kind) is kind:
        return value
    return _opaque(builder, cgutils.alloca_once_value(builder, value))


@unbox(ByPointer)
def _unbox(kind: ByPointer, value: Any, c: Any) -> Any:
    given = c.unbox(kind.pointee, value)
    place = cgutils.alloca_once_value(c.builder, given.value)

    def cleanup() -> None:
        if given.cleanup is not None:
            given.cleanup()
        if c.context.enable_nrt:
            c.context.nrt.decref(c.builder, kind.pointee, c.builder.load(place))

    return NativeValue(_opaque(c.builder, place), given.is_error, cleanup)


@box(ByPointer)
def _box(kind: ByPointer, pointer: Any, c: Any) -> Any:
    """Return to Python the arrays that came from there, by the objects they are."""
    value = _borrowed(c.context, c.builder, kind.pointee, pointer, ("parent", *_PARTS))
    return c.box(kind.pointee, value)


def _opaque(builder: Any, place: Any) -> Any:
    """Return a pointer of which the compiler does not know where it points to.

    What it points to can then be called invariant, although it is written here.
    """
    kind = ir.FunctionType(place.type, [place.type])
    return builder.asm(kind, "", "=r,0", [place], side_effect=True)


@infer_getattr
class _Attributes(AttributeTemplate):
    key = ByPointer

    def generic_resolve(self, kind: ByPointer, name: str) -> Any:
        """Return the type of a field."""
        if name not in kind.pointee.fields:
            return None
        return kind.pointee.types[kind.pointee.fields.index(name)]


@lower_getattr_generic(ByPointer)
def _field(context: Any, builder: Any, kind: ByPointer, value: Any, name: str) -> Any:
    index = kind.pointee.fields.index(name)
    place = cgutils.gep_inbounds(builder, value, 0, index)
    return _borrowed(context, builder, kind.pointee.types[index], place)


_PARTS = ("nitems", "itemsize", "data", "shape", "strides")
"""Parts of an array, but for those that tell whose it is."""


def _borrowed(
    context: Any, builder: Any, kind: Any, place: Any, parts: tuple[str, ...] = _PARTS
) -> Any:
    """Return what lies at a place; of an array, only some parts."""
    model = context.data_model_manager[kind]

    def at(i: int) -> Any:
        return cgutils.gep_inbounds(builder, place, 0, i)

    if isinstance(kind, types.Array):
        value = ir.Constant(model.get_value_type(), None)
        for i in map(model.get_field_position, parts):
            value = builder.insert_value(value, _invariant(builder, at(i)), i)
        return value
    if isinstance(kind, types.BaseTuple):
        value = ir.Constant(model.get_value_type(), None)
        for i, item in enumerate(kind.types):
            part = _borrowed(context, builder, item, at(i), parts)
            value = builder.insert_value(value, part, i)
        return value
    if model.contains_nrt_meminfo():
        raise TypeError(f"kernels cannot lend what a field holds: {kind}")
    return _invariant(builder, place)


def _invariant(builder: Any, place: Any) -> Any:
    """Return what lies at a place and does not change, number by number."""
    kind = place.type.pointee
    if isinstance(kind, ir.Aggregate):
        value = ir.Constant(kind, ir.Undefined)
        for i in range(len(kind)):
            part = _invariant(builder, cgutils.gep_inbounds(builder, place, 0, i))
            value = builder.insert_value(value, part, i)
        return value
    value = builder.load(place)
    value.set_metadata("invariant.load", builder.module.add_metadata([]))
    return value
