"""The one way this package compiles kernels with numba."""

from mrmg.compilation.borrowing import borrowed
from mrmg.compilation.cache import (
    cache_folder,
    compiled_kernels,
    kernel_sources,
    kernels_are_compiled,
    note_kernels_are_compiled,
)
from mrmg.compilation.clock import now_ns
from mrmg.compilation.decorators import inlined, kernel, record_type
from mrmg.compilation.parallel import compile_in_processes

__all__ = [
    "borrowed",
    "cache_folder",
    "compile_in_processes",
    "compiled_kernels",
    "inlined",
    "kernel",
    "kernel_sources",
    "kernels_are_compiled",
    "note_kernels_are_compiled",
    "now_ns",
    "record_type",
]
