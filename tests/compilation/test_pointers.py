"""Named tuples by pointer: as in Python, whoever made them, and nothing leaks."""

from __future__ import annotations

import sys
from typing import NamedTuple

import numba
import numpy as np
import pytest

from mrmg.compilation import by_pointer, kernel, leaf_kernel

needs_compiler = pytest.mark.skipif(
    numba.config.DISABLE_JIT, reason="about compiled kernels"
)


@by_pointer
class Part(NamedTuple):
    values: np.ndarray
    factor: int


@by_pointer
class Whole(NamedTuple):
    part: Part
    flags: np.ndarray
    wanted: bool
    offset: float


@by_pointer
class Twin(NamedTuple):
    part: Part
    flags: np.ndarray
    wanted: bool
    offset: float


@leaf_kernel
def column_sum(part, j):
    total = 0.0
    for i in range(len(part.values)):
        total += part.values[i, j]
    return total * part.factor


@leaf_kernel
def rating(whole):
    total = whole.offset
    for j in range(whole.part.values.shape[1]):
        if whole.flags[j] == whole.wanted:
            total += column_sum(whole.part, j)
    return total


@leaf_kernel
def fill(part, value):
    for i in range(part.values.shape[0]):
        for j in range(part.values.shape[1]):
            part.values[i, j] = value


@kernel
def new_part(rows, factor):
    return Part(np.ones((rows, 2)), factor)


@kernel
def ratings_of_new(whole, rounds):
    """Rate tuples made here, other ones in every round, and nested."""
    total = np.zeros(rounds)
    for k in range(rounds):
        part = new_part(k + 1, k)
        fill(part, 1.0 + k)
        total[k] = rating(Whole(part, whole.flags, whole.wanted, whole.offset))
        total[k] += column_sum(whole.part, 0)
    return total


@kernel
def with_part(part, offset):
    return Whole(part, np.ones(2, np.bool_), True, offset)


def a_whole() -> Whole:
    values = np.arange(6.0).reshape(3, 2)
    return Whole(Part(values, 2), np.array([True, False]), True, 0.5)


def rate(whole: Whole) -> float:
    """Rate as Python would."""
    chosen = whole.flags == whole.wanted
    return whole.offset + whole.part.factor * whole.part.values[:, chosen].sum()


def test_fields_are_what_python_put_into_them() -> None:
    whole = a_whole()
    for changed in (
        whole,
        whole._replace(wanted=False),
        whole._replace(offset=-3.0),
        whole._replace(part=Part(np.full((5, 2), 7.0), 3)),
    ):
        assert rating(changed) == rate(changed)


def test_kernels_write_into_the_arrays_of_whoever_calls() -> None:
    part = a_whole().part
    fill(part, 4.0)
    assert np.all(part.values == 4.0)


def test_tuples_made_by_kernels_are_handed_on_anew_in_every_round() -> None:
    whole = a_whole()
    expected = [
        rate(whole._replace(part=Part(np.full((k + 1, 2), 1.0 + k), k)))
        + 2.0 * whole.part.values[:, 0].sum()
        for k in range(5)
    ]
    assert ratings_of_new(whole, 5).tolist() == expected


def test_what_a_kernel_made_can_be_handed_back_to_one() -> None:
    part = new_part(4, 3)
    assert isinstance(part, Part)
    assert column_sum(part, 1) == 12.0


def test_python_gets_back_what_it_gave() -> None:
    part = a_whole().part
    before = sys.getrefcount(part.values)
    for _ in range(20):
        whole = with_part(part, 1.5)
        assert isinstance(whole.part, Part)
        assert whole.part.values is part.values
        assert rating(whole) == rate(whole)
    del whole
    after = sys.getrefcount(part.values)
    assert after == before


@needs_compiler
def test_no_reference_is_lost_or_kept() -> None:
    whole = a_whole()
    arrays = (whole.part.values, whole.flags)
    before = [sys.getrefcount(array) for array in arrays]
    for _ in range(20):
        ratings_of_new(whole, 3)
        rating(whole)
    assert [sys.getrefcount(array) for array in arrays] == before


@needs_compiler
def test_classes_with_the_same_fields_are_different_types() -> None:
    whole = a_whole()
    assert numba.typeof(whole) != numba.typeof(Twin(*whole))
    assert numba.typeof(whole) == numba.typeof(a_whole())
    assert rating(Twin(*whole)) == rating(whole)


@needs_compiler
def test_a_field_that_no_kernel_can_have_is_refused() -> None:
    with pytest.raises(numba.TypingError):
        rating(a_whole()._replace(offset="far"))
