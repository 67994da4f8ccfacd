"""Pauses: robots stand at the stops of their paths for as long as they must."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import mrmg
from mrmg.energy.metering import battery_profile
from mrmg.planning import PlannerParams, Request
from mrmg.planning.path_following.following import (
    LEAST_SOC_MARGIN,
    follow_tours,
    tour_path,
)
from mrmg.planning.path_following.pauses import with_pauses
from mrmg.planning.problem.problem import state_mission
from mrmg.planning.routers import find_router
from mrmg.planning.routing.routing import solve_routing
from mrmg.plans import Plan
from mrmg.scene.types import Scene

SCENES = Path(__file__).parents[2] / "scenes"
PARAMS = PlannerParams(samples=600)
REQUEST = Request(params=PARAMS, router=find_router(PARAMS.router), seed=0)


def followed(scene: Scene) -> Plan:
    problem = state_mission(scene, 0, PARAMS).with_soc_margin(LEAST_SOC_MARGIN)
    tours = solve_routing(problem.mission.routing, PARAMS.router, 0)
    plan = follow_tours(problem, REQUEST, tours).plan
    assert plan is not None
    return plan


def test_robots_stand_for_the_dwell_time_of_each_stop() -> None:
    scene = mrmg.load_scene(SCENES / "dwell.yaml")
    problem = state_mission(scene, 0, PARAMS)
    tour = list(range(len(scene.goals)))
    path = with_pauses(problem, 0, tour_path(problem, 0, tour))
    dwell_s = np.array([goal.dwell_s for goal in scene.goals])
    assert dwell_s.any()
    assert (path.pause_s >= dwell_s).all()
    assert (path.pause_s[dwell_s == 0.0] == 0.0).all()
    assert set(path.stop[dwell_s > 0.0]) <= set(path.edges)


@pytest.mark.parametrize("name", ["dwell", "charging"])
def test_plans_stay_long_enough(name: str) -> None:
    scene = mrmg.load_scene(SCENES / f"{name}.yaml")
    assert mrmg.verify(scene, followed(scene)).violations == ()


def test_robots_stand_at_stations_until_they_are_full_and_not_much_longer() -> None:
    scene = mrmg.load_scene(SCENES / "charging.yaml")
    plan = followed(scene)
    stations = {station.id: station for station in scene.stations}
    charged = 0
    for trajectory in plan.trajectories:
        battery = scene.robot(trajectory.robot).battery
        visits = [one for one in plan.visits if one.robot == trajectory.robot]
        energy_J = battery_profile(scene, trajectory, visits)
        for visit in visits:
            if visit.target in stations:
                charged += 1
                region = stations[visit.target].region
                inside = region.depth(trajectory.state[visit.step :, :2]) >= 0.0
                leaves = int(np.argmin(inside)) if not inside.all() else len(inside)
                own_J = energy_J[visit.step : visit.step + leaves]
                full = own_J >= 0.99 * battery.capacity_J
                assert full.any()
                assert full.sum() * trajectory.dt_s < 10.0
    assert charged
