"""The battery followed on the way is that of the whole account."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrmg.energy.metering import TimedStates, battery_content, find_visits
from mrmg.scene.loading import scene_from_document
from mrmg.scene.types import Scene
from mrmg.supervision.battery import BatteryTracker

TOUR = ("s", "g", "s")


def mission(station: dict[str, float], battery: dict[str, float]) -> Scene:
    return scene_from_document(
        {
            "format": 1,
            "name": "mission",
            "bounds": [-10, -5, 20, 5],
            "goals": [{"id": "g", "circle": {"center": [9, 0], "radius": 1}}],
            "stations": [
                {"id": "s", "circle": {"center": [0, 0], "radius": 1}, **station}
            ],
            "battery": {"capacity_J": 100, **battery},
            "robots": [
                {"id": "r", "model": "car", "pose": [5, 0, 0], "start_energy": 0.5}
            ],
        },
        source="mission",
    )


@pytest.mark.parametrize("battery", [{}, {"charging_power": 7.0}])
@pytest.mark.parametrize("station", [{}, {"dwell": 1.5}])
@settings(max_examples=30)
@given(
    st.lists(st.sampled_from([-9.0, 0.0, 9.0]), min_size=40, max_size=40),
    st.integers(1, 39),
)
def test_it_comes_to_the_same_in_pieces(
    station: dict[str, float], battery: dict[str, float], x: list[float], piece: int
) -> None:
    scene = mission(station, battery)
    time_s = np.arange(len(x)) * 0.5
    state = np.zeros((len(x), 5))
    state[:, 0] = np.repeat(x, 3)[: len(x)]
    draw_J = np.full(len(x) - 1, 0.7)
    motion = TimedStates(robot="r", time_s=time_s, state=state)
    visits = find_visits(scene, motion, TOUR)
    # The account goes on behind a target that was left out; the tracker waits for it.
    if [visit.target for visit in visits] != list(TOUR[: len(visits)]):
        return
    tracker = BatteryTracker(scene, scene.robots[0])
    tracker.follow(TOUR)
    for start in range(0, len(draw_J), piece):
        end = min(start + piece, len(draw_J))
        tracker.add(
            time_s[start : end + 1], state[start : end + 1, :2], draw_J[start:end]
        )
    expected = battery_content(scene, motion, draw_J, visits)[0][-1]
    assert tracker.charge_J == pytest.approx(expected)
