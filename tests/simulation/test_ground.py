"""What the simulated ground takes is the MJCF's affair; robot.yaml holds a belief."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from mrmg.scene.loading import load_scene
from mrmg.scene.types import Scene
from mrmg.simulation.ground import Ground, TerrainUnderfoot, believed_resistance
from mrmg.simulation.simulation import simulate
from mrmg.world.terrain import multipliers_at


@pytest.fixture(scope="module")
def scene(driving: SimpleNamespace) -> Scene:
    return driving.open_ground([(0.0, 0.0, 0.0), (0.0, 5.0, 0.0)])


def believing(scene: Scene, **values: float) -> Scene:
    """The scene with other coefficients in the robots' energy models."""
    robots = tuple(
        replace(robot, model=replace(robot.model, **values)) for robot in scene.robots
    )
    return replace(scene, robots=robots)


def test_resistance_is_the_energy_models_power_over_the_speed(scene: Scene) -> None:
    model = scene.robots[0].model.energy_model
    multiplier, steer = np.array([3.0, 1.0]), np.array([-0.4, 0.2])
    turning_multiplier = np.array([1.0, 2.5])
    ground = Ground(multiplier, steer, turning_multiplier)
    force = believed_resistance(scene).force_N(ground)
    turn_speed = turning_multiplier * np.abs(np.tan(steer))
    parts = model.power_parts(
        np.ones(2), np.zeros(2), turn_speed, multiplier, np.zeros(2)
    )
    np.testing.assert_allclose(force / model.drive_efficiency, parts.sum(axis=1))


def test_a_wrong_belief_does_not_change_what_driving_takes(
    driving: SimpleNamespace, scene: Scene
) -> None:
    """A robot thought to roll twice as easily does the same work on the same way."""
    work_J = []
    for coefficient in (0.06, 0.03):
        held = believing(scene, rolling_coefficient=coefficient)
        controls = [driving.straight(8.0, 1.0), np.zeros((80, 2))]
        log = simulate(held, driving.plan_of(held, controls))
        work_J.append(log.work_J[0].sum())
    assert work_J[1] == pytest.approx(work_J[0], rel=0.01)
    assert work_J[0] == pytest.approx(0.06 * 180 * 9.81 * 7.0, rel=0.01)


@pytest.mark.parametrize("name", ["scene2", "hills", "quickstart"])
def test_terrain_underfoot_is_the_scenes(name: str) -> None:
    """Inside, outside and on the borders of areas."""
    scene = load_scene(name)
    terrain = tuple(
        replace(area, turning_multiplier=1.5 + number)
        for number, area in enumerate(scene.terrain)
    )
    scene = replace(scene, terrain=terrain)
    x_min, y_min, x_max, y_max = scene.bounds
    rng = np.random.default_rng(3)
    places = rng.uniform((x_min - 5, y_min - 5), (x_max + 5, y_max + 5), (2000, 2))
    borders = [np.array(area.shape.exterior.coords) for area in scene.terrain]
    points = np.concatenate([places, *borders])
    rolling, turning = multipliers_at(scene, points)
    np.testing.assert_array_equal(
        TerrainUnderfoot(scene).under(*points.T), [rolling, turning]
    )
    assert len(np.unique(rolling)) > 1
    assert len(np.unique(turning)) > 1
