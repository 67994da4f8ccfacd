"""The decorator of kernels, and the type of their records.

Kernels copy arrays element by element: with a slice that an array is assigned to, numba
compiles its message about shapes that do not fit, which takes 2.5 s of processor time.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from typing import Any, TypeVar

import numba
import numpy as np
from numba.extending import overload

from mrmg.compilation.cache import to_be_kept

F = TypeVar("F", bound=Callable[..., Any])

_OPTIONS = {"error_model": "numpy", "no_cfunc_wrapper": True}
"""Kernels are never handed on as values, which is what the C wrapper is for."""


class Kernel:
    """A compiled function, which Python and kernels call.

    What is compiled for kernels is a part of its callers: it lacks what takes arguments
    out of Python's objects, which is long, and is kept in nobody's cache but theirs.

    Args:
        function: it.
        inline: whether it is compiled anew into each kernel that calls it.
    """

    def __init__(self, function: Callable[..., Any], *, inline: bool = False) -> None:
        functools.update_wrapper(self, function)
        self.py_func = function

        @overload(self, jit_options={**_OPTIONS, "forceinline": inline})
        @functools.wraps(function)
        def _compile_for_kernels(*_: Any) -> Callable[..., Any]:
            return function

    @functools.cached_property
    def for_python(self) -> Any:
        """Return the function as Python calls it, kept in the cache."""
        kept = to_be_kept(self.py_func)
        options = {"cache": kept is not None, "nogil": True, **_OPTIONS}
        return numba.njit(**options)(kept or self.py_func)

    def __call__(self, *arguments: Any) -> Any:
        """Call the function from Python."""
        return self.for_python(*arguments)


def kernel(function: F) -> F:
    """Compile `function` ahead of use: cached, releasing the GIL, without fast-math.

    Fast-math and parallel reductions would let a branch of the search depend on the
    order of additions, which would end reproducibility.
    """
    return _compiled(function, inline=False)


def inlined(function: F) -> F:
    """Compile `function` as `kernel` does, but into each kernel that calls it.

    It is for what the innermost loops of a search call, where handing arrays on takes
    longer than what is done with them: the search for motions takes half the time with
    it. Elsewhere it only makes compiling longer.
    """
    return _compiled(function, inline=True)


def _compiled(function: F, *, inline: bool) -> F:
    """Return a function that is compiled, where numba is not told to compile none."""
    if numba.config.DISABLE_JIT:
        return function
    return Kernel(function, inline=inline)  # type: ignore[return-value]


def record_type(fields: Sequence[tuple[object, ...]]) -> np.dtype[np.void]:
    """Return the type of records whose fields are attributes, uncompiled as compiled.

    Args:
        fields: name and type of each, as `numpy.dtype` takes them.
    """
    return np.dtype((np.record, list(fields)))
