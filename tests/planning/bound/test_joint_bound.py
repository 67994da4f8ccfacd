"""Bounds where energy and time both count, against all divisions of the goals."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import mrmg
from mrmg.planning import plan_mission
from mrmg.planning.bound.bound import lower_bound_J
from mrmg.planning.bound.joint_bound import Divisions
from mrmg.planning.bound.makespan_bound import makespan_bound_s
from mrmg.planning.bounding import bounds_of
from mrmg.planning.parameters import profile_params
from mrmg.scene.loading import scene_from_document
from mrmg.scene.objective import Objective
from mrmg.scene.types import Scene

ROBOTS, GOALS = 3, 4
FULL = (1 << GOALS) - 1


def random_divisions(seed: int) -> Divisions:
    """Return the energies and times of a random fleet, more for more goals."""
    rng = np.random.default_rng(seed)
    size = np.array([mask.bit_count() for mask in range(FULL + 1)])
    energy_J = 100.0 * size * rng.uniform(0.5, 1.5, (ROBOTS, FULL + 1))
    energy_J[rng.random(energy_J.shape) < 0.1] = np.inf
    energy_J[:, 0] = 0.0
    time_s = 10.0 * size * rng.uniform(0.5, 1.5, (ROBOTS, FULL + 1))
    return Divisions(energy_J=energy_J, time_s=time_s)


def all_divisions(one: Divisions) -> list[tuple[float, float]]:
    """Return energy and makespan of every division of the goals."""
    found = []
    for owner in itertools.product(range(ROBOTS), repeat=GOALS):
        masks = [
            sum(1 << g for g, robot in enumerate(owner) if robot == r)
            for r in range(ROBOTS)
        ]
        energy_J = sum(one.energy_J[r, mask] for r, mask in enumerate(masks))
        found.append((energy_J, max(one.time_s[r, m] for r, m in enumerate(masks))))
    return found


@pytest.mark.parametrize("seed", range(8))
def test_the_energy_within_a_limit_is_that_of_the_best_timely_division(
    seed: int,
) -> None:
    one = random_divisions(seed)
    for limit_s in (12.0, 18.0, 25.0, 60.0):
        timely = [energy for energy, time in all_divisions(one) if time <= limit_s]
        best_J = min(timely, default=np.inf)
        assert one.energy_within_J(limit_s) == pytest.approx(best_J, rel=1e-6)


@pytest.mark.parametrize("seed", range(8))
def test_a_blends_bound_is_below_all_divisions_and_near_the_best(seed: int) -> None:
    one = random_divisions(seed)
    for weight, limit_s in ((0.0, np.inf), (5.0, np.inf), (50.0, 25.0), (1e4, 40.0)):
        objective = Objective(energy_weight=1.0, makespan_weight=weight)
        values = [
            objective.value(*division)
            for division in all_divisions(one)
            if division[1] <= limit_s
        ]
        bound = one.value(objective, limit_s)
        assert bound <= min(values, default=np.inf)
        if values and np.isfinite(min(values)):
            assert bound >= 0.8 * min(values)


def line(**changes: Any) -> Scene:
    """Return goals on a line before one robot, with another one far beyond them."""
    goals = [
        {"id": f"g{x}", "circle": {"center": [x, 10], "radius": 1.0}}
        for x in (30, 60, 90, 120)
    ]
    robots = [
        {"id": "near", "model": "car", "pose": [5, 10, 0]},
        {"id": "far", "model": "car", "pose": [185, 10, 3.14]},
    ]
    document = {
        "format": 1,
        "name": "line",
        "bounds": [0, 0, 190, 20],
        "goals": goals,
        "battery": {"capacity_m": 400},
        "robots": robots,
    }
    return scene_from_document({**document, **changes}, source="line")


def test_the_bound_of_energy_knows_the_time_limit() -> None:
    """One robot takes 55 s at least; with less time the far one must help."""
    free, limited = line(), line(time_limit=54.0)
    assert bounds_of(free, 0.1).energy_J == lower_bound_J(free)
    blind_J, bound_J = lower_bound_J(limited), bounds_of(limited, 0.1).energy_J
    plan = mrmg.plan(limited).plan
    assert plan is not None
    assert bound_J is not None
    assert blind_J * 1.2 < bound_J <= plan.cost_J < 1.15 * bound_J


def test_the_bound_of_a_blend_knows_that_both_must_be_had_at_once() -> None:
    scene = line(objective={"energy": 1.0, "makespan": 300.0})
    bounds = bounds_of(scene, 0.1)
    plan = mrmg.plan(scene).plan
    assert plan is not None
    assert bounds.energy_J is not None and bounds.makespan_s is not None
    assert bounds.makespan_s == makespan_bound_s(scene)
    apart = scene.objective.value(bounds.energy_J, bounds.makespan_s)
    bound = bounds.of(scene.objective)
    assert bound is not None
    assert 1.05 * apart < bound <= scene.objective.value(plan.cost_J, plan.makespan_s)


# --- hints ---------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({}, ["far visits no goal", "--objective makespan"]),
        ({"objective": {"energy": 1.0, "makespan": 1e-3}}, ["larger weight"]),
        ({"objective": "makespan"}, []),
    ],
)
def test_robots_that_stay_at_home_are_named(
    changes: dict[str, Any], words: list[str]
) -> None:
    hints = plan_mission(line(**changes)).hints
    assert len(hints) == bool(words)
    assert [word for word in words if word not in "".join(hints)] == []


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"time_limit": 54.0}, ["router search", "time limits"]),
        ({}, []),
    ],
)
def test_tours_that_are_not_exact_are_told(
    changes: dict[str, Any], words: list[str]
) -> None:
    params = profile_params("default", router="exact")
    hints = "".join(plan_mission(line(**changes), params=params).hints)
    assert [word for word in words if word not in hints] == []
    assert ("router" in hints) == bool(words)


def test_a_gap_that_the_bound_makes_large_is_explained(
    yard: Callable[..., Scene],
) -> None:
    turned = {"id": "r1", "model": "car", "pose": [4, 10, 3.14]}
    result = plan_mission(yard(objective="makespan", robots=[turned]), with_bound=True)
    assert result.statistics["gap"] > 0.15
    (hint,) = result.hints
    assert "top speed" in hint
    assert f"{result.statistics['gap']:.0%}" in hint
