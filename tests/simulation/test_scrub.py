"""The plant `scrub` takes what its formulas say, wheel by wheel."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from mrmg.errors import UsageError
from mrmg.scene.types import Scene
from mrmg.simulation.log import ExecutionLog
from mrmg.simulation.scrub import (
    LOAD_EXPONENT,
    PATCH_SHARE,
    SLIP_STIFFNESS,
    SPEED_PER_M_S,
)
from mrmg.simulation.simulation import simulate

GRAVITY = 9.81


def driven(
    driving: SimpleNamespace, controls: np.ndarray, plant: str = "scrub", **parts: Any
) -> tuple[Scene, ExecutionLog]:
    scene = driving.open_ground([(-20.0, 0.0, 0.0)], **parts)
    log = simulate(scene, driving.plan_of(scene, [controls]), plant=plant)
    assert log.completed
    return scene, log


def cruise_W(log: ExecutionLog, first_s: float, last_s: float) -> float:
    ticks = slice(*np.searchsorted(log.time_s, [first_s, last_s]))
    return float(log.work_J[0, ticks].sum()) / (last_s - first_s)


def straight_W(scene: Scene, speed: float, left: float, right: float) -> float:
    """Power of a car straight on, its left and right wheels on these terrains."""
    model = scene.robots[0].model
    weight_N = model.mass_kg * GRAVITY
    front = model.center_of_mass_m / model.wheelbase_m
    usual_N = weight_N / 4
    drag = []
    for share in (front, 1.0 - front):
        for factor in (left, right):
            load_N = 0.5 * share * weight_N
            coefficient = 0.06 * factor * (1.0 + SPEED_PER_M_S * speed)
            thin = (load_N / usual_N) ** (LOAD_EXPONENT - 1.0)
            drag.append(coefficient * thin * load_N)
    # The rear wheels push what holds the front ones back, and creep by that.
    load_N = 0.5 * (1.0 - front) * weight_N
    push_N = 0.5 * (drag[0] + drag[1])
    slip = 3.0 / SLIP_STIFFNESS * (1.0 - (1.0 - push_N / load_N) ** (1.0 / 3.0))
    return (sum(drag) + 2.0 * push_N * slip) * speed


@pytest.mark.parametrize(("left", "right"), [(1.0, 1.0), (3.0, 3.0), (1.0, 3.0)])
def test_straight_on_every_wheel_has_its_own_ground(
    driving: SimpleNamespace, left: float, right: float
) -> None:
    corners = {
        "left": [[-60, 0], [60, 0], [60, 60], [-60, 60]],
        "right": [[-60, -60], [60, -60], [60, 0], [-60, 0]],
    }
    terrain = [
        {"id": side, "multiplier": factor, "polygon": corners[side]}
        for side, factor in (("left", left), ("right", right))
    ]
    scene, log = driven(driving, driving.straight(16.0, 1.5, 0.5), terrain=terrain)
    expected_W = straight_W(scene, 1.5, left, right)
    assert cruise_W(log, 5.0, 11.0) == pytest.approx(expected_W, rel=0.02)


def spin(rate: float, seconds: float) -> np.ndarray:
    """Controls of a turn on the spot."""
    steps, ramp = round(10 * seconds), round(10 * rate)
    turn = np.zeros(steps)
    turn[:ramp], turn[-ramp:] = 1.0, -1.0
    return np.stack([np.zeros(steps), turn], axis=1)


def test_turning_on_the_spot_is_scrub_and_rolling(driving: SimpleNamespace) -> None:
    scene, log = driven(driving, spin(0.8, 14.0), models=["diffdrive"])
    model = scene.robots[0].model
    weight_N, half_m = model.mass_kg * GRAVITY, model.track_m / 2
    wheels_N = weight_N * (1.0 - model.center_of_mass_m / 0.4)  # the caster leads 0.4 m
    caster_N = weight_N - wheels_N
    patch_m = PATCH_SHARE * model.wheel_radius_m
    usual_N = weight_N / 2

    def drag_N(load_N: float, number: int, speed: float) -> float:
        thin = (load_N / number / usual_N) ** (LOAD_EXPONENT - 1.0)
        return 0.05 * (1.0 + SPEED_PER_M_S * speed) * thin * load_N

    scrub_Nm = 2.0 / 3.0 * wheels_N * patch_m
    rolling_Nm = drag_N(wheels_N, 2, 0.8 * half_m) * half_m
    swung_Nm = drag_N(caster_N, 1, 0.0) * 0.4
    expected_W = 0.8 * (scrub_Nm + rolling_Nm + swung_Nm)
    rate = np.abs(np.gradient(log.state[0, :, 2], log.time_s))
    cruise = (log.time_s > 6.0) & (log.time_s < 12.0)
    assert rate[cruise].mean() == pytest.approx(0.8, rel=0.05)
    found_W = cruise_W(log, 6.0, 12.0) * 0.8 / rate[cruise].mean()
    assert found_W == pytest.approx(expected_W, rel=0.05)


def test_a_radian_of_a_tight_turn_costs_more_than_one_of_a_wide_turn(
    driving: SimpleNamespace,
) -> None:
    """The energy model charges every radian alike."""

    def surplus_J_per_rad(steer: float) -> float:
        ramp = round(10 * steer)
        controls = driving.straight(24.0, 1.0, 0.5)
        controls[30 : 30 + ramp, 1] = 1.0
        controls[-30 - ramp : -30, 1] = -1.0
        _, log = driven(driving, controls)
        _, ahead = driven(driving, driving.straight(24.0, 1.0, 0.5))
        turned = np.ptp(log.state[0, :, 2])
        way = np.abs(log.state[0, :, 3]).sum() / np.abs(ahead.state[0, :, 3]).sum()
        return float(log.work_J.sum() - way * ahead.work_J.sum()) / float(turned)

    wide, tight = surplus_J_per_rad(0.1), surplus_J_per_rad(0.5)
    assert 0.0 < wide < 0.85 * tight


def test_wheels_toed_on_the_facets_of_a_hollow_lose_no_more_than_on_a_plain(
    driving: SimpleNamespace,
) -> None:
    """In MuJoCo the front wheels push against each other there with all their grip."""
    height_m = 0.32 * np.cos(2.0 * np.pi / 20.0 * np.arange(-60.0, 61.0))
    controls = driving.straight(20.0, 1.2, 0.5)
    lost_J = []
    for parts in ({}, {"elevation": {"grid": [height_m.tolist()] * 2}}):
        _, log = driven(driving, controls, **parts)
        assert log.balance_J is not None
        lost_J.append(log.balance_J[0, 3])
    assert lost_J[1] == pytest.approx(lost_J[0], rel=0.03)


def test_the_balance_holds_and_the_log_names_the_plant(
    driving: SimpleNamespace,
) -> None:
    scene = driving.open_ground([(0.0, 0.0, 0.3)])
    plan = driving.plan_of(scene, [driving.bang_bang(scene, "r1", 10.0, seed=2)])
    log = simulate(scene, plan, plant="scrub")
    assert log.plant == "scrub"
    assert log.balance_J is not None
    steering_J, *became_J = log.balance_J[0]
    work_J = log.work_J.sum()
    assert abs(work_J + steering_J - sum(became_J)) < 0.005 * work_J
    assert simulate(scene, plan, plant="scrub").digest == log.digest
    usual = simulate(scene, plan)
    assert usual.plant == "default"
    assert usual.digest != log.digest


def test_a_change_of_rolling_and_grip_counts_here_too(driving: SimpleNamespace) -> None:
    from mrmg.simulation.disturbance import DisturbanceRanges

    scene = driving.open_ground([(-20.0, 0.0, 0.0)])
    plan = driving.plan_of(scene, [driving.straight(16.0, 1.5, 0.5)])
    drawn = DisturbanceRanges().draw(0, ["r1"])
    heavier = replace(drawn, robots=(replace(drawn.robots[0], rolling=0.5),))
    plain = simulate(scene, plan, plant="scrub", disturbance=drawn)
    hard = simulate(scene, plan, plant="scrub", disturbance=heavier)
    ratio = hard.work_J.sum() / plain.work_J.sum()
    assert ratio == pytest.approx(1.5, rel=0.02)


def test_a_plant_that_there_is_none_of_is_refused(driving: SimpleNamespace) -> None:
    scene = driving.open_ground([(0.0, 0.0, 0.0)])
    plan = driving.plan_of(scene, [driving.straight(5.0, 0.5)])
    with pytest.raises(UsageError, match="'ice' is not known; allowed: default, scrub"):
        simulate(scene, plan, plant="ice")
