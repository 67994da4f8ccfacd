"""Energy by terrain class adds up to the audit."""

from __future__ import annotations

import pytest

from mrmg.energy.audit import audit
from mrmg.energy.by_terrain import energy_by_terrain


def test_energy_by_terrain_adds_up_to_the_audit(case, make_log) -> None:
    scene, plan = case(
        terrain=[
            {"polygon": [[8, 5], [12, 5], [12, 15], [8, 15]], "multiplier": 2.0},
            {"polygon": [[10, 5], [14, 5], [14, 15], [10, 15]], "multiplier": 0.5},
        ]
    )
    log = make_log(scene, plan)
    classes = energy_by_terrain(scene, plan, log)
    assert [item.multiplier for item in classes] == [0.5, 1.0, 2.0]
    account = audit(scene, plan, log)
    for meter in ("planned", "metered", "measured"):
        total_J = getattr(account, meter).total_J()
        parts_J = [getattr(item, f"{meter}_J") for item in classes]
        assert sum(parts_J) == pytest.approx(total_J)
    assert sum(item.planned_m for item in classes) == pytest.approx(12.0, abs=0.1)
    ways = {item.multiplier: item.planned_m for item in classes}
    assert ways[2.0] == pytest.approx(2.0, abs=0.2)
    assert ways[0.5] == pytest.approx(4.0, abs=0.2)


def test_energy_by_terrain_of_a_plan_alone_has_no_driven_figures(case) -> None:
    scene, plan = case()
    (only,) = energy_by_terrain(scene, plan, None)
    assert only.planned_J == pytest.approx(plan.ledger.total_J())
    assert (only.driven_m, only.metered_J, only.measured_J) == (None, None, None)
