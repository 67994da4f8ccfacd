"""Drawing disturbances: within their ranges, by seed, robot by robot."""

from __future__ import annotations

import json
from dataclasses import asdict, fields, replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mrmg import storage
from mrmg.scene.types import Battery
from mrmg.simulation.disturbance import (
    DEFAULT_RANGES,
    Disturbance,
    DisturbanceRanges,
    RobotDisturbance,
    Span,
)


@given(st.integers(0, 2**32))
def test_draws_stay_within_their_ranges(seed: int) -> None:
    for robot in DEFAULT_RANGES.draw(seed, ["r1", "r2"]).robots:
        for field in fields(DisturbanceRanges):
            span = getattr(DEFAULT_RANGES, field.name)
            assert span.low <= getattr(robot, field.name) <= span.high


def test_draws_fill_their_range_evenly() -> None:
    ranges = DisturbanceRanges(mass=Span(-0.2, 0.1))
    drawn = [ranges.draw(seed, ["r1"]).robots[0].mass for seed in range(600)]
    share = np.sort((np.array(drawn) + 0.2) / 0.3)
    # Kolmogorov-Smirnov: 1.95 / sqrt(n) holds for all but one in a thousand.
    assert np.abs(share - np.linspace(0.0, 1.0, 600)).max() < 1.95 / 600**0.5


def test_a_draw_is_decided_by_seed_and_robot_alone() -> None:
    one = DEFAULT_RANGES.draw(5, ["r1", "r2"])
    other = DEFAULT_RANGES.draw(5, ["r2"])
    assert one == DEFAULT_RANGES.draw(5, ["r1", "r2"])
    assert one.robots[1] == other.robots[0]
    assert one.robots[0].mass != one.robots[1].mass
    assert one != DEFAULT_RANGES.draw(6, ["r1", "r2"])


def test_widening_one_range_leaves_the_other_draws() -> None:
    wider = replace(DEFAULT_RANGES, delay_s=Span(0.0, 0.2))
    before = DEFAULT_RANGES.draw(3, ["r1"]).robots[0]
    after = wider.draw(3, ["r1"]).robots[0]
    assert after.delay_s > 0.0
    assert replace(after, delay_s=0.0) == before


def test_fixed_values_are_exact() -> None:
    ranges = DisturbanceRanges(rolling=Span(0.3, 0.3), lag_s=Span(0.05, 0.05))
    robot = ranges.draw(11, ["r1"]).robots[0]
    assert (robot.rolling, robot.lag_s) == (0.3, 0.05)


def test_ranges_name_every_quantity_of_a_robot() -> None:
    ranges = [field.name for field in fields(DisturbanceRanges)]
    drawn = [field.name for field in fields(RobotDisturbance)]
    assert drawn == ["robot", *ranges]


def test_json_gives_an_equal_disturbance() -> None:
    drawn = DEFAULT_RANGES.draw(2, ["r1", "r2"])
    data = json.loads(json.dumps(asdict(drawn)))
    assert storage.typed(Disturbance, data) == drawn


def test_the_actual_battery_keeps_its_reserve_in_joules() -> None:
    believed = Battery(capacity_J=1000.0, start_J=600.0, reserve_fraction=0.1)
    weak = Disturbance(seed=0, robots=(RobotDisturbance(robot="r1", capacity=-0.2),))
    actual = weak.battery(0, believed)
    assert (actual.capacity_J, actual.start_J) == (800.0, 480.0)
    assert actual.reserve_J == pytest.approx(100.0)
