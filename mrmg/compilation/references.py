"""Named tuples that kernels hand on as one pointer.

numba hands a named tuple to a function as all that its arrays consist of, seven numbers
each, one by one: a whole mission has hundreds. To generate and optimise that at every
call is most of the time to compile. By reference, a call hands over one number, and a
function reads what it uses.

The arrays belong to Python, which made the tuple, for as long as the call lasts.
Kernels that are handed it do not count references to them, and may return neither them
nor parts of them to Python.
"""

from __future__ import annotations

import hashlib
from typing import Any, TypeVar

from numba import types
from numba.core import cgutils
from numba.core.typing.templates import AttributeTemplate
from numba.extending import (
    NativeValue,
    infer_getattr,
    lower_getattr_generic,
    models,
    register_model,
    typeof_impl,
    unbox,
)

C = TypeVar("C", bound=type)


class Reference(types.Type):
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


@register_model(Reference)
class _Model(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Reference) -> None:
        pointee = manager.lookup(kind.pointee).get_value_type()
        super().__init__(manager, kind, pointee.as_pointer())


def by_reference(cls: C) -> C:
    """Have kernels hand on a class of named tuples by reference.

    Args:
        cls: its values are made by Python alone; kernels read their fields by name.
    """

    @typeof_impl.register(cls)
    def _type_of(value: Any, context: Any) -> Reference | None:
        kinds = [typeof_impl(field, context) for field in value]
        return None if None in kinds else Reference(types.NamedTuple(kinds, cls))

    return cls


@unbox(Reference)
def _unbox(kind: Reference, value: Any, c: Any) -> Any:
    given = c.unbox(kind.pointee, value)
    place = cgutils.alloca_once_value(c.builder, given.value)

    def cleanup() -> None:
        if given.cleanup is not None:
            given.cleanup()
        c.context.nrt.decref(c.builder, kind.pointee, c.builder.load(place))

    return NativeValue(place, given.is_error, cleanup)


@infer_getattr
class _Fields(AttributeTemplate):
    key = Reference

    def generic_resolve(self, kind: Reference, name: str) -> Any:
        """Return the type of a field."""
        if name not in kind.pointee.fields:
            return None
        return kind.pointee.types[kind.pointee.fields.index(name)]


@lower_getattr_generic(Reference)
def _field(context: Any, builder: Any, kind: Reference, value: Any, name: str) -> Any:
    index = kind.pointee.fields.index(name)
    place = cgutils.gep_inbounds(builder, value, 0, index)
    return _borrowed(context, builder, kind.pointee.types[index], builder.load(place))


def _borrowed(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    """Return a value whose arrays are said to belong to nobody, hence are not freed."""
    if isinstance(kind, types.Array):
        array = context.make_array(kind)(context, builder, value=value)
        array.meminfo = cgutils.get_null_value(array.meminfo.type)
        array.parent = cgutils.get_null_value(array.parent.type)
        return array._getvalue()
    if isinstance(kind, types.BaseTuple):
        for i, item in enumerate(kind.types):
            part = builder.extract_value(value, i)
            part = _borrowed(context, builder, item, part)
            value = builder.insert_value(value, part, i)
    return value
