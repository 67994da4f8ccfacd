"""Random streams: fixed for ever, and each its own."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

from mrmg import seeding


def test_golden_numbers() -> None:
    """Plans are functions of these streams; a change here changes every plan."""
    assert seeding.stream_seed(0, "tours", 0) == 3_126_208_286_271_075_497
    drawn = seeding.stream(0, "roadmap").integers(0, 1_000_000, 4)
    assert drawn.tolist() == [741346, 977087, 400242, 606509]


def test_the_same_name_gives_the_same_stream() -> None:
    first = seeding.stream(7, "roadmap", 3).random(50)
    assert np.array_equal(first, seeding.stream(7, "roadmap", 3).random(50))


@pytest.mark.parametrize(
    "other",
    [
        (8, "roadmap", 3),  # other seed
        (7, "tours", 3),  # other name
        (7, "roadmap", 4),  # other number
        (7, "roadmap"),  # shorter
        (73, "roadmap"),  # digits elsewhere
    ],
)
def test_other_names_give_unrelated_streams(other: tuple) -> None:
    mine = seeding.stream(7, "roadmap", 3).random(4000)
    theirs = seeding.stream(*other).random(4000)
    assert abs(np.corrcoef(mine, theirs)[0, 1]) < 0.06
    assert seeding.stream_seed(7, "roadmap", 3) != seeding.stream_seed(*other)


def test_drawing_more_from_one_stream_does_not_shift_another() -> None:
    untouched = seeding.stream(1, "b").random(5)
    seeding.stream(1, "a").random(1000)
    assert np.array_equal(untouched, seeding.stream(1, "b").random(5))


def test_kernel_seeds_fit_and_spread() -> None:
    seeds = [seeding.stream_seed(0, "tree", i) for i in range(2000)]
    assert len(set(seeds)) == len(seeds)
    assert all(0 <= seed < 2**63 for seed in seeds)
    high_bit = np.mean([seed >> 62 for seed in seeds])
    assert 0.45 < high_bit < 0.55


@pytest.mark.parametrize("hash_seed", ["1", "2"])
def test_streams_do_not_depend_on_the_process(hash_seed: str) -> None:
    code = "from mrmg import seeding; print(seeding.stream_seed(0, 'tours', 0))"
    answer = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        check=True,
        env={"PYTHONHASHSEED": hash_seed},
    )
    assert int(answer.stdout) == seeding.stream_seed(0, "tours", 0)
