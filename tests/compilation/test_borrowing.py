"""Kernels that borrow their arguments work as others do, and leave their arrays be."""

from __future__ import annotations

import sys
from typing import NamedTuple

import numpy as np

from mrmg.compilation import borrowed, inlined, kernel


class Inner(NamedTuple):
    weight: np.ndarray
    factor: float


class Outer(NamedTuple):
    inner: Inner
    record: np.ndarray
    total: np.ndarray


@kernel
def add_up(outer):
    """Write a total, and return it; arrays of the kernel's own are counted."""
    outer = borrowed(outer)
    own = np.zeros(len(outer.record))
    for i in range(len(own)):
        own[i] = outer.inner.factor * outer.inner.weight[i] * outer.record[i].length
    outer.total[0] = own.sum()
    return outer.total[0]


@inlined
def weighed(inner, i):
    """Return a part of the total."""
    return inner.factor * inner.weight[i]


@kernel
def weigh(outer, total):
    """Write what `add_up` does, by a function of its own."""
    outer, total = borrowed((outer, total))
    for i in range(len(outer.record)):
        total[i] = weighed(outer.inner, i) * outer.record[i].length


def test_inlined_kernels_read_and_write_what_their_callers_borrow() -> None:
    record = np.zeros(3, np.dtype([("length", np.float64)])).view(np.recarray)
    record.length[:] = [1.0, 2.0, 3.0]
    outer = Outer(Inner(np.ones(3), 2.0), np.asarray(record), np.zeros(1))
    total = np.zeros(3)
    weigh(outer, total)
    assert total.tolist() == [2.0, 4.0, 6.0]


def test_borrowed_arrays_are_read_and_written_and_stay_their_owners() -> None:
    record = np.zeros(3, np.dtype([("length", np.float64)])).view(np.recarray)
    record.length[:] = [1.0, 2.0, 3.0]
    weight, total = np.array([1.0, 10.0, 100.0]), np.zeros(1)
    outer = Outer(Inner(weight, 2.0), np.asarray(record), total)
    before = [sys.getrefcount(each) for each in (weight, total, outer.record)]
    for _ in range(3):
        assert add_up(outer) == 642.0 == total[0]
    after = [sys.getrefcount(each) for each in (weight, total, outer.record)]
    assert after == before
    assert outer.record["length"].tolist() == [1.0, 2.0, 3.0]
