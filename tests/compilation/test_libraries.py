"""Machine code is generated for what is called, and only then."""

from __future__ import annotations

import numba
import numpy as np
import pytest

from mrmg.compilation.libraries import LateLibrary

pytestmark = pytest.mark.skipif(
    numba.config.DISABLE_JIT, reason="about compiled kernels"
)


@numba.njit(no_cpython_wrapper=True, no_cfunc_wrapper=True)
def square(x):
    if x < 0.0:
        raise ValueError("a negative number, as asked")
    return x * x


@numba.njit
def sum_of_squares(values):
    total = 0.0
    for value in values:
        total += square(value)
    return total


def library_of(function) -> LateLibrary:
    (compiled,) = function.overloads.values()
    return compiled.library


def test_what_is_only_a_part_of_callers_has_no_code_of_its_own() -> None:
    assert sum_of_squares(np.array([1.0, 2.0])) == 5.0
    assert isinstance(library_of(sum_of_squares), LateLibrary)
    assert library_of(sum_of_squares)._emitted
    assert not library_of(square)._emitted


def test_parts_raise_their_errors_in_whoever_calls_them() -> None:
    with pytest.raises(ValueError, match="as asked"):
        sum_of_squares(np.array([1.0, -1.0]))


def test_a_part_has_code_as_soon_as_its_address_is_asked_for() -> None:
    @numba.njit(no_cpython_wrapper=True, no_cfunc_wrapper=True)
    def halved(x):
        return 0.5 * x

    @numba.njit
    def caller(x):
        return halved(x)

    assert caller(3.0) == 1.5
    library = library_of(halved)
    assert library.get_pointer_to_function("no such function") == 0
    assert not library._emitted
    (compiled,) = halved.overloads.values()
    assert library.get_pointer_to_function(compiled.fndesc.llvm_func_name) != 0
    assert library._emitted


def test_functions_that_call_each_other_in_turn_are_found() -> None:
    @numba.njit("int64(int64)")
    def factorial(n):
        return 1 if n < 2 else n * factorial(n - 1)

    assert factorial(10) == 3628800


def test_functions_can_be_passed_to_kernels_as_numbers_of_their_addresses() -> None:
    callback = numba.cfunc("float64(float64)")(lambda x: x + 0.25)
    assert callback.ctypes(1.0) == 1.25
