"""Disturbances as users write them: values, units, files, and every mistake."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mrmg.errors import FileError, UsageError
from mrmg.simulation.disturbance import (
    DEFAULT_RANGES,
    FIELD_SPREADS,
    DisturbanceRanges,
    Span,
)
from mrmg.simulation.disturbance_spec import disturbance_text, parse_disturbance

DEGREE = math.pi / 180


def only(spec: str) -> DisturbanceRanges:
    return parse_disturbance(f"none,{spec}")


def test_nothing_stands_for_the_defaults() -> None:
    assert parse_disturbance("") == DEFAULT_RANGES
    assert parse_disturbance("none") == DisturbanceRanges()


def test_the_defaults_are_those_promised() -> None:
    promised = "none,mass=+-5%,friction=+-20%,rolling=+-10%,lag=50ms,position_noise=2cm"
    assert parse_disturbance(promised) == DEFAULT_RANGES


@pytest.mark.parametrize("terrain", FIELD_SPREADS)
def test_a_field_has_the_spread_that_was_found_in_logs(terrain: str) -> None:
    """Drawn rolling resistances have it as their standard deviation."""
    ranges = parse_disturbance(f"field:{terrain}")
    robots = [f"r{number}" for number in range(2000)]
    drawn = [item.rolling for item in ranges.draw(4, robots).robots]
    assert np.std(drawn) == pytest.approx(FIELD_SPREADS[terrain], rel=0.05)
    assert np.mean(drawn) == pytest.approx(0.0, abs=0.02)
    assert ranges.mass == Span()
    assert ranges.position_noise_m == DEFAULT_RANGES.position_noise_m
    assert parse_disturbance(disturbance_text(ranges)) == ranges
    assert parse_disturbance(f"field:{terrain},rolling=+-10%").rolling == Span(
        -0.1, 0.1
    )


def test_a_field_that_nobody_logged_is_refused() -> None:
    with pytest.raises(UsageError, match=r"'field:snwo' .*'field:snow'.*: field:asp"):
        parse_disturbance("field:snwo")


def test_pairs_amend_the_defaults() -> None:
    ranges = parse_disturbance("rolling=+30%, delay=0..80ms")
    assert ranges.rolling == Span(0.3, 0.3)
    assert ranges.delay_s == Span(0.0, 0.08)
    assert ranges.mass == DEFAULT_RANGES.mass


@pytest.mark.parametrize(
    ("spec", "field", "low", "high"),
    [
        ("mass=+-5%", "mass", -0.05, 0.05),
        ("mass=±5%", "mass", -0.05, 0.05),
        ("rolling=-10%..+30%", "rolling", -0.1, 0.3),
        ("capacity=0..0", "capacity", 0.0, 0.0),
        ("lag=0.05", "lag_s", 0.05, 0.05),
        ("lag=50ms", "lag_s", 0.05, 0.05),
        ("position_noise=2cm", "position_noise_m", 0.02, 0.02),
        ("position_noise=1mm..0.1m", "position_noise_m", 0.001, 0.1),
        ("heading_noise=1deg", "heading_noise_rad", DEGREE, DEGREE),
        ("speed_noise=3cm/s", "speed_noise_m_s", 0.03, 0.03),
        ("start_x=+-5cm", "start_x_m", -0.05, 0.05),
        (
            "start_heading=-2deg..1deg",
            "start_heading_rad",
            -math.pi / 90,
            math.pi / 180,
        ),
        ("steering_gain=-3%", "steering_gain", -0.03, -0.03),
        ("drive_gain=1e1%", "drive_gain", 0.1, 0.1),
    ],
)
def test_values(spec: str, field: str, low: float, high: float) -> None:
    span = getattr(only(spec), field)
    assert (span.low, span.high) == pytest.approx((low, high))


@pytest.mark.parametrize("zero", ["0", "-0", "+-0", "-0..0"])
def test_nothing_is_written_in_one_way(zero: str) -> None:
    assert disturbance_text(parse_disturbance(f"lag={zero}")) == "lag=0s"


@pytest.mark.parametrize(
    ("spec", "message"),
    [
        ("weight=+5%", "'weight' is not known; allowed: mass, friction, rolling"),
        ("mass", "'mass' is not key=value"),
        ("mass=+5%,none", "'none' is not key=value"),
        ("mass=", "mass=: not a value; expected one such as \\+-5%, in %"),
        ("mass=5", "mass=5: not a value"),
        ("mass=nan%", "not a value"),
        ("rolling=5%..", "rolling=5%\\.\\.: not a value"),
        ("rolling=+-x", "rolling=\\+-x: not a value"),
        ("mass=+-%", "not a value"),
        ("lag=50%", "lag=50%: not a value; expected one such as 50ms, in ms or s"),
        ("lag=inf", "not a value"),
        ("lag=-1ms", "lag=-1ms: allowed are 0 to 5 s"),
        ("lag=+-50ms", "allowed are 0 to 5 s"),
        ("mass=-100%", "mass=-100%: allowed are -90 to 1000 %"),
        ("rolling=+30%..+10%", "the range ends before it begins"),
        ("mass=+1%,mass=+2%", "'mass' is given twice"),
    ],
)
def test_mistakes_are_named(spec: str, message: str) -> None:
    with pytest.raises(UsageError, match=message):
        parse_disturbance(spec)


def test_a_file_says_the_same(tmp_path: Path) -> None:
    path = tmp_path / "rough.yaml"
    path.write_text("base: none\nrolling: +30%\nlag: 0..80ms\ndelay: 0.1\n")
    written = only("rolling=+30%,lag=0..80ms,delay=0.1")
    assert parse_disturbance(str(path)) == written
    path.write_text("rolling: +30%\n")
    assert parse_disturbance(str(path)) == parse_disturbance("rolling=+30%")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("- mass", "is no mapping of keys to values"),
        ("base: all", "base is 'all'; allowed: default, none"),
        ("weight: +5%", "'weight' is not known"),
        ("mass: [1, 2]", "not a value"),
    ],
)
def test_mistakes_in_a_file_are_named(text: str, message: str, tmp_path: Path) -> None:
    path = tmp_path / "rough.yaml"
    path.write_text(text)
    with pytest.raises(UsageError, match=message):
        parse_disturbance(str(path))


def test_an_unreadable_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(FileError, match="missing.yaml"):
        parse_disturbance(str(tmp_path / "missing.yaml"))


percent = st.integers(-90, 300)
tenth_ms = st.integers(0, 5000)


@given(percent, percent, tenth_ms, tenth_ms)
def test_the_text_of_ranges_gives_them_back(a: int, b: int, c: int, d: int) -> None:
    low, high = sorted([a, b])
    soon, late = sorted([c, d])
    spec = f"rolling={low}%..{high}%,lag={soon / 10}ms..{late / 10}ms"
    ranges = parse_disturbance(spec)
    again = parse_disturbance(disturbance_text(ranges))
    assert again.rolling.low == pytest.approx(ranges.rolling.low)
    assert again.rolling.high == pytest.approx(ranges.rolling.high)
    assert again.lag_s.low == pytest.approx(ranges.lag_s.low)
    assert again.lag_s.high == pytest.approx(ranges.lag_s.high)
    # Once written, a text stays the same, so that it can stand for the ranges.
    assert disturbance_text(again) == disturbance_text(ranges)


def test_the_text_of_the_defaults_is_empty() -> None:
    assert disturbance_text(DEFAULT_RANGES) == ""
    assert disturbance_text(parse_disturbance("rolling=+30%")) == "rolling=+30%"
    assert "mass=+0%" in disturbance_text(DisturbanceRanges())
