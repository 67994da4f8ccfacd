"""The kinds of kernels: decorators that compile functions."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numba

from mrmg.compilation.calls import Kernel

F = TypeVar("F", bound=Callable[..., Any])

SHORT = 1000
"""Bytes of bytecode up to which a function is linked into its callers."""


def kernel(function: F) -> F:
    """Compile `function` ahead of use: cached, releasing the GIL, without fast-math.

    Fast-math and parallel reductions would let a branch of the search depend on the
    order of additions, which would end reproducibility.
    """
    return _compiled(function)


def leaf_kernel(function: F) -> F:
    """Compile a function that neither makes nor returns arrays: no reference counting.

    Counting the references of every array handed on is a good part of the time of a
    short function, and of the time it takes to compile. What it calls is compiled the
    same way, so that must be leaf kernels and views.
    """
    return _compiled(function, _nrt=False)


def view(function: F) -> F:
    """Compile a function that returns parts of its arguments: into its callers.

    An array handed back by a function would have to be counted.
    """
    return numba.njit(inline="always", error_model="numpy")(function)


def _compiled(function: F, **options: bool) -> F:
    if numba.config.DISABLE_JIT:
        return function
    linked = len(function.__code__.co_code) <= SHORT
    return Kernel(function, linked=linked, **options)  # type: ignore[return-value]
