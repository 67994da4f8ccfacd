"""What counts as a visit, and what stations give."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mrmg.energy.metering import TimedStates, battery_content
from mrmg.energy.visits import Stay, crowded_stations, first_stay, is_at, runs
from mrmg.plans import Visit
from mrmg.scene.loading import scene_from_document
from mrmg.scene.region import Region
from mrmg.scene.types import Goal, Scene

DT_S = 0.5
AT, AWAY = (0.0, 0.0), (9.0, 0.0)
ROUND = Region(center=np.zeros(2), radius_m=1.0, corners=np.zeros((0, 2)))


def longest_stay_s(target, time_s: np.ndarray, poses: np.ndarray) -> float:
    stays = runs(is_at(target, poses))
    return max(
        (float(time_s[end - 1] - time_s[first]) for first, end in stays),
        default=-np.inf,
    )


def way(presence: str) -> tuple[np.ndarray, np.ndarray]:
    """Return times and positions of a robot that is at the origin at each x."""
    points = np.array([AT if mark == "x" else AWAY for mark in presence])
    return np.arange(len(points)) * DT_S, points


@pytest.mark.parametrize(
    ("presence", "dwell_s", "start", "stay"),
    [
        ("..xx..", 0.0, 0, Stay(2, 2)),
        ("..xx..", 0.5, 0, Stay(2, 3)),
        ("..xx..", 1.0, 0, None),
        (".xx.xxx", 1.0, 0, Stay(4, 6)),
        ("xxxxxx", 1.0, 3, Stay(3, 5)),
        ("......", 0.0, 0, None),
    ],
)
def test_a_visit_is_the_first_stay_that_is_long_enough(
    presence: str, dwell_s: float, start: int, stay: Stay | None
) -> None:
    goal = Goal(id="g", region=ROUND, dwell_s=dwell_s)
    assert first_stay(goal, *way(presence), start) == stay


@pytest.mark.parametrize(
    ("heading", "yaw", "visited"),
    [
        (None, 2.0, True),
        (2.0, 2.2, True),
        (2.0, 1.69, False),
        (np.pi, -np.pi + 0.29, True),  # across the seam of angles
        (-3.0, 3.0 + 2.0 * np.pi, True),  # yaws of drives count full turns
        (0.0, np.pi, False),
    ],
)
def test_a_goal_with_a_heading_is_visited_with_it(
    heading: float | None, yaw: float, visited: bool
) -> None:
    goal = Goal(id="g", region=ROUND, heading_rad=heading, heading_tolerance_rad=0.3)
    time_s, points = way("..xx..")
    poses = np.column_stack([points, np.full(len(points), yaw)])
    assert (first_stay(goal, time_s, poses, 0) == Stay(2, 2)) == visited


@given(st.text(alphabet="x.", min_size=1, max_size=60), st.integers(0, 12))
def test_there_is_a_visit_exactly_if_the_longest_stay_is_long_enough(
    presence: str, steps: int
) -> None:
    goal = Goal(id="g", region=ROUND, dwell_s=steps * DT_S)
    stay = first_stay(goal, *way(presence), 0)
    longest = max(map(len, presence.split("."))) - 1
    assert (stay is not None) == (longest >= steps)
    if longest >= 0:
        assert longest_stay_s(goal, *way(presence)) == pytest.approx(longest * DT_S)
    if stay is not None:
        spell = presence[stay.first : stay.over + 1]
        assert spell == "x" * (steps + 1)
        assert "x" * (steps + 1) not in presence[: stay.over]


def one_station(**battery: float) -> Scene:
    return scene_from_document(
        {
            "format": 1,
            "name": "one station",
            "bounds": [-5, -5, 20, 5],
            "stations": [{"id": "s", "circle": {"center": list(AT), "radius": 1}}],
            "battery": {"capacity_J": 100, **battery},
            "robots": [
                {"id": "r", "model": "car", "pose": [9, 0, 0], "start_energy": 0.5}
            ],
        },
        source="one station",
    )


def visit_at(step: int) -> Visit:
    return Visit("r", "s", "station", step, step * DT_S, 0.0)


def contents(
    scene: Scene, presence: str, step: int, draw_J: float | list[float]
) -> np.ndarray:
    """Return the battery content at each state after a recharge."""
    time_s, points = way(presence)
    state = np.column_stack([points, np.zeros((len(points), 3))])
    motion = TimedStates(robot="r", time_s=time_s, state=state)
    draws_J = np.full(len(time_s) - 1, draw_J)
    return battery_content(scene, motion, draws_J, [visit_at(step)])[0]


def test_charging_takes_the_time_a_robot_is_there() -> None:
    scene = one_station(charging_power=20.0)
    found = contents(scene, "..xxxx..", 2, 1.0)
    # It draws 1 J over each half second, and is given 10 J over three of them.
    assert found.tolist() == [50, 49, 48, 57, 66, 75, 74, 73]


def test_no_more_is_given_than_the_battery_holds() -> None:
    found = contents(one_station(charging_power=60.0), "xxxxx.", 0, 1.0)
    assert found.tolist() == [50, 79, 100, 100, 100, 99]


def test_without_a_power_the_battery_is_full_on_arrival() -> None:
    found = contents(one_station(), ".xxx.", 1, 1.0)
    assert found.tolist() == [50, 100, 99, 98, 97]


@given(st.floats(1e6, 1e12))
def test_a_huge_power_fills_at_once(power_W: float) -> None:
    quick = contents(one_station(charging_power=power_W), ".xxx..", 1, 1.0)
    at_once = contents(one_station(), ".xxx..", 1, 1.0)
    # It also makes up for what is drawn while the robot is there.
    assert quick[2] == 100.0
    assert np.all(quick[2:] - at_once[2:] <= 2.0)
    assert np.all(quick[2:] >= at_once[2:])


@given(
    st.lists(st.floats(-9.0, 9.0), min_size=1, max_size=30),
    st.text(alphabet="x.", min_size=31, max_size=31),
    st.floats(1.0, 50.0),
)
def test_a_battery_never_holds_more_than_its_capacity(
    draw: list[float], presence: str, power_W: float
) -> None:
    there = presence[: len(draw) + 1]
    found = contents(one_station(charging_power=power_W), there, 0, draw)
    assert found.max() <= 100.0
    stays = np.array([pair == "xx" for pair in map("".join, pairwise(there))])
    assert np.all(np.diff(found) <= power_W * DT_S * stays - np.array(draw) + 1e-9)


def test_a_station_for_one_names_those_who_share_it() -> None:
    scene = one_station()
    document = scene.document
    document["stations"][0]["capacity"] = 1
    exclusive = scene_from_document(document, source="exclusive")
    ways = {"a": way("..xxx.")[1], "b": way("....xx")[1], "c": way(".x....")[1]}
    (found,) = crowded_stations(exclusive, ways)
    assert (found.station, found.robots, found.first, found.end) == (
        "s",
        ("a", "b"),
        4,
        5,
    )
    document["stations"][0].pop("capacity")
    assert not list(crowded_stations(scene_from_document(document, source="s"), ways))
