"""Missions whose ground takes what robots' consumers draw, or that do without them."""

from __future__ import annotations

from dataclasses import replace

from mrmg.scene.types import Scene


def without_consumers(scene: Scene) -> Scene:
    """Return a mission whose robots' consumers draw nothing."""
    robots = [
        replace(one, model=replace(one.model, idle_power_W=0.0, device_power_W=0.0))
        for one in scene.robots
    ]
    return replace(scene, robots=tuple(robots))


def with_consumers_as_ground(scene: Scene) -> Scene:
    """Return a mission whose ground takes what consumers draw on it, too, at least.

    On each metre of ground of multiplier k a robot takes plain k, and its consumers
    draw at least plain c, with c from `RobotModel.consumed_per_m`. Rolling resistance
    is 1 + c times as high here, and multipliers are (k + c) / (1 + c), with c that of
    the robot whose consumers draw least: so no way takes more than it really does.
    """
    robots = scene.robots
    least = min(one.model.consumed_per_m(one.model.top_speed_m_s) for one in robots)
    if least == 0.0:
        return scene
    return replace(
        scene,
        terrain=tuple(
            replace(area, multiplier=(area.multiplier + least) / (1.0 + least))
            for area in scene.terrain
        ),
        robots=tuple(
            replace(
                one,
                model=replace(
                    one.model,
                    rolling_coefficient=one.model.rolling_coefficient * (1.0 + least),
                ),
            )
            for one in robots
        ),
    )
