"""What each robot does when, against closed forms."""

from __future__ import annotations

import numpy as np

from mrmg.energy.battery_curves import shown_curves
from mrmg.energy.metering import TimedStates, find_visits
from mrmg.viz.activities import activities


def motion_of(speed: list[tuple[float, float]], tick_s: float = 0.1) -> TimedStates:
    """Return a drive along x from (duration [s], speed [m/s]) pieces."""
    v = np.concatenate([np.full(round(t / tick_s), v) for t, v in speed] + [[0.0]])
    state = np.zeros((len(v), 5))
    state[:, 0] = 5.0 + np.concatenate([[0.0], np.cumsum(v[:-1]) * tick_s])
    state[:, 1], state[:, 3] = 10.0, v
    return TimedStates(robot="r1", time_s=tick_s * np.arange(len(v)), state=state)


def output(spans) -> list[tuple[str, float, float]]:
    return [(s.kind, round(s.start_s, 6), round(s.end_s, 6)) for s in spans]


def test_activities_are_the_pieces_of_the_drive(make_scene) -> None:
    motion = motion_of([(2.0, 1.0), (3.0, 0.0), (4.0, 2.0), (1.5, 0.0)])
    assert output(activities(make_scene(), motion, ())) == [
        ("driving", 0.0, 2.0),
        ("waiting", 2.0, 5.0),
        ("driving", 5.0, 9.0),
        ("finished", 9.0, 10.5),
    ]


def test_a_moment_s_standing_still_is_part_of_driving(make_scene) -> None:
    motion = motion_of([(2.0, 1.0), (0.3, 0.0), (2.0, -1.0), (1.0, 0.0)])
    assert output(activities(make_scene(), motion, ())) == [
        ("driving", 0.0, 4.3),
        ("finished", 4.3, 5.3),
    ]


def test_charging_lasts_while_the_robot_is_in_the_station_of_its_tour(
    make_scene,
) -> None:
    scene = make_scene(
        stations=[{"id": "s", "circle": {"center": [10, 10], "radius": 1}}]
    )
    motion = motion_of([(20.0, 1.0), (1.0, 0.0)])
    visits = find_visits(scene, motion, ("s", "g"))
    spans = activities(scene, motion, visits)
    assert output(spans)[:3] == [
        ("driving", 0.0, 4.0),
        ("charging", 4.0, 6.1),
        ("driving", 6.1, 20.0),
    ]
    assert spans[1].target == "s"
    passing_by = activities(scene, motion, ())
    assert [span.kind for span in passing_by] == ["driving", "finished"]


def test_activities_leave_no_gap(case, make_log) -> None:
    scene, plan = case()
    for motion in shown_curves(scene, plan, make_log(scene, plan)):
        spans = activities(scene, motion, ())
        assert spans[0].start_s == 0.0
        assert spans[-1].end_s == motion.time_s[-1]
        for before, after in zip(spans, spans[1:], strict=False):
            assert before.end_s == after.start_s
