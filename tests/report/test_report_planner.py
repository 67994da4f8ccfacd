"""What the report states of the planner is what the planner said."""

from __future__ import annotations

import math
from pathlib import Path
from types import SimpleNamespace

import pytest

from mrmg.report.planner import cost_chart, planner


def judged(cost_J: float, bound_J: float | None = None, **figures: object) -> dict:
    """Return the figures of a plan that is judged by its energy."""
    energy = {"name": "energy", "unit": "J", "value": cost_J, "bound": bound_J}
    gap = bound_J and cost_J / bound_J - 1
    known = {"cost_J": cost_J, "bound_J": bound_J, "gap": gap, "makespan_s": 80.0}
    return {**known, "objective": energy, **figures}


FOUND = [
    judged(60e3, time_s=0.5),
    judged(55e3, 40e3, time_s=1.0),
    judged(50e3, 45e3, time_s=2.0),
]


def record(found: list, cost_J: float = 50e3, **figures: object) -> SimpleNamespace:
    """Return as much of a run's record as the planner's section reads."""
    statistics = {
        "vertices": 12,
        "improvements": found,
        "time_s": {"init": 0.1, "routing": 0.75, "total": 3.0},
        "of_a_kind_unheard_of": 7,
    }
    return SimpleNamespace(
        planning={"statistics": statistics},
        summary={"plan": judged(cost_J, **figures)},
        plan=Path(),
    )


def lines(chart: dict) -> dict[str, list]:
    return {line["label"]: line["values"] for line in chart["series"]}


def test_cost_and_bound_are_drawn_from_when_they_were_known() -> None:
    chart = cost_chart(record(FOUND, bound_J=46e3))
    assert chart["along_s"] == [0.0, 0.5, 1.0, 2.0, 3.0]
    assert lines(chart) == {
        "cost of the plan": [None, 60.0, 55.0, 50.0, 50.0],
        "proven bound": [None, None, 40.0, 45.0, 46.0],
    }
    low, high = chart["range"]
    assert low < 40.0
    assert high > 60.0


def test_a_bound_known_only_in_the_end_is_a_level_line() -> None:
    bare = [judged(item["cost_J"], time_s=item["time_s"]) for item in FOUND]
    chart = cost_chart(record(bare, bound_J=44e3))
    assert lines(chart)["proven bound"] == [44.0] * 5
    assert "proven bound" not in lines(cost_chart(record(bare)))


def test_runs_without_a_course_have_no_chart() -> None:
    assert cost_chart(record([])) is None
    unsolved = record(FOUND)
    unsolved.plan = None
    assert cost_chart(unsolved) is None


def test_the_section_tells_quality_shares_and_what_it_has_no_name_for() -> None:
    said = planner(record(FOUND, bound_J=46e3))
    assert "less than 46.00 kJ: this one (50.00 kJ) is at most 8.7 % above" in said
    assert "0.750 s (25 % of all)" in said
    assert "<td>37.5 %</td>" in said
    assert "of_a_kind_unheard_of" in said
    assert "above the minimum" not in planner(record(FOUND))
    bounded = record(FOUND)
    bounded.planning["statistics"]["bound_J"] = 46e3
    assert "bound_J" not in planner(bounded)


def test_a_mission_that_costs_nothing_has_no_gap() -> None:
    free = record([judged(0.0, time_s=0.1)], cost_J=0.0, bound_J=0.0, gap=None)
    assert "above the minimum" not in planner(free)


def test_bounds_never_fall() -> None:
    falling = [judged(55e3, 45e3, time_s=1.0), judged(50e3, 40e3, time_s=2.0)]
    values = lines(cost_chart(record(falling, bound_J=42e3)))["proven bound"]
    known = [value for value in values if value is not None]
    assert known == sorted(known)
    assert math.isclose(known[-1], 45.0)


@pytest.mark.parametrize("total", [0.0, 3.0])
def test_time_goes_on_to_the_end_of_planning(total: float) -> None:
    own = record(FOUND)
    own.planning["statistics"]["time_s"]["total"] = total
    assert cost_chart(own)["along_s"][-1] == max(total, 2.0)


def test_plans_are_judged_by_the_objective_they_were_made_for() -> None:
    makespan = {"name": "makespan", "unit": "s", "value": 80.0, "bound": 64.0}
    found = [judged(6e4, time_s=0.5, objective=makespan)]
    own = record(found, objective=makespan, gap=0.25)
    chart = cost_chart(own)
    assert lines(chart)["cost of the plan"][-1] == 80.0
    assert lines(chart)["proven bound"][-1] == 64.0
    said = planner(own)
    assert "over before 64.0 s: this one (80.0 s) takes at most 25.0 % longer" in said
