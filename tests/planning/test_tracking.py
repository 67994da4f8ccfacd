"""How fast robots slow down while they follow paths."""

from __future__ import annotations

import numpy as np
import pytest

import mrmg
from mrmg.planning import PlannerParams
from mrmg.planning.drafting import tour_path
from mrmg.planning.planner import state_mission
from mrmg.planning.tracking import courses_of


@pytest.mark.parametrize(
    ("name", "least", "most"), [("scene2", 0.9, 1.0), ("diffdrive", 0.1, 0.5)]
)
def test_slowing_down_leaves_rolling_to_be_overcome(
    name: str, least: float, most: float
) -> None:
    """Cars nearly roll; robots that turn by their wheels keep both of them pushing."""
    scene = mrmg.load_scene(name)
    problem = state_mission(scene, 0, PlannerParams(samples=300))
    paths = [tour_path(problem, r, [r]) for r in range(len(scene.robots))]
    ease = courses_of(problem, paths, [[] for _ in paths]).ease
    ground = min([1.0, *(area.multiplier for area in scene.terrain)])
    energy = [robot.model.energy_model for robot in scene.robots]
    rolling = np.array(
        [ground * each.rolling_force_N / each.effective_mass_kg for each in energy]
    )
    assert (ease >= least * rolling).all()
    assert (ease <= most * rolling).all()
