"""The cache of compiled kernels as processes that compile at once share it.

numba's own lets two processes compile the same function, and when both add a kind of
arguments to it, one may overwrite what the other has just written. Here whoever
compiles a function locks it, and whoever needs it meanwhile waits and then loads it. A
process that ends, however it ends, leaves no lock behind, and waiting in a circle is
impossible, as a function is locked only while what it calls is compiled.
"""

from __future__ import annotations

import fcntl
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

from llvmlite import binding
from numba.core import caching, environment
from numba.core.runtime.nrt import rtsys

from mrmg.compilation.arrays import say_less_of_shapes


@dataclass(frozen=True)
class _Surroundings:
    """What numba keeps beside a compiled function, without the module it is of.

    numba imports that module, be it one of its own of which only code is needed here.

    Attributes:
        module, name: of the function.
        constants: that it uses.
    """

    module: str
    name: str
    constants: list[Any]

    @staticmethod
    def of(known: Any) -> _Surroundings:
        """Return what is kept of an environment."""
        return _Surroundings(known.globals["__name__"], known.env_name, known.consts)

    def restored(self) -> Any:
        """Return the environment, the one that this process has if there is one."""
        known = environment.lookup_environment(self.name)
        if known is None:
            module = sys.modules.get(self.module)
            known = environment.Environment(
                {"__name__": self.module} if module is None else vars(module)
            )
            known.consts[:] = self.constants
            known.env_name = self.name
            environment.Environment._memo[self.name] = known
        return known


class _Form(caching.CompileResultCacheImpl):
    """How a compiled function is kept: as numba does, but for its surroundings."""

    def reduce(self, compiled: Any) -> Any:
        """Return what is written."""
        library, description, own, *more, others = super().reduce(compiled)
        kept = tuple(map(_Surroundings.of, others))
        return library, description, _Surroundings.of(own), *more, kept

    def rebuild(self, target_context: Any, written: Any) -> Any:
        """Return the function."""
        library, description, own, *more, kept = written
        others = tuple(one.restored() for one in kept)
        return super().rebuild(
            target_context, (library, description, own.restored(), *more, others)
        )


class KernelCache(caching.FunctionCache):
    """Keeps the compiled forms of one function.

    Args:
        function: it.
        linked: whether callers are compiled together with it; if not, its object code
            is all that is kept, which is loaded in half the time.
    """

    _impl_class = _Form

    def __init__(self, function: Callable[..., Any], *, linked: bool) -> None:
        super().__init__(function)
        self._linked = linked
        self._lock: IO[bytes] | None = None

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return what is compiled for a signature; None if it is ours to compile."""
        found = self._kept(sig, target_context)
        if found is None:
            found = super().load_overload(sig, target_context)
        if found is None and self._lock is None:
            say_less_of_shapes()
            self._acquire()
            found = super().load_overload(sig, target_context)
            if found is not None:
                self._release()
        if found is not None:
            # Callers that it is linked into load these before themselves; numba forgets
            # that of what it loads.
            found.library._reload_init.update(found.reload_init)
        return found

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep what has been compiled for a signature."""
        data.library.is_part = self._linked
        if not self._linked:
            data.library._shared_module = _names_of(data)
        try:
            super().save_overload(sig, data._replace(type_annotation=""))
        finally:
            self._release()
        # A listing of every variable's type, which nobody will read.
        vars(data.type_annotation).clear()

    def _kept(self, sig: Any, target_context: Any) -> Any:
        """Return what is compiled for a signature, None if nothing is.

        All that code needs in order to run is the counting of references. numba also
        imports everything that it could compile, before it looks for what is compiled,
        which takes longer than to load the kernels of a mission.
        """
        rtsys.initialize(target_context)
        with self._guard_against_spurious_io_errors():
            return self._load_overload(sig, target_context)

    def _acquire(self) -> None:
        self._impl.locator.ensure_cache_path()
        lock = Path(self.cache_path) / f"{self._impl.filename_base}.lock"
        self._lock = lock.open("wb")
        fcntl.flock(self._lock, fcntl.LOCK_EX)

    def _release(self) -> None:
        if self._lock is not None:
            self._lock.close()
            self._lock = None


def _names_of(compiled: Any) -> Any:
    """Return a module that has of a compiled function no more than its names.

    numba takes from it what the object code defines.
    """
    description = compiled.fndesc
    sought = {description.llvm_func_name, description.llvm_cpython_wrapper_name}
    defined = {function.name for function in compiled.library.get_defined_functions()}
    return binding.parse_assembly(
        "".join(
            f'define void @"{name}"() {{ ret void }}\n'
            for name in sorted(sought & defined)
        )
    )
