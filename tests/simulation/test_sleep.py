"""Robots that stand sleep in the driven world; the drawn one, in which none does, is
the oracle of what they do afterwards."""

from __future__ import annotations

from types import SimpleNamespace

import mujoco
import numpy as np
import pytest

from mrmg.scene.types import Scene
from mrmg.simulation.fleet import Fleet
from mrmg.simulation.world_model import build_world

STANDING_TICKS, DRIVEN_TICKS = 30, 60


@pytest.fixture(scope="module", params=["car", "diffdrive"])
def scene(driving: SimpleNamespace, request: pytest.FixtureRequest) -> Scene:
    """Two robots."""
    return driving.open_ground(
        [(0.0, 0.0, 0.0), (0.0, 8.0, 0.0)], models=[request.param]
    )


def driven(
    scene: Scene, force_N: float, w_end: float, *, sleeps: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Let the first robot stand, then command it; the second drives all the time.

    Returns:
        The state of the first one at the end, and which ones slept after standing.
    """
    world = build_world(scene, drawn=not sleeps)
    data = mujoco.MjData(world.model)
    fleet = Fleet(world, data)
    fleet.set_resistance(np.array([20.0, 20.0]), np.array([5.0, 5.0]))
    still, w = np.zeros(2), np.zeros(2)
    other = np.array([0.0, 40.0])
    for _ in range(STANDING_TICKS):
        fleet.drive(other, still, still, 5)
    slept = data.tree_asleep[world.model.body_treeid[world.chassis]] >= 0
    force = np.array([force_N, 40.0])
    for tick in range(DRIVEN_TICKS):
        following = np.array([w_end * (tick + 1) / DRIVEN_TICKS, 0.0])
        fleet.drive(force, w, following, 5)
        w = following
    return fleet.state()[0], slept


@pytest.mark.parametrize(
    ("force_N", "w_end"), [(40.0, 0.0), (-40.0, 0.0), (0.0, 0.4), (40.0, 0.4)]
)
def test_a_sleeper_that_is_commanded_moves_as_if_it_had_not_slept(
    scene: Scene, force_N: float, w_end: float
) -> None:
    state, slept = driven(scene, force_N, w_end, sleeps=True)
    expected, awake = driven(scene, force_N, w_end, sleeps=False)
    assert slept.tolist() == [True, False]
    assert not awake.any()
    assert np.abs(expected).max() > 0.1
    np.testing.assert_allclose(state, expected, atol=1e-4)


def test_what_is_not_drawn_changes_no_mass(scene: Scene) -> None:
    drawn, bare = build_world(scene).model, build_world(scene, drawn=False).model
    assert bare.ngeom < drawn.ngeom
    np.testing.assert_array_equal(bare.body_mass, drawn.body_mass)
    np.testing.assert_array_equal(bare.body_inertia, drawn.body_inertia)
