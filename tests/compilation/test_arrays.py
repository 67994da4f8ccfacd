"""New arrays in kernels: numpy's, by code that numba did not compile."""

from __future__ import annotations

import numba
import numpy as np
import pytest

from mrmg.compilation import arrays, kernel

pytestmark = pytest.mark.skipif(
    numba.config.DISABLE_JIT, reason="about compiled kernels"
)

POINT = np.dtype([("x", np.float64), ("n", np.int64)])


def zeros(n):
    return np.zeros(n), np.zeros((n, 2), np.int64), np.zeros((2, n, 3), np.bool_)


def ones(n):
    return np.ones(n), np.ones((n, n), np.int64), np.ones(n, np.bool_)


def full(n):
    return (
        np.full(n, 3),
        np.full((n, 2), np.inf),
        np.full(n, -1, np.int8),
        np.full(n, 3, np.float64),
        np.full(n, True),
    )


def arange(n):
    return np.arange(n), np.arange(-n), np.arange(n, n + 3), np.arange(0.5, n, 0.25)


def records(n):
    return (np.zeros(n, POINT),)


@pytest.mark.parametrize("n", [0, 1, 5])
@pytest.mark.parametrize("function", [zeros, ones, full, arange, records])
def test_new_arrays_are_those_of_numpy(function, n: int) -> None:
    for ours, numpys in zip(numba.njit(function)(n), function(n), strict=True):
        assert ours.dtype == numpys.dtype
        assert ours.flags.c_contiguous
        np.testing.assert_array_equal(ours, numpys, strict=True)


def test_empty_arrays_are_arrays_to_write_to() -> None:
    @numba.njit
    def squares(n):
        filled = np.empty((n, 2), np.int64)
        for i in range(n):
            filled[i, 0], filled[i, 1] = i, i * i
        return filled

    np.testing.assert_array_equal(squares(4), [[0, 0], [1, 1], [2, 4], [3, 9]])


def test_a_function_of_new_arrays_consists_of_no_other() -> None:
    @numba.njit
    def cubes(n):
        total = np.zeros(n) + np.full(n, 2.0)
        total[0] = np.ones(n, np.int64)[0] + np.arange(n)[-1] + np.empty(n).shape[0]
        return total

    cubes(3)
    (compiled,) = cubes.overloads.values()
    names = [function.name for function in compiled.library.get_defined_functions()]
    assert not [name for name in names if "ol_np" in name or "impl_np" in name]


@pytest.mark.parametrize(
    ("size", "error"),
    [(-1, "negative dimensions"), (2**62, "too big")],
)
def test_impossible_sizes_are_refused(size: int, error: str) -> None:
    with pytest.raises(ValueError, match=error):
        numba.njit(zeros)(size)


def test_what_kernels_do_not_ask_for_is_left_to_numba() -> None:
    @numba.njit
    def odd(shape):
        return np.zeros(shape=shape, dtype=np.float32), np.zeros((), np.int64)

    first, second = odd((2, 1))
    assert (first.shape, first.dtype) == ((2, 1), np.float32)
    assert second.shape == ()


@kernel
def _assign(into, given):
    into[:] = given


def test_arrays_of_another_shape_are_not_assigned() -> None:
    into = np.zeros((3, 2))
    _assign(into, np.ones((3, 2)))
    assert (into == 1.0).all()
    with pytest.raises(ValueError, match="another shape"):
        _assign(into, np.ones((2, 2)))
    with pytest.raises(ValueError, match="another shape"):
        arrays.refuse_shapes((3, 2), (2, 2))
