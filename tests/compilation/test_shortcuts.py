"""Shortcuts of inference: the same types, errors and settings as without."""

from __future__ import annotations

import operator

import numba
import pytest
from llvmlite import binding
from numba import types
from numba.core import ir
from numba.core.compiler import Flags
from numba.core.registry import cpu_target
from numba.core.types.functions import BaseFunction

import mrmg.compilation  # noqa: F401  (takes the shortcuts)

pytestmark = pytest.mark.skipif(
    numba.config.DISABLE_JIT, reason="about compiled kernels"
)

KINDS = (
    types.int64,
    types.float64,
    types.boolean,
    types.literal(3),
    types.UniTuple(types.float64, 2),
    types.Array(types.float64, 1, "C"),
    types.Array(types.int64, 2, "A"),
)


def resolved(resolve, function: types.Function, args: tuple[types.Type, ...]) -> object:
    try:
        return resolve(function, cpu_target.typing_context, args, {})
    except numba.TypingError as error:
        return type(error)


@pytest.mark.parametrize(
    "operation", [operator.add, operator.eq, operator.truediv, operator.getitem, max]
)
def test_calls_have_the_types_that_numba_finds(operation) -> None:
    function = cpu_target.typing_context.resolve_value_type(operation)
    calls = [(first, second) for first in KINDS for second in KINDS]
    ours, numbas = BaseFunction.get_call_type, BaseFunction.get_call_type.__wrapped__
    expected = [resolved(numbas, function, call) for call in calls]
    assert [resolved(ours, function, call) for call in calls] == expected
    assert [resolved(ours, function, call) for call in calls] == expected
    assert any(isinstance(kind, type) for kind in expected)
    assert not all(isinstance(kind, type) for kind in expected)


def test_what_no_definition_fits_is_told_as_numba_tells_it() -> None:
    @numba.njit
    def nonsense(x):
        return x + "far"

    for _ in range(2):
        with pytest.raises(numba.TypingError, match="No implementation of function"):
            nonsense(1.0)


def test_a_literal_argument_that_is_asked_for_is_found() -> None:
    @numba.njit
    def second(pair):
        return pair[1]

    assert second((1, 2.5)) == 2.5
    assert second((1.5, 2)) == 2


def test_settings_are_equal_where_all_options_are() -> None:
    plain, explicit, other = Flags(), Flags(), Flags()
    explicit.nrt = plain.nrt
    other.nrt = not plain.nrt
    assert plain == explicit
    assert hash(plain) == hash(explicit)
    assert plain != other
    assert plain != "settings"


def test_variables_of_an_instruction_are_listed_in_their_order() -> None:
    scope = ir.Scope(None, ir.unknown_loc)
    a, b, c = (scope.define(name, ir.unknown_loc) for name in "abc")
    inner = ir.Expr.build_tuple([a, b], ir.unknown_loc)
    call = ir.Expr.call(c, (a, inner, 3), (("flag", b), ("level", 2)), ir.unknown_loc)
    assert call.list_vars() == [c, a, a, b, b]
    assert ir.Assign(call, a, ir.unknown_loc).list_vars() == [*call.list_vars(), a]
    assert ir.Jump(7, ir.unknown_loc).list_vars() == []


def test_nobody_is_told_of_calls_into_llvm() -> None:
    assert binding.ffi.lib._lock._cblist == []
