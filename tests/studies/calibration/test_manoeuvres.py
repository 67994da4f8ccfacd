"""Manoeuvres start and end at rest, within the limits, and excite every parameter."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mrmg import shipped
from mrmg.scene.loading.models import load_model
from mrmg.scene.robot_model import RobotModel
from mrmg.studies.calibration.manoeuvres import MULTIPLIERS, Manoeuvre, manoeuvres_of

MODELS = {
    name: load_model(shipped.models_folder() / name)[0]
    for name in shipped.model_names()
}
CASES = [
    pytest.param(model, manoeuvre, id=f"{name}: {manoeuvre.name}")
    for name, model in MODELS.items()
    for manoeuvre in manoeuvres_of(model)
]


@pytest.mark.parametrize(("model", "manoeuvre"), CASES)
def test_it_stays_within_what_the_planner_uses(
    model: RobotModel, manoeuvre: Manoeuvre
) -> None:
    limits = model.limits.scaled(model.planning_share)
    state, control = manoeuvre.states(model), manoeuvre.control
    assert len(state) == len(control) + 1
    assert state[:, 3].max() <= limits.v_max_m_s + 1e-9
    assert state[:, 3].min() >= limits.v_min_m_s - 1e-9
    assert np.abs(state[:, 4]).max() <= limits.w_max + 1e-9
    assert np.abs(control[:, 0]).max() <= limits.u1_max_m_s2 + 1e-9
    assert np.abs(control[:, 1]).max() <= limits.u2_max + 1e-9


@pytest.mark.parametrize(("model", "manoeuvre"), CASES)
def test_it_starts_and_ends_at_rest(model: RobotModel, manoeuvre: Manoeuvre) -> None:
    state = manoeuvre.states(model)
    np.testing.assert_array_equal(state[0], 0.0)
    np.testing.assert_allclose(state[-1, 3:], 0.0, atol=1e-9)
    top_m_s = model.planning_share * model.limits.v_max_m_s
    turned_rad, speed_m_s = np.abs(state[:, 2:4]).max(axis=0)
    assert turned_rad > 0.3 or speed_m_s > 0.29 * top_m_s


@pytest.mark.parametrize("name", MODELS)
def test_kinds_and_terrains_are_all_there(name: str) -> None:
    model = MODELS[name]
    manoeuvres = manoeuvres_of(model)
    assert len({item.name for item in manoeuvres}) == len(manoeuvres)
    kinds = {item.kind for item in manoeuvres}
    spins = {"spin"} if model.motion_model == "unicycle" else set()
    assert kinds == {"straight", "cycle", "circle"} | spins
    straight = [item for item in manoeuvres if item.kind == "straight"]
    assert {item.multiplier for item in straight} == set(MULTIPLIERS)
    backwards = [item for item in straight if item.states(model)[-1, 0] < 0.0]
    assert len(backwards) == 1


@pytest.mark.parametrize("name", MODELS)
def test_circles_are_round_while_cruising(name: str) -> None:
    model = MODELS[name]
    for item in manoeuvres_of(model):
        if item.kind != "circle":
            continue
        names = [piece.name for piece in item.pieces]
        first = sum(piece.steps for piece in item.pieces[: names.index("cruise")])
        speed, second = item.states(model)[first : first + 60, 3:].T
        np.testing.assert_allclose(speed, speed[0])
        np.testing.assert_allclose(second, second[0])
        assert abs(second[0]) > 0.05


def test_a_spin_stays_on_its_spot() -> None:
    spins = [m for m in manoeuvres_of(MODELS["diffdrive"]) if m.kind == "spin"]
    for spin in spins:
        np.testing.assert_allclose(spin.states(MODELS["diffdrive"])[:, :2], 0.0)


def test_a_robot_without_reverse_is_not_driven_backwards() -> None:
    limits = replace(MODELS["car"].limits, v_min_m_s=0.0)
    forward = replace(MODELS["car"], limits=limits)
    for item in manoeuvres_of(forward):
        assert item.states(forward)[:, 3].min() >= -1e-9
