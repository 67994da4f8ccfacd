"""Calling a user's compiled motion through an address.

A compiled function that is an argument would be a type of its own, and every kernel
above it would be compiled anew for each user's model. An address is a number: kernels
stay as they are cached, whatever it points to.
"""

from __future__ import annotations

from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

_NUMBER = types.float64
_PAIR, _STATE = types.UniTuple(_NUMBER, 2), types.UniTuple(_NUMBER, 5)

STEP = _STATE(_STATE, _PAIR, _NUMBER, _NUMBER)
"""Signature of (state, control, length, dt) -> state."""

STEER = _PAIR(_STATE, _PAIR, _NUMBER, _NUMBER, _NUMBER)
"""Signature of (state, waypoint, share, length, dt) -> control."""


def _function_at(signature):
    """Return what makes an address a function of a signature, for kernels to call."""
    kind = types.FunctionType(signature)

    @intrinsic
    def function_at(typing, address):
        def generate(context, builder, _, arguments):
            function = cgutils.create_struct_proxy(kind)(context, builder)
            pointer = context.get_value_type(types.voidptr)
            function.c_addr = builder.inttoptr(arguments[0], pointer)
            return function._getvalue()

        return kind(types.int64), generate

    return function_at


step_at = _function_at(STEP)
steer_at = _function_at(STEER)
