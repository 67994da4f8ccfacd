"""Missions are solved by following paths; searching for motions is for the rest."""

from __future__ import annotations

from pathlib import Path

import pytest

import mrmg
from mrmg.planning import PlannerParams

PARAMS = PlannerParams(improvements=0, refinements=0)
"""As far as the first plan."""

SCENES = sorted((Path(__file__).parents[1] / "scenes").glob("*.yaml"))
HARD = {"two_swap"}
"""Scenes of these tests that may need a search: robots stand in each other's place."""

INFEASIBLE = {"goal_enclosed", "goal_out_of_energy"}


@pytest.mark.parametrize(
    "scene", [*(f"scene{n}" for n in range(1, 7)), "mixed", "boreal"]
)
def test_shipped_scenes_need_no_search(scene: str) -> None:
    for seed in range(5):
        result = mrmg.plan(mrmg.load_scene(scene), seed=seed, params=PARAMS)
        assert result.plan is not None
        assert result.statistics["coordinated"] == 0, f"{scene}, seed {seed}"
        assert result.statistics["path_following_plans"] > 0


@pytest.mark.parametrize(
    "path",
    [path for path in SCENES if path.stem not in HARD | INFEASIBLE],
    ids=lambda path: path.stem,
)
def test_small_scenes_need_no_search(path: Path) -> None:
    result = mrmg.plan(mrmg.load_scene(path), params=PARAMS)
    assert result.plan is not None
    assert result.statistics["coordinated"] == 0
