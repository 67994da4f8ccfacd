"""The one way this package compiles kernels with numba."""

from mrmg.compilation.cache import (
    KernelLocator,
    cache_folder,
    compiled_kernels,
    kernel_sources,
    kernels_are_compiled,
    note_kernels_are_compiled,
    sources_digest,
)
from mrmg.compilation.clock import now_ns
from mrmg.compilation.decorators import kernel, leaf_kernel, view
from mrmg.compilation.parallel import compile_in_processes
from mrmg.compilation.pointers import by_pointer

__all__ = [
    "KernelLocator",
    "by_pointer",
    "cache_folder",
    "compile_in_processes",
    "compiled_kernels",
    "kernel",
    "kernel_sources",
    "kernels_are_compiled",
    "leaf_kernel",
    "note_kernels_are_compiled",
    "now_ns",
    "sources_digest",
    "view",
]
