"""Which of two plans is better."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import pytest

from mrmg.planning.preference import TIME_MARGIN_S, Preference
from mrmg.scene.objective import ENERGY, MAKESPAN, Objective


@dataclass(frozen=True)
class Figures:
    """Stands for a plan: nothing but cost and duration is asked for."""

    cost_J: float
    makespan_s: float


CHEAP: Any = Figures(100.0, 50.0)
SOON: Any = Figures(200.0, 30.0)


@pytest.mark.parametrize(
    ("objective", "limit_s", "better"),
    [
        (ENERGY, 60.0, CHEAP),
        (MAKESPAN, 60.0, SOON),
        (Objective(makespan_weight=4.0), 60.0, CHEAP),
        (Objective(makespan_weight=6.0), 60.0, SOON),
        (ENERGY, 40.0, SOON),  # the other one is late
        (ENERGY, 20.0, SOON),  # both are; this one less
    ],
)
def test_the_better_plan(objective: Objective, limit_s: float, better: Any) -> None:
    preference = Preference(objective=objective, limit_s=limit_s)
    assert min((CHEAP, SOON), key=preference.rank) is better


def test_among_equally_long_plans_the_cheaper_is_better() -> None:
    preference = Preference(objective=MAKESPAN)
    dear: Any = Figures(101.0, 50.0)
    assert preference.rank(CHEAP) < preference.rank(dear)


def test_a_gain_is_a_share_of_the_objective_or_any_time_of_a_late_plan() -> None:
    energy = Preference(objective=ENERGY)
    little: Any = Figures(99.95, 50.0)
    assert not energy.gains(little, CHEAP, 0.001)
    assert energy.gains(little, CHEAP, 0.0001)
    late = Preference(objective=ENERGY, limit_s=40.0)
    assert late.gains(SOON, CHEAP, 0.9)
    assert not late.gains(CHEAP, CHEAP, 0.001)


def test_planning_leaves_time_for_execution(yard: Any) -> None:
    preference = Preference.of(yard(time_limit=80))
    assert preference.limit_s == 80.0 - TIME_MARGIN_S
    assert preference.timed
    assert not Preference.of(yard()).timed
    assert Preference.of(yard(objective="makespan")).timed


def test_what_the_whole_fleet_draws_is_a_price_of_time(yard: Any) -> None:
    (robot,) = yard().robots
    model = replace(robot.model, idle_power_W=60.0, device_power_W=20.0)
    fleet = (replace(robot, model=model), replace(robot, id="r2", model=model), robot)
    blend = Objective(energy_weight=2.0, makespan_weight=5.0)
    preference = Preference.of(replace(yard(), robots=fleet, objective=blend))
    assert preference.driving == Objective(energy_weight=2.0, makespan_weight=325.0)
    assert preference.objective == blend
    assert Preference.of(replace(yard(), robots=fleet)).timed
