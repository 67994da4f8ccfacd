"""Energy by terrain class adds up to the audit."""

from __future__ import annotations

import numpy as np
import pytest

from mrmg.energy.audit import audit
from mrmg.energy.by_terrain import energy_by_terrain, planned_interval_J


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


def test_the_interval_of_one_ground_is_that_of_its_spread(case) -> None:
    scene, plan = case(
        terrain=[
            {
                "polygon": [[0, 0], [20, 0], [20, 20], [0, 20]],
                "multiplier": 2.0,
                "energy_spread": 0.2,
            }
        ]
    )
    total_J = plan.ledger.total_J()
    robots = [robot.id for robot in scene.robots]
    reach = np.exp(1.6449 * 0.2)
    assert planned_interval_J(scene, plan, robots) == pytest.approx(
        (total_J / reach, total_J * reach), rel=1e-4
    )


def test_grounds_differ_independently_of_each_other(case) -> None:
    """Two halves of a way: the first with a spread, the second without or with one."""
    widths = []
    for other in (0.0, 0.2):
        scene, plan = case(
            terrain=[
                {
                    "polygon": [[x, 0], [x + 10, 0], [x + 10, 20], [x, 20]],
                    "multiplier": 2.0 + 0.001 * x,
                    "energy_spread": spread,
                }
                for x, spread in ((0, 0.2), (10, other))
            ]
        )
        low_J, high_J = planned_interval_J(scene, plan, ["r1", "r2"])
        assert low_J * high_J == pytest.approx(plan.ledger.total_J() ** 2)
        widths.append(np.log(high_J / low_J) / (2 * 1.6449 * 0.2))
    first, both = widths
    assert 0.0 < first < both < 1.0
    # Of shares s and 1 - s of the energy: s alone, then the root of both squares.
    assert both == pytest.approx(np.hypot(first, 1.0 - first), rel=1e-3)


def test_terrain_without_a_spread_has_no_interval(case) -> None:
    scene, plan = case()
    assert planned_interval_J(scene, plan, ["r1"]) is None
