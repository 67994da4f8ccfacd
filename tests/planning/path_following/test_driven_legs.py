"""Energies of legs as they were driven."""

from __future__ import annotations

import numpy as np

from mrmg.planning import PlannerParams
from mrmg.planning.path_following.driven_legs import Driven, with_driven_legs
from mrmg.planning.problem.problem import state_mission
from mrmg.scene.loading import scene_from_document


def test_driven_legs_have_no_route_margin() -> None:
    """Neither energies nor times keep what was added to the roadmap's."""
    scene = scene_from_document(
        {
            "format": 1,
            "name": "two",
            "bounds": [0, 0, 30, 20],
            "goals": [
                {"id": "a", "circle": {"center": [12, 10], "radius": 1}},
                {"id": "b", "circle": {"center": [25, 10], "radius": 1}},
            ],
            "time_limit": 100,
            "battery": {"capacity_m": 300},
            "robots": [{"id": "r1", "model": "car", "pose": [4, 10, 0]}],
        },
        source="two",
    )
    problem = state_mission(scene, 0, PlannerParams(route_margin=0.08))
    plain = problem.with_margin(0.0).mission.routing
    home, twice_J = int(plain.home[0]), 2.0 * plain.cost[0, plain.home[0], 0]
    took = Driven(leg_J={(0, home, 0): twice_J}, rest_J={0: 70.0})
    driven = with_driven_legs(problem, took)
    again = driven.with_margin(0.0).mission.routing
    assert np.isclose(again.cost[0, home, 0], twice_J)
    assert np.allclose(again.cost[0, 0, 1], 2.0 * plain.cost[0, 0, 1])
    assert np.allclose(again.finish, 2.0 * plain.finish + 70.0)
    assert np.allclose(again.time, plain.time)
    assert np.allclose(again.finish_time, plain.finish_time)
