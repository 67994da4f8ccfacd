"""Every scene of tests/scenes does what its first line says, for several seeds."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import mrmg
from mrmg.plans import Plan, PlanStatus
from mrmg.scene.types import Scene

SCENES = Path(__file__).parents[1] / "scenes"
INFEASIBLE = {
    "goal_enclosed": "g1 is unreachable",
    "goal_out_of_energy": "g1 is out of energy",
}
SEEDS = (0, 1, 2)
FEASIBLE = [
    (path.stem, seed)
    for path in sorted(SCENES.glob("*.yaml"))
    if path.stem not in INFEASIBLE
    for seed in SEEDS
]


def scene_of(name: str) -> Scene:
    return mrmg.load_scene(SCENES / f"{name}.yaml")


def plan_of(name: str, seed: int) -> Plan:
    result = mrmg.plan(scene_of(name), seed=seed)
    assert result.status is PlanStatus.SOLVED, result.reason
    assert result.plan is not None
    return result.plan


@pytest.mark.parametrize(("name", "seed"), FEASIBLE)
def test_it_is_solved_and_the_plan_passes_the_verifier(name: str, seed: int) -> None:
    scene, plan = scene_of(name), plan_of(name, seed)
    verdict = mrmg.verify(scene, plan)
    assert [violation.message for violation in verdict.violations] == []
    goals = [visit.target for visit in plan.visits if visit.kind == "goal"]
    assert sorted(goals) == sorted(goal.id for goal in scene.goals)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("name", list(INFEASIBLE))
def test_it_is_infeasible_by_the_proof_that_fits(name: str, seed: int) -> None:
    result = mrmg.plan(scene_of(name), seed=seed)
    assert result.status is PlanStatus.INFEASIBLE
    assert result.plan is None
    assert INFEASIBLE[name] in result.reason


@pytest.mark.parametrize("seed", SEEDS)
def test_the_goal_behind_a_barrier_goes_to_the_robot_it_does_not_stop(
    seed: int,
) -> None:
    assert "g1" in plan_of("blocks_only_r1", seed).tours["r2"]
    assert "g1" in plan_of("obstacle_with_hole", seed).tours["r1"]


@pytest.mark.parametrize("name", ["no_goals", "goal_at_start"])
def test_with_nothing_to_do_the_robot_stands(name: str) -> None:
    plan = plan_of(name, 0)
    assert len(plan.trajectories[0].control) >= 1
    assert np.ptp(plan.trajectories[0].state, axis=0).max() == 0.0
    assert [visit.step for visit in plan.visits] == [0] * len(plan.visits)
    assert plan.cost_J == 0.0


@pytest.mark.parametrize("seed", SEEDS)
def test_a_nearly_empty_battery_is_filled_where_the_robot_stands(seed: int) -> None:
    plan = plan_of("start_in_station", seed)
    assert plan.tours["r1"] == ("s1", "g1")
    assert plan.visits[0].step == 0


@pytest.mark.parametrize("seed", SEEDS)
def test_the_station_on_the_way_is_used_once(seed: int) -> None:
    assert plan_of("station_needed", seed).tours["r1"] == ("s1", "g1")


@pytest.mark.parametrize("seed", SEEDS)
def test_the_plank_over_the_mud_is_taken(seed: int) -> None:
    """Through the mud the 8 m between would count as 32."""
    scene, plan = scene_of("overlapping_terrain"), plan_of("overlapping_terrain", seed)
    joules = scene.robots[0].model.energy_model.plain_ground_J_per_m()
    state = plan.trajectories[0].state
    on_mud = (np.abs(state[:, 0] - 12.0) < 4.0) & (np.abs(state[:, 1] - 7.0) > 1.5)
    assert not on_mud.any()
    assert plan.ledger.total_J(part="rolling") < 20.0 * joules


@pytest.mark.parametrize("seed", SEEDS)
def test_robots_that_meet_both_end_on_a_goal_or_at_rest(seed: int) -> None:
    plan = plan_of("two_swap", seed)
    assert sorted(t for tour in plan.tours.values() for t in tour) == ["g1", "g2"]
    for trajectory in plan.trajectories:
        assert abs(trajectory.state[-1, 3]) < 1e-9
