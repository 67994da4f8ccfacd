"""The decorator of kernels."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, TypeVar

import numba
from numba.extending import overload

from mrmg.compilation.cache import cache_setting

F = TypeVar("F", bound=Callable[..., Any])

_OPTIONS = {"error_model": "numpy"}


class Kernel:
    """A compiled function, which Python and kernels call.

    What is compiled for kernels is a part of its callers: it lacks what takes arguments
    out of Python's objects, which is long, and is kept in nobody's cache but theirs.

    Args:
        function: it.
    """

    def __init__(self, function: Callable[..., Any]) -> None:
        functools.update_wrapper(self, function)
        self.py_func = function

        @overload(self, jit_options=_OPTIONS)
        @functools.wraps(function)
        def _compile_for_kernels(*_: Any) -> Callable[..., Any]:
            return function

    @functools.cached_property
    def for_python(self) -> Any:
        """Return the function as Python calls it, kept in the cache."""
        with cache_setting() as cached:
            return numba.njit(cache=cached, nogil=True, **_OPTIONS)(self.py_func)

    def __call__(self, *arguments: Any) -> Any:
        """Call the function from Python."""
        return self.for_python(*arguments)


def kernel(function: F) -> F:
    """Compile `function` ahead of use: cached, releasing the GIL, without fast-math.

    Fast-math and parallel reductions would let a branch of the search depend on the
    order of additions, which would end reproducibility.
    """
    return function if numba.config.DISABLE_JIT else Kernel(function)  # type: ignore[return-value]
