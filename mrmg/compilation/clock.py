"""A clock that kernels can read, for what they take to be told and never decided by."""

from __future__ import annotations

import time
from typing import Any

import numba
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

_WORD, _HALF = ir.IntType(64), ir.IntType(32)


@intrinsic
def _clock_ns(typing: Any) -> Any:
    """Call clock_gettime of the C library; return nanoseconds."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        moment = cgutils.alloca_once(builder, ir.LiteralStructType([_WORD, _WORD]))
        kind = ir.FunctionType(_HALF, [_HALF, moment.type])
        read = cgutils.get_or_insert_function(builder.module, kind, "clock_gettime")
        builder.call(read, [ir.Constant(_HALF, time.CLOCK_MONOTONIC), moment])
        seconds, rest = (
            builder.load(cgutils.gep_inbounds(builder, moment, 0, i)) for i in range(2)
        )
        return builder.add(builder.mul(seconds, ir.Constant(_WORD, 10**9)), rest)

    return types.int64(), generate


now_ns = time.monotonic_ns if numba.config.DISABLE_JIT else _clock_ns
"""Returns the time since some moment [ns]."""
