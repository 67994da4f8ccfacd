"""New arrays, as kernels ask for them, in code that numba need not compile first.

To numba, `np.zeros(n)` is a function written in Python, which calls two more, and so is
the text of the error should two sides of an assignment differ in shape, character by
character. It compiles them for every kind of arguments, again in every process; that
was a sixth of the time to compile. Here the code of new arrays is generated where
they are made, and such errors say less. Whatever is asked for in another way than
kernels do is left to numba.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numba import types
from numba.core import cgutils
from numba.core.typing import signature
from numba.core.typing.templates import AbstractTemplate, infer_global
from numba.extending import lower_builtin, overload


def _kind(shape: Any, dtype: Any) -> Any:
    """Return the type of a new array; None if numba is to find it."""
    sizes = shape.types if isinstance(shape, types.UniTuple) else (shape,)
    if dtype is None or not all(isinstance(size, types.Integer) for size in sizes):
        return None
    return types.Array(dtype, len(sizes), "C")


def _element(named: tuple[Any, ...], default: Any) -> Any:
    """Return the type of elements from an argument that may name it, None if odd."""
    if not named:
        return default
    return named[0].dtype if isinstance(named[0], types.DTypeSpec) else None


def _of_shape(args: Any) -> Any:
    return _kind(args[0], _element(args[1:], types.float64))


def _of_value(args: Any) -> Any:
    return _kind(args[0], _element(args[2:], args[1])) if len(args) > 1 else None


def _of_count(args: Any) -> Any:
    return _kind(args[0], types.int64) if args == (types.int64,) else None


_KINDS: dict[Any, tuple[int, Callable[[Any], Any]]] = {
    np.empty: (2, _of_shape),
    np.zeros: (2, _of_shape),
    np.ones: (2, _of_shape),
    np.full: (3, _of_value),
    np.arange: (1, _of_count),
}
"""The most arguments of each function, and how they tell the type of the array."""


def _define(function: Callable[..., Any]) -> None:
    most, kind_of = _KINDS[function]

    @infer_global(function)
    class _Definition(AbstractTemplate):
        key = function
        metadata = {"target": "cpu"}  # noqa: RUF012  (read by numba before its own)

        def generic(self, args: Any, kws: Any) -> Any:
            if kws or not 0 < len(args) <= most:
                return None
            kind = kind_of(args)
            return None if kind is None else signature(kind, *args)


for _function in _KINDS:
    _define(_function)


def _new(context: Any, builder: Any, kind: Any, shape: Any, sizes: Any) -> Any:
    """Return a new array and leave its elements as they are."""
    from numba.np import arrayobj  # takes long, and only compiling needs it

    return arrayobj._empty_nd_impl(
        context,
        builder,
        kind,
        arrayobj._parse_shape(context, builder, shape, sizes),
    )


def _fill(
    context: Any, builder: Any, kind: Any, array: Any, value_at: Callable[[Any], Any]
) -> Any:
    with cgutils.for_range(builder, array.nitems) as loop:
        place = builder.gep(array.data, [loop.index])
        context.pack_value(builder, kind.dtype, value_at(loop.index), place)
    return array._getvalue()


@lower_builtin(np.empty, types.Any)
@lower_builtin(np.empty, types.Any, types.Any)
def _empty(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    array = _new(context, builder, sig.return_type, sig.args[0], args[0])
    return array._getvalue()


@lower_builtin(np.zeros, types.Any)
@lower_builtin(np.zeros, types.Any, types.Any)
def _zeros(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    array = _new(context, builder, sig.return_type, sig.args[0], args[0])
    size = builder.mul(array.itemsize, array.nitems)
    cgutils.memset(builder, array.data, size, 0)
    return array._getvalue()


@lower_builtin(np.ones, types.Any)
@lower_builtin(np.ones, types.Any, types.Any)
def _ones(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    kind = sig.return_type
    array = _new(context, builder, kind, sig.args[0], args[0])
    one = context.get_constant(types.int64, 1)
    value = context.cast(builder, one, types.int64, kind.dtype)
    return _fill(context, builder, kind, array, lambda _: value)


@lower_builtin(np.full, types.Any, types.Any)
@lower_builtin(np.full, types.Any, types.Any, types.Any)
def _full(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    kind = sig.return_type
    array = _new(context, builder, kind, sig.args[0], args[0])
    value = context.cast(builder, args[1], sig.args[1], kind.dtype)
    return _fill(context, builder, kind, array, lambda _: value)


@lower_builtin(np.arange, types.Any)
def _arange(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    kind = sig.return_type
    zero = context.get_constant(types.int64, 0)
    count = builder.select(builder.icmp_signed("<", args[0], zero), zero, args[0])
    array = _new(context, builder, kind, types.int64, count)
    return _fill(context, builder, kind, array, lambda i: i)


def refuse_shapes(given: Any, expected: Any) -> None:
    """Tell kernels' callers that arrays differ in shape, not which they have."""
    raise ValueError("an array is assigned to a part of another shape")


@overload(refuse_shapes)
def _refuse_shapes(given: Any, expected: Any) -> Any:
    return refuse_shapes


def say_less_of_shapes() -> None:
    """Have kernels that are compiled from now on refuse arrays by `refuse_shapes`."""
    from numba.np import arrayobj

    arrayobj.raise_with_shape_context = refuse_shapes
