"""Rows in, arrays out; and the work of a held force, exactly."""

from __future__ import annotations

from types import SimpleNamespace

import mujoco
import numpy as np
import pytest

from mrmg.execution.fleet import Fleet
from mrmg.execution.recording import Recording, held_force_work_J
from mrmg.execution.world_model import build_world


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


def test_driving_and_braking_are_kept_apart() -> None:
    force, way = np.array([100.0, -50.0, -20.0]), np.array([2.0, 1.0, -3.0])
    work = held_force_work_J(force, way, np.zeros(3), 0.004)
    np.testing.assert_allclose(work, [[200.0, 0.0], [0.0, -50.0], [60.0, 0.0]])


@pytest.mark.parametrize("steps", [1, 5, 10])
def test_work_agrees_with_metering_every_physics_step(
    driving: SimpleNamespace, steps: int
) -> None:
    """Oracle: force times the mean of each step's speeds, summed step by step."""
    world = build_world(driving.open_ground([(0.0, 0.0, 0.0)]))
    data = mujoco.MjData(world.model)
    fleet = Fleet(world, data)
    fleet.set_resistance(np.array([100.0]))
    steer, rng = np.array([0.2]), np.random.default_rng(4)
    exact = held = 0.0
    for _ in range(400 // steps):
        force = rng.uniform(-200, 700, 1)
        rolled, speed = fleet.rolled_m(), fleet.axle_speed_m_s()
        before = speed
        for _ in range(steps):
            fleet.drive(force, steer, steer, 1)
            after = fleet.axle_speed_m_s()
            exact += (force * 0.5 * (before + after) * 0.004)[0]
            before = after
        held += held_force_work_J(
            force, fleet.rolled_m() - rolled, fleet.axle_speed_m_s() - speed, 0.004
        ).sum()
    assert abs(exact) > 100.0
    assert held == pytest.approx(exact, rel=1e-6)
