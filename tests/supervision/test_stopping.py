"""Stopping keeps clear: by full braking where that is clear, else along the plan."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from mrmg.plans import Trajectory
from mrmg.scene.types import Scene
from mrmg.supervision.stopping import (
    ENOUGH_M,
    Motion,
    brake_to_rest,
    clearance_m,
    motions_to_rest,
)

DT_S = 0.1


def cruise(robot: str, at: tuple[float, float], yaw: float, psi: float) -> Trajectory:
    """A car driving a circle (or straight on) at 1.5 m/s for 6 s."""
    states = [np.array([*at, yaw, 1.5, psi])]
    for _ in range(60):
        x, y, theta, v, w = states[-1]
        turn = v * np.tan(w) / 1.2
        middle = theta + 0.5 * DT_S * turn
        step = np.array([v * np.cos(middle), v * np.sin(middle), turn, 0.0, 0.0])
        states.append(states[-1] + DT_S * step)
    return Trajectory(
        robot=robot, dt_s=DT_S, state=np.array(states), control=np.zeros((60, 2))
    )


STEP = 5


def to_rest(
    scene: Scene, trajectories: list[Trajectory], broken: frozenset[str] = frozenset()
) -> dict[str, Motion]:
    states = {item.robot: item.state[STEP] for item in trajectories}
    return motions_to_rest(scene, trajectories, STEP, states, broken)


def braked(scene: Scene, item: Trajectory) -> Motion:
    return brake_to_rest(scene.robot(item.robot).model, item.state[STEP], DT_S)


@pytest.fixture
def lonely(make_yard: Callable[..., Scene]) -> tuple[Scene, list[Trajectory]]:
    """A car that drives straight on, far from everything."""
    scene = make_yard(
        robots=[{"id": "r1", "model": "car", "pose": [10, 12, 0]}], stations=[]
    )
    way = cruise("r1", (10.0, 12.0), 0.0, 0.0)
    return scene, [way]


def test_full_braking_is_taken_where_it_is_clear(
    lonely: tuple[Scene, list[Trajectory]],
) -> None:
    scene, trajectories = lonely
    (states, controls) = to_rest(scene, trajectories)["r1"]
    limits = scene.robots[0].model.limits
    share = scene.robots[0].model.planning_share
    assert controls[0, 0] == pytest.approx(-share * limits.u1_max_m_s2)
    np.testing.assert_allclose(states[-1, 3:], 0.0, atol=1e-9)
    np.testing.assert_array_equal(states[0], trajectories[0].state[5])


def crossing(make_yard: Callable[..., Scene]) -> tuple[Scene, list[Trajectory]]:
    """Two cars side by side that swerve: with steering held they would meet."""
    scene = make_yard(
        robots=[
            {"id": "r1", "model": "car", "pose": [10, 10.0, 0]},
            {"id": "r2", "model": "car", "pose": [10, 11.55, 0]},
        ]
    )
    left = cruise("r1", (10.0, 10.0), 0.0, 0.0)
    state = left.state.copy()
    # The plan steers back at once, which held steering does not know of.
    state[5, 4] = 0.55
    first = Trajectory(robot="r1", dt_s=DT_S, state=state, control=left.control)
    return scene, [first, cruise("r2", (10.0, 11.55), 0.0, 0.0)]


def test_else_the_fleet_stops_along_its_plan(make_yard: Callable[..., Scene]) -> None:
    scene, trajectories = crossing(make_yard)
    committed = {item.robot: braked(scene, item) for item in trajectories}
    assert clearance_m(scene, committed) < ENOUGH_M
    motions = to_rest(scene, trajectories)
    assert clearance_m(scene, motions) > clearance_m(scene, committed)
    for item in trajectories:
        states, controls = motions[item.robot]
        assert len(states) == len(controls) + 1
        np.testing.assert_allclose(states[-1, 3:], 0.0, atol=1e-9)
        off_m = np.abs(states[:, 1] - item.state[0, 1])
        assert off_m.max() < 1e-9, "left its planned way"
        assert (np.diff(states[:, 0]) >= -1e-12).all()


def test_who_is_broken_only_brakes(make_yard: Callable[..., Scene]) -> None:
    scene, trajectories = crossing(make_yard)
    states, _ = to_rest(scene, trajectories, broken=frozenset({"r1"}))["r1"]
    expected, _ = braked(scene, trajectories[0])
    np.testing.assert_array_equal(states, expected)
