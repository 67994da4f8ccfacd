"""How deep inside its targets a fleet drives."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import pytest

from mrmg.planning.problem.problem import Problem
from mrmg.planning.problem.targets import (
    LEAST_DEPTH_M,
    MOST_DEPTH_M,
    target_depth_m,
)
from mrmg.scene.loading import load_scene
from mrmg.scene.margins import TrackingError
from mrmg.scene.types import Scene


def straying(scene: Scene, *errors_m: float | None) -> Scene:
    """Return a scene whose robots have shown some disturbed tracking errors."""
    shown = [
        error and TrackingError(nominal_m=0.5 * error, disturbed_m=error)
        for error in errors_m
    ]
    robots = tuple(
        replace(robot, model=replace(robot.model, tracking_error=error))
        for robot, error in zip(scene.robots, shown, strict=True)
    )
    return replace(scene, robots=robots)


def test_the_robot_that_strays_most_decides() -> None:
    scene = load_scene("quickstart")
    several = replace(scene, robots=(scene.robots[0], scene.robots[0]))
    assert target_depth_m(straying(several, 0.02, 0.03)) == pytest.approx(0.09)
    assert target_depth_m(straying(several, 0.03, 0.02)) == pytest.approx(0.09)
    assert target_depth_m(straying(several, 0.001, 0.002)) == LEAST_DEPTH_M
    assert target_depth_m(straying(several, 0.02, 0.5)) == MOST_DEPTH_M
    speed = scene.robots[0].model.top_speed_m_s
    reckoned = target_depth_m(straying(scene, *[None] * len(scene.robots)))
    assert reckoned == pytest.approx(min(MOST_DEPTH_M, 3.0 * 0.0225 * speed))


def test_targets_shrink_by_that_depth(
    yard: Callable[..., Scene], state: Callable[..., Problem]
) -> None:
    for error_m, depth_m in ((0.02, 0.06), (0.035, 0.105)):
        problem = state(straying(yard(), error_m), samples=50)
        reach_m = problem.mission.targets.target["reach"][0]
        assert reach_m == pytest.approx(1.5 - depth_m)
