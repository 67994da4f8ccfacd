"""The shared clock: at full rate on time, and waiting for the last robot if late."""

import numpy as np
import pytest

from mrmg.simulation.fleet_clock import (
    RECOVERY_PER_S,
    SLOWING_PER_S,
    FleetClock,
    lag_s,
)

TICK_S = 0.02


def moving(x: float, v: float, heading: float = 0.0) -> list[float]:
    return [x * np.cos(heading), x * np.sin(heading), heading, v, 0.0]


@pytest.mark.parametrize(
    ("rate", "behind", "late_s"),
    [
        (2.0, 1.0, 0.5),  # forwards, or to the left
        (-1.0, -0.4, 0.4),  # backwards, behind means ahead of the nose
        (2.0, -1.0, -0.5),  # early
        (0.1, 0.1, 0.2),  # slow: as if at 0.5 m/s, or 0.5 rad/s
        (0.0, 0.3, 0.0),  # standing still is never late
    ],
)
def test_lag_is_what_is_missing_over_the_rate(
    rate: float, behind: float, late_s: float
) -> None:
    assert lag_s(behind, rate) == pytest.approx(late_s)


@pytest.mark.parametrize("heading", [0.0, 1.0, -2.5])
@pytest.mark.parametrize(
    ("v", "behind_m", "waits"),
    [(2.0, 1.0, True), (-1.0, -1.0, True), (2.0, -1.0, False), (-1.0, 1.0, False)],
)
def test_lag_is_measured_along_the_way(
    heading: float, v: float, behind_m: float, waits: bool
) -> None:
    clock = FleetClock(np.array([False]))
    state = np.array([moving(0.0, v, heading)])
    clock.pace(state, np.array([moving(behind_m, v, heading)]), TICK_S)
    assert (clock.rate < 1.0) == waits


def test_sideways_error_is_no_lag() -> None:
    clock = FleetClock(np.array([False]))
    state, reference = np.array([moving(0.0, 1.0)]), np.array([moving(0.0, 1.0)])
    state[0, 1] = 0.5
    clock.pace(state, reference, TICK_S)
    assert clock.rate == 1.0


def test_waits_for_robots_that_turn_and_not_for_wheels_that_are_turned() -> None:
    """The fifth state is a yaw rate of some robots, a steering angle of others."""
    planned = np.array([[0.0, 0.0, 0.0, 0.0, 0.5], [0.0, 0.0, 0.0, 0.0, 0.5]])
    behind = planned - [0.0, 0.0, 1.0, 0.0, 0.0]
    waiting = FleetClock(np.array([False, True]))
    going = FleetClock(np.array([False, False]))
    for _ in range(40):
        waiting.pace(behind, planned, TICK_S)
        going.pace(behind, planned, TICK_S)
    assert waiting.rate == 0.0
    assert going.rate == 1.0


def test_runs_at_full_rate_on_time() -> None:
    clock = FleetClock(np.array([False, False]))
    on_time = np.array([moving(1.0, 1.0), moving(3.0, 2.0)])
    for _ in range(100):
        clock.pace(on_time, on_time, TICK_S)
        clock.advance(TICK_S)
    assert clock.time_s == pytest.approx(100 * TICK_S)


def test_waits_for_the_last_robot_and_recovers() -> None:
    """One late robot stops the clock of all; the rate changes within its slew."""
    clock = FleetClock(np.array([False, False]))
    on_time = np.array([moving(1.0, 1.0), moving(3.0, 1.0)])
    late = on_time.copy()
    late[1, 0] -= 2.0
    rates = [clock.rate]
    for _ in range(40):
        clock.pace(late, on_time, TICK_S)
        rates.append(clock.rate)
    assert rates[-1] == 0.0
    for _ in range(60):
        clock.pace(on_time, on_time, TICK_S)
        rates.append(clock.rate)
    assert rates[-1] == 1.0
    change = np.diff(rates)
    assert change.min() >= -SLOWING_PER_S * TICK_S - 1e-12
    assert change.max() <= RECOVERY_PER_S * TICK_S + 1e-12


def test_never_runs_ahead_of_an_early_fleet() -> None:
    clock = FleetClock(np.array([False]))
    planned = np.array([moving(1.0, 1.0)])
    early = np.array([moving(2.0, 1.0)])
    for _ in range(20):
        clock.pace(early, planned, TICK_S)
    assert clock.rate == 1.0
