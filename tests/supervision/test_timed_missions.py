"""Missions with a time limit when a robot breaks down on the way."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from mrmg.energy.audit import audit
from mrmg.energy.mission_failures import over_s
from mrmg.planning import plan_mission
from mrmg.scene.types import Scene
from mrmg.supervision.driving import drive_mission


@pytest.mark.slow
@pytest.mark.parametrize(("spare", "causes"), [(2.5, ()), (1.15, ("late",))])
def test_goals_are_visited_in_time_if_possible_and_late_rather_than_not(
    make_yard: Callable[..., Scene], spare: float, causes: tuple[str, ...]
) -> None:
    wishes: dict[str, Any] = {"objective": "makespan"}
    soonest = plan_mission(make_yard(**wishes), seed=0).plan
    assert soonest is not None
    scene = make_yard(time_limit=round(spare * soonest.makespan_s, 1), **wishes)
    plan = plan_mission(scene, seed=0).plan
    assert plan is not None
    driven = drive_mission(scene, plan, faults=["r2@3s"])
    account = audit(scene, driven.plan, driven.log)
    assert len(account.goals_visited) == len(scene.goals)
    assert account.causes == causes
    assert bool(causes) == (over_s(scene, driven.log) > scene.time_limit_s)
