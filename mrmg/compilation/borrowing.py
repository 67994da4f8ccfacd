"""Arrays that a kernel uses without owning them.

numba counts who uses an array, in memory that all threads share: for every array of a
tuple that is handed on, and twice for each call. Where kernels hand on whole missions
that takes most of their time. A kernel whose caller holds its arguments anyway need not
count them, and neither need the kernels that are compiled into it (`inlined`). Others
that it calls cannot know that, and ask at each use.
"""

from __future__ import annotations

from typing import TypeVar

from numba import types
from numba.extending import intrinsic, overload

T = TypeVar("T")


def borrowed(value: T) -> T:
    """Return arrays, or tuples with arrays in them, whose uses kernels do not count.

    Whoever calls the kernel must hold them, and it must not return them.
    """
    return value


@overload(borrowed)
def _borrowed(_value):
    return lambda _value: _without_owner(_value)


@intrinsic
def _without_owner(_typing, value):
    def generate(context, builder, _signature, arguments):
        return _uncounted(context, builder, value, arguments[0])

    return value(value), generate


def _uncounted(context, builder, kind, value):
    """Return a value whose arrays have no owner of their memory."""
    if isinstance(kind, types.Array):
        array = context.make_helper(builder, kind, value)
        array.meminfo = array.meminfo.type(None)
        return array._getvalue()
    if isinstance(kind, types.BaseTuple):
        for i, part in enumerate(kind):
            own = builder.extract_value(value, i)
            value = builder.insert_value(
                value, _uncounted(context, builder, part, own), i
            )
    return value
