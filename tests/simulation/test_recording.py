"""Rows in, arrays out."""

from __future__ import annotations

import numpy as np

from mrmg.simulation.recording import Recording


def test_rows_become_arrays_by_time_and_by_robot() -> None:
    recording = Recording()
    for time_s in (0.0, 0.1, 0.2):
        recording.add(time_s=time_s, speed=np.array([time_s, 10 + time_s]))
    np.testing.assert_array_equal(recording.in_time("time_s"), [0.0, 0.1, 0.2])
    assert recording.by_robot("speed", 2).shape == (2, 3)
    np.testing.assert_array_equal(recording.by_robot("speed", 2)[1], [10, 10.1, 10.2])


def test_rows_are_copies() -> None:
    recording = Recording()
    row = np.zeros(2)
    recording.add(row=row)
    row[:] = 5.0
    np.testing.assert_array_equal(recording.in_time("row"), [[0.0, 0.0]])


def test_without_ticks_there_is_an_empty_row_for_each_robot() -> None:
    assert Recording().by_robot("force_N", 3).shape == (3, 0)
