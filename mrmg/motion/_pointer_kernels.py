"""Calling a user's compiled motion through an address.

A compiled function that is an argument would be a type of its own, and every kernel
above it would be compiled anew for each user's model. An address is a number: kernels
stay as they are cached, whatever it points to. numba documents intrinsics as the way to
llvmlite's builder; the type of what lies at the address is one of llvmlite's own.
"""

from __future__ import annotations

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

_NUMBER = types.float64
_PAIR, _STATE = types.UniTuple(_NUMBER, 2), types.UniTuple(_NUMBER, 5)

STEP = _STATE(_STATE, _PAIR, _NUMBER, _NUMBER)
"""Signature of (state, control, length, dt) -> state."""

STEER = _PAIR(_STATE, _PAIR, _NUMBER, _NUMBER, _NUMBER)
"""Signature of (state, waypoint, share, length, dt) -> control."""


def _caller(signature):
    """Return the type of a call of what lies at an address, and what generates it."""

    def generate(context, builder, _, arguments):
        address, *given = arguments
        result = context.get_value_type(signature.return_type)
        kinds = [context.get_value_type(kind) for kind in signature.args]
        pointer = ir.FunctionType(result, kinds).as_pointer()
        return builder.call(builder.inttoptr(address, pointer), given)

    return signature.return_type(types.int64, *signature.args), generate


@intrinsic
def call_step(typing, address, state, control, length, dt):
    """Call a step at an address; return the state."""
    return _caller(STEP)


@intrinsic
def call_steer(typing, address, state, waypoint, share, length, dt):
    """Call a steering at an address; return the control."""
    return _caller(STEER)
