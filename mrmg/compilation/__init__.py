"""The one way this package compiles kernels with numba."""

from mrmg.compilation.cache import (
    KernelLocator,
    cache_folder,
    kernel_sources,
    kernels_are_compiled,
    sources_digest,
)
from mrmg.compilation.decorators import kernel, leaf_kernel, view

__all__ = [
    "KernelLocator",
    "cache_folder",
    "kernel",
    "kernel_sources",
    "kernels_are_compiled",
    "leaf_kernel",
    "sources_digest",
    "view",
]
