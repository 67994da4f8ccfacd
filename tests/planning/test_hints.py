"""Hints: what is said of a plan that keeps less than was asked for."""

from __future__ import annotations

import re

import pytest

import mrmg
from mrmg.energy.metering import battery_profile
from mrmg.planning import PlannerParams, plan_mission


@pytest.mark.parametrize("wanted", [0.0, 0.1, 0.6])
def test_plans_that_leave_less_charge_than_was_asked_for_say_so(wanted: float) -> None:
    scene = mrmg.load_scene("quickstart")
    params = PlannerParams(soc_margin=wanted, improvements=0)
    result = plan_mission(scene, params=params)
    assert result.plan is not None
    left = {}
    for trajectory in result.plan.trajectories:
        battery = scene.robot(trajectory.robot).battery
        least_J = battery_profile(scene, trajectory, result.plan.visits).min()
        left[trajectory.robot] = (least_J - battery.reserve_J) / battery.capacity_J
    less = [robot for robot, share in left.items() if share < wanted]
    hints = [hint for hint in result.hints if "above the reserve" in hint]
    assert len(hints) == (len(less) > 0) == (wanted == 0.6)
    for hint in hints:
        assert hint.startswith(", ".join(less))
        shares = [int(share) for share in re.findall(r"(\d+) %", hint)]
        assert shares == [round(100 * min(left.values())), 60]
