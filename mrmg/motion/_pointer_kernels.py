"""Calling a user's compiled motion through an address.

A compiled function that is an argument would be a type of its own, and every kernel
above it would be compiled anew for each user's model. An address is a number: kernels
stay as they are cached, whatever it points to.
"""

from __future__ import annotations

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

_NUMBER = ir.DoubleType()


def _caller(inputs, outputs):
    """Return a generator of calls void f(inputs*, number..., outputs*).

    The first `inputs` numbers are handed over as an array, and the `outputs` ones read
    back from one; both live on the stack.
    """

    def generate(context, builder, signature, arguments):
        address, *numbers = arguments
        given = cgutils.alloca_once(builder, ir.ArrayType(_NUMBER, inputs))
        taken = cgutils.alloca_once(builder, ir.ArrayType(_NUMBER, outputs))
        pointer = _NUMBER.as_pointer()
        for i, number in enumerate(numbers[:inputs]):
            builder.store(number, cgutils.gep_inbounds(builder, given, 0, i))
        rest = numbers[inputs:]
        kind = ir.FunctionType(
            ir.VoidType(), [pointer, *([_NUMBER] * len(rest)), pointer]
        )
        function = builder.inttoptr(address, kind.as_pointer())
        first, last = (builder.bitcast(array, pointer) for array in (given, taken))
        builder.call(function, [first, *rest, last])
        read = [
            builder.load(cgutils.gep_inbounds(builder, taken, 0, i))
            for i in range(outputs)
        ]
        return context.make_tuple(builder, signature.return_type, read)

    return generate


@intrinsic
def call_step(typing, address, x, y, theta, v, w, u1, u2, length, dt):
    """Call step(state and control*, L, dt, state*); return the state, five numbers."""
    numbers = [types.float64] * 9
    return types.UniTuple(types.float64, 5)(types.int64, *numbers), _caller(7, 5)


@intrinsic
def call_steer(typing, address, x, y, theta, v, w, wx, wy, share, length, dt):
    """Call steer(state and waypoint*, share, L, dt, control*); return (u1, u2)."""
    numbers = [types.float64] * 10
    return types.UniTuple(types.float64, 2)(types.int64, *numbers), _caller(7, 2)
