"""What is measured of a robot: energy, charge over recharges, rolling resistance."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from mrmg.energy.metering import TimedStates, battery_profile, find_visits
from mrmg.planning import plan_mission
from mrmg.plans import Plan
from mrmg.scene.types import Scene
from mrmg.simulation.disturbance_spec import parse_disturbance
from mrmg.simulation.log import ExecutionLog
from mrmg.simulation.simulation import simulate
from mrmg.supervision.metering import RobotMeter, RollingEstimate


def test_the_estimate_is_that_of_least_squares() -> None:
    rng = np.random.default_rng(3)
    x = rng.uniform(1.0, 10.0, 40)
    y = 1.3 * x + rng.normal(0.0, 0.5, 40)
    prior = 4.0
    estimate = RollingEstimate(prior)
    for pair in zip(x, y, strict=True):
        estimate.observe(*map(float, pair))
    expected = (prior**2 + x @ y) / (prior**2 + x @ x)
    assert estimate.factor == pytest.approx(expected)


def test_without_observations_the_model_is_believed() -> None:
    assert RollingEstimate(2.0).factor == 1.0


@pytest.fixture(scope="module")
def recharging(make_yard: Callable[..., Scene]) -> tuple[Scene, Plan]:
    """A robot that must recharge on its way."""
    scene = make_yard(
        robots=[{"id": "r1", "model": "car", "pose": [5, 18, 0]}],
        battery={"capacity_m": 45, "reserve": 0.05},
    )
    plan = plan_mission(scene, seed=0).plan
    assert plan is not None and "s1" in plan.tours["r1"]
    return scene, plan


def fed(scene: Scene, plan: Plan, log: ExecutionLog, ticks: int) -> RobotMeter:
    """A meter that saw a log in pieces of some ticks."""
    meter = RobotMeter(scene, scene.robots[0])
    meter.battery.follow(plan.tours["r1"])
    for start in range(0, len(log.time_s) - 1, ticks):
        end = min(start + ticks, len(log.time_s) - 1)
        meter.add(
            log.time_s[start : end + 1],
            log.state[0, start : end + 1],
            log.work_J[0, start:end],
        )
    return meter


def test_charge_is_followed_over_recharges(recharging: tuple[Scene, Plan]) -> None:
    scene, plan = recharging
    log = simulate(scene, plan)
    motion = TimedStates(robot="r1", time_s=log.time_s, state=log.state[0])
    visits = find_visits(scene, motion, plan.tours["r1"])
    end_J = battery_profile(scene, motion, visits)[-1]
    capacity_J = scene.robots[0].battery.capacity_J
    for ticks in (1, 25, 400):
        meter = fed(scene, plan, log, ticks)
        assert meter.battery.charge_J == pytest.approx(end_J, abs=0.005 * capacity_J)
        assert meter.used_J == pytest.approx(plan.cost_J, rel=0.02)
        assert meter.rolling.factor == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize("change", [-20, 30])
def test_changed_rolling_resistance_is_found(
    recharging: tuple[Scene, Plan], change: int
) -> None:
    scene, plan = recharging
    ranges = parse_disturbance(f"none,rolling={change:+d}%")
    log = simulate(scene, plan, disturbance=ranges.draw(0, ["r1"]))
    meter = fed(scene, plan, log, 25)
    assert meter.rolling.factor == pytest.approx(1.0 + change / 100.0, rel=0.02)
