"""The one way this package compiles kernels with numba."""

from mrmg.compilation.borrowing import borrowed as borrowed
from mrmg.compilation.cache import cache_folder as cache_folder
from mrmg.compilation.cache import compiled_kernels as compiled_kernels
from mrmg.compilation.cache import compiling_alone as compiling_alone
from mrmg.compilation.cache import kernel_sources as kernel_sources
from mrmg.compilation.cache import kernels_are_compiled as kernels_are_compiled
from mrmg.compilation.cache import (
    note_kernels_are_compiled as note_kernels_are_compiled,
)
from mrmg.compilation.clock import now_ns as now_ns
from mrmg.compilation.decorators import inlined as inlined
from mrmg.compilation.decorators import kernel as kernel
from mrmg.compilation.decorators import record_type as record_type
from mrmg.compilation.parallel import compile_in_processes as compile_in_processes
