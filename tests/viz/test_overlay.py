"""The panel: it shows the reading."""

from __future__ import annotations

import numpy as np
import pytest

from mrmg.viz import style
from mrmg.viz.overlay import Panel, Reading, RobotReading


def reading(charge: float = 0.8, **changes) -> Reading:
    robot = RobotReading(robot="r1", charge=charge, speed_m_s=1.5, heading_for="g")
    values = {"time_s": 61.5, "used_J": 1e3, "visited": {}, "robots": (robot,)}
    return Reading(**{**values, **changes})


@pytest.fixture
def panel(make_scene) -> Panel:
    return Panel(make_scene(), (330, 720), speed=8.0, video_height=720)


def count(picture: np.ndarray, color: tuple[int, int, int]) -> int:
    return int((picture == np.array(color, dtype=np.uint8)).all(axis=2).sum())


def test_equal_readings_give_equal_panels_and_time_changes_them(panel: Panel) -> None:
    first = panel.draw(reading())
    assert first.shape == (720, 330, 3)
    assert np.array_equal(first, panel.draw(reading()))
    assert not np.array_equal(first, panel.draw(reading(time_s=61.7)))


def test_the_clock_never_shows_sixty_seconds() -> None:
    times = {59.94: "00:59.9", 59.97: "01:00.0", 61.5: "01:01.5"}
    for time_s, shown in times.items():
        assert reading(time_s=time_s).clock == shown


def test_bar_grows_with_the_charge_and_turns_red_near_the_reserve(panel: Panel) -> None:
    full, low = (95, 208, 165), (255, 107, 94)
    half, whole = panel.draw(reading(0.5)), panel.draw(reading(1.0))
    assert count(half, low) == count(whole, low) == 0
    assert count(half, full) == pytest.approx(0.5 * count(whole, full), rel=0.03)
    empty = panel.draw(reading(0.1))
    assert count(empty, full) == 0
    assert count(empty, low) > 0


def test_visited_goals_take_the_robot_s_color(panel: Panel, make_scene) -> None:
    color = style.rgb(style.scene_robot_colors(make_scene())["r1"])
    before = count(panel.draw(reading()), color)
    after = count(panel.draw(reading(visited={"g": "r1"})), color)
    assert after > before + 100


def test_eight_robots_fit_above_the_legend(make_scene) -> None:
    robots = [
        {"id": f"r{n}", "model": "car", "pose": [3 + 4 * n, 3, 0]} for n in range(8)
    ]
    scene = make_scene(robots=robots)
    many = tuple(
        RobotReading(robot=robot["id"], charge=0.5, speed_m_s=0.0, heading_for="")
        for robot in robots
    )
    drawn = Panel(scene, (330, 720), 8.0, 720).draw(reading(robots=many))
    for color in style.scene_robot_colors(scene).values():
        rows = np.nonzero((drawn == style.rgb(color)).all(axis=2).any(axis=1))[0]
        assert 15 <= np.ptp(rows) <= 60


def test_the_legend_names_obstacles_for_some_robots_where_there_are_any(
    make_scene,
) -> None:
    color = style.rgb(style.PARTIAL_OBSTACLE)
    box = {"box": {"center": [30, 5], "size": [4, 4]}}
    for blocks, shown in (({}, False), ({"blocks": ["r1"]}, True)):
        scene = make_scene(obstacles=[{**box, **blocks}])
        drawn = Panel(scene, (330, 720), 8.0, 720).draw(reading())
        assert (count(drawn, color) > 100) is shown


@pytest.mark.parametrize(
    ("heading_for", "standing", "output"),
    [("g1", "", "to g1"), ("", "", "tour done"), ("g1", "broken down", "broken down")],
)
def test_a_robot_s_target_is_shown(
    heading_for: str, standing: str, output: str
) -> None:
    robot = RobotReading(
        robot="r1",
        charge=0.5,
        speed_m_s=0.0,
        heading_for=heading_for,
        standing=standing,
    )
    assert robot.way("to") == output
