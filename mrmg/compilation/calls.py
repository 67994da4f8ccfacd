"""Kernels as Python and other kernels call them, compiled no more often than needed.

numba links the code of every function into each of its callers and optimises and emits
it again there; in a deep tree of calls most of the time to compile goes into code that
has been compiled before. Long functions are therefore called through a symbol: a caller
holds no more of them than their name. Short ones are linked, as they may be inlined.

numba also compiles, for every function, what takes its arguments out of Python's
objects, which is long for a function of many arrays. Here only what Python calls has
it. Named tuples go from kernel to kernel by pointer (`pointers`).
"""

from __future__ import annotations

import functools
import hashlib
import importlib
import inspect
import types as python_types
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numba
from llvmlite import binding
from numba.core import cgutils
from numba.core.imputils import impl_ret_new_ref
from numba.core.registry import cpu_target
from numba.core.typing import signature
from numba.extending import intrinsic, typeof_impl

from mrmg.compilation.libraries import emit_late
from mrmg.compilation.pointers import lend, lent
from mrmg.compilation.sharing import KernelCache
from mrmg.compilation.shortcuts import take_shortcuts

emit_late()
take_shortcuts()


class Kernel:
    """A compiled function, compiled once for Python and once for kernels, at need.

    Args:
        function: it.
        linked: whether it becomes a part of its callers.
        options: of numba.
    """

    def __init__(
        self, function: Callable[..., Any], *, linked: bool, **options: bool
    ) -> None:
        functools.update_wrapper(self, function)
        self.name = function.__qualname__
        self._function = function
        self._options = {"error_model": "numpy", **options}
        self._linked = linked
        self._symbols: dict[tuple[Any, ...], str] = {}
        self.intrinsic = intrinsic(self._typed_call(function))

    @functools.cached_property
    def _for_python(self) -> Any:
        return self._cached(self._function, linked=False, nogil=True)

    @functools.cached_property
    def _for_kernels(self) -> Any:
        return self._cached(
            _renamed(self._function, "for_kernels"),
            linked=self._linked,
            no_cpython_wrapper=True,
            no_cfunc_wrapper=True,
        )

    def _cached(
        self, function: Callable[..., Any], *, linked: bool, **options: bool
    ) -> Any:
        dispatcher = numba.njit(**self._options, **options)(function)
        dispatcher._cache = KernelCache(function, linked=linked)
        return dispatcher

    def __call__(self, *arguments: Any) -> Any:
        """Call the function from Python."""
        return self._for_python(*arguments)

    def load(self, arguments: tuple[Any, ...]) -> Any:
        """Compile or load the function for argument types; return it as compiled.

        A function that is not linked gets a symbol for all kernels of this process. The
        symbol does not depend on the process, as cached kernels hold it.
        """
        if arguments not in self._symbols:
            self._for_kernels.compile(arguments)
            kind = hashlib.sha256(str(arguments).encode()).hexdigest()[:16]
            self._symbols[arguments] = f"{self.__module__}.{self.name}.{kind}"
            compiled = self._for_kernels.overloads[arguments]
            if not self._linked:
                name = compiled.fndesc.llvm_func_name
                address = compiled.library.get_pointer_to_function(name)
                binding.add_symbol(self._symbols[arguments], address)
        return self._for_kernels.overloads[arguments]

    def _typed_call(self, function: Callable[..., Any]) -> Callable[..., Any]:
        """Return numba's definition of a call: its type and what generates it."""

        def call(typing_context: Any, *arguments: Any) -> Any:
            handed_on = tuple(map(lent, arguments))
            compiled = self.load(handed_on)
            kind = compiled.signature

            def generate(context: Any, builder: Any, _: Any, values: Any) -> Any:
                if self._linked:
                    symbol = compiled.fndesc.llvm_func_name
                    context.add_linking_libs([compiled.library])
                else:
                    symbol = self._symbols[handed_on]
                    # Run before the caller is loaded from the cache.
                    context.active_code_library._reload_init.add(
                        _Needed(self.__module__, self.name, handed_on)
                    )
                called = cgutils.get_or_insert_function(
                    builder.module,
                    context.call_conv.get_function_type(kind.return_type, kind.args),
                    symbol,
                )
                status, value = context.call_conv.call_function(
                    builder,
                    called,
                    kind.return_type,
                    kind.args,
                    [
                        lend(builder, *given)
                        for given in zip(arguments, values, strict=True)
                    ],
                )
                with cgutils.if_unlikely(builder, status.is_error):
                    context.call_conv.return_status_propagate(builder, status)
                return impl_ret_new_ref(context, builder, kind.return_type, value)

            return signature(kind.return_type, *arguments), generate

        call.__name__ = function.__name__
        first = inspect.Parameter("typing_context", inspect.Parameter.POSITIONAL_ONLY)
        call.__signature__ = inspect.Signature(  # type: ignore[attr-defined]
            [
                first,
                *(
                    parameter.replace(kind=inspect.Parameter.POSITIONAL_OR_KEYWORD)
                    for parameter in inspect.signature(function).parameters.values()
                ),
            ]
        )
        return call


@typeof_impl.register(Kernel)
def _type_of(kernel: Kernel, _: Any) -> Any:
    return cpu_target.typing_context.resolve_value_type(kernel.intrinsic)


@dataclass(frozen=True)
class _Needed:
    """Loads a kernel that a cached one calls; kept in the cache with that one."""

    module: str
    name: str
    arguments: tuple[Any, ...]

    def __call__(self) -> None:
        kernel = getattr(importlib.import_module(self.module), self.name)
        kernel.load(self.arguments)


def _renamed(function: Callable[..., Any], suffix: str) -> Callable[..., Any]:
    """Return a copy of a function under a name of its own in the cache."""
    copy = python_types.FunctionType(
        function.__code__,
        function.__globals__,
        function.__name__,
        function.__defaults__,
        function.__closure__,
    )
    copy.__module__ = function.__module__
    copy.__qualname__ = f"{function.__qualname__}.{suffix}"
    return copy
