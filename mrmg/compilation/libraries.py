"""Machine code for what is called, and for nothing else.

numba optimises every function it compiles, and generates machine code for it, also for
those that become parts of their callers and are optimised and generated again there:
most kernels, and hundreds of small functions of its own. Here that waits until somebody
asks for the code: the address of a function, or what the cache keeps of one that is
called by symbol.
"""

from __future__ import annotations

import functools
from typing import Any

from numba.core import codegen
from numba.core.environment import lookup_environment
from numba.core.registry import cpu_target

_ENVIRONMENT = "_ZN08NumbaEnv"
"""How the names of variables begin that point to what a function has of Python."""

_COUNTING = "NRT_incref"
"""What code calls that counts references."""


class LateLibrary(codegen.JITCodeLibrary):
    """The code of one function and of all that is linked into it.

    Attributes:
        is_part: whether it is only ever a part of others; the cache then keeps what
            they need of it, and no machine code.
    """

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self.is_part = False
        self._emitted = False

    def get_pointer_to_function(self, name: str) -> int:
        """Return the address of a function; 0 if the library does not define it."""
        self._ensure_finalized()
        if not self._emitted and name in map(_name_of, self.get_defined_functions()):
            self._emit()
        return int(super().get_pointer_to_function(name))

    def serialize_using_object_code(self) -> tuple[str, str, Any]:
        """Return what the cache keeps."""
        if self.is_part:
            return self.name, "bitcode", self._get_module_for_linking().as_bitcode()
        self._ensure_finalized()
        self._emit()
        return super().serialize_using_object_code()

    def _emit(self) -> None:
        if self._emitted:
            return
        self._emitted = True
        self._optimize()
        super()._finalize_final_module()
        for variable in self._final_module.global_variables:
            if variable.name.startswith(_ENVIRONMENT):
                environment = lookup_environment(variable.name)
                if environment is not None:
                    self._codegen.set_env(variable.name, environment)

    def _optimize(self) -> None:
        if _COUNTING in map(_name_of, self._final_module.functions):
            super()._optimize_final_module()
            return
        # Without numba's first round, which is there to find counts that cancel out.
        manager, builder = self._codegen._module_pass_manager()
        manager.run(self._final_module, builder)

    def _optimize_functions(self, module: Any) -> None:
        module.data_layout = self._codegen._data_layout
        for function in module.functions:
            if not function.is_declaration:
                manager, builder = self._codegen._function_pass_manager()
                manager.run(function, builder)

    def _optimize_final_module(self) -> None:
        """Leave to `_emit`, or to callers, what numba does as soon as all is linked."""

    def _finalize_final_module(self) -> None:
        from_cache = self._object_caching_enabled and self._compiled_object is not None
        if from_cache:
            self._emitted = True
            super()._finalize_final_module()
            return
        self._finalize_dynamic_globals()
        self._verify_declare_only_symbols()
        self._finalized = True


def _name_of(function: Any) -> str:
    return str(function.name)


def emit_late() -> None:
    """Have numba keep all it compiles from now on in such libraries."""
    generator = cpu_target.target_context.codegen()
    generator._library_class = LateLibrary
    generator.set_env = functools.partial(_set_environment, generator)


def _set_environment(generator: Any, name: str, environment: Any) -> None:
    """Point to what a function has of Python, unless there is no code of it yet."""
    if generator._engine.get_global_value_address(name):
        codegen.JITCPUCodegen.set_env(generator, name, environment)
