"""Battery curves: what is drawn is what the account says."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from mrmg.energy.metering import battery_profile
from mrmg.viz import energy_plot


@pytest.fixture
def mission(make_scene, make_plan, make_log, straight):
    scene = make_scene(
        stations=[{"id": "s", "circle": {"center": [10, 10], "radius": 1}}]
    )
    plan = make_plan(scene, {"r1": straight(12.0)}, {"r1": ("s", "g")})
    return scene, plan, make_log(scene, plan)


def test_planned_curve_is_the_plan_s_battery_profile(mission) -> None:
    scene, plan, _ = mission
    (curve,) = energy_plot.planned_curves(scene, plan)
    profile = battery_profile(scene, plan.trajectories[0], plan.visits)
    assert np.array_equal(curve.energy_J, profile)
    assert curve.visits == plan.visits


def test_a_perfect_drive_gives_the_planned_curve(mission) -> None:
    scene, plan, log = mission
    (planned,) = energy_plot.planned_curves(scene, plan)
    (simulated,) = energy_plot.measured_curves(scene, plan, log)
    assert [visit.target for visit in simulated.visits] == ["s", "g"]
    at_plan_times = np.interp(planned.time_s, simulated.time_s, simulated.energy_J)
    recharge = planned.visits[0].step
    apart = np.abs(np.arange(len(planned.time_s)) - recharge) > 1
    assert at_plan_times[apart] == pytest.approx(planned.energy_J[apart], rel=1e-3)


def test_recharges_jump_from_arrival_to_full(mission) -> None:
    scene, plan, _ = mission
    (curve,) = energy_plot.planned_curves(scene, plan)
    time_s, energy_J = energy_plot.with_recharge_jumps(curve)
    station = plan.visits[0]
    jump = np.flatnonzero(np.diff(time_s) == 0.0)
    assert len(jump) == 1
    assert energy_J[jump[0]] == station.energy_J
    assert energy_J[jump[0] + 1] == scene.robots[0].battery.capacity_J
    assert len(time_s) == len(curve.time_s) + 1


@pytest.mark.parametrize("driven", [True, False])
def test_picture_has_a_panel_per_robot(mission, driven: bool, tmp_path: Path) -> None:
    scene, plan, log = mission
    path = tmp_path / "energy.png"
    energy_plot.draw_energy(scene, plan, log if driven else None, path=path)
    pixels = np.asarray(Image.open(path).convert("RGB"))
    assert pixels.shape[:2] == (352, 1045)
    assert pixels.std() > 10
