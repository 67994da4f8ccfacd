"""The kernels' generator against its published outputs, and by eye."""

from __future__ import annotations

import numpy as np

from mrmg.planning.routing._random_kernels import random_below, random_unit


def test_outputs_are_those_of_splitmix64() -> None:
    """The reference outputs for seed 1234567 (Vigna's splitmix64.c), to 53 bits."""
    reference = [
        6457827717110365317,
        3203168211198807973,
        9817491932198370423,
        4593380528125082431,
        16408922859458223821,
    ]
    state = np.array([1234567], np.uint64)
    drawn = [random_unit(state) for _ in reference]
    assert drawn == [(z >> 11) * 2.0**-53 for z in reference]


def test_units_are_uniform_and_uncorrelated() -> None:
    state = np.array([1], np.uint64)
    drawn = np.array([random_unit(state) for _ in range(40_000)])
    assert drawn.min() >= 0.0
    assert drawn.max() < 1.0
    counts, _ = np.histogram(drawn, bins=20, range=(0.0, 1.0))
    chi_squared = ((counts - 2000.0) ** 2 / 2000.0).sum()
    assert chi_squared < 45.0  # 19 degrees of freedom: exceeded once in 1,500
    assert abs(np.corrcoef(drawn[1:], drawn[:-1])[0, 1]) < 0.02


def test_integers_cover_their_range_evenly() -> None:
    state = np.array([2], np.uint64)
    counts = np.bincount([random_below(state, 7) for _ in range(14_000)])
    assert len(counts) == 7
    assert (np.abs(counts - 2000) < 200).all()
    assert [random_below(state, 1) for _ in range(10)] == [0] * 10
