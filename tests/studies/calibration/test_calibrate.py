"""What is known to the simulation alone is found out by driving."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import mujoco
import numpy as np
import pytest

from mrmg import shipped
from mrmg.errors import UsageError
from mrmg.scene.loading.models import load_model
from mrmg.scene.robot_model import RobotModel
from mrmg.studies.calibration.calibrate import (
    Calibration,
    Estimate,
    calibrate,
    fit_legs,
)


def of(name: str) -> RobotModel:
    return load_model(shipped.models_folder() / name)[0]


CAR = of("car")


@pytest.fixture(
    scope="module",
    params=[
        pytest.param(name, marks=pytest.mark.ci) if name == "hauler" else name
        for name in shipped.model_names()
    ],
)
def measured(request: pytest.FixtureRequest) -> Calibration:
    """A shipped model, calibrated from beliefs that are far off."""
    output: list[float] = []
    model = replace(
        of(request.param),
        rolling_coefficient=0.6 * of(request.param).rolling_coefficient,
        turning_coefficient=2.0 * of(request.param).turning_coefficient,
        wheel_inertia_kg_m2=0.5 * of(request.param).wheel_inertia_kg_m2,
    )
    calibration = calibrate(model, on_progress=lambda done, _: output.append(done))
    assert output == sorted(output)
    assert output[0] == 0.0
    assert output[-1] < 1.0
    return calibration


@pytest.mark.slow
def test_shipped_parameters_are_the_measured_ones(measured: Calibration) -> None:
    """Within 1 %; the turning coefficient within 3 %, for creep of the tyres adds."""
    shipped_model = of(measured.model.name)
    found = measured.estimates
    expected = {
        "rolling_coefficient": (shipped_model.rolling_coefficient, 0.01),
        "turning_coefficient": (shipped_model.turning_coefficient, 0.03),
        "effective_mass_kg": (shipped_model.effective_mass_kg, 0.01),
    }
    for name, (value, tolerance) in expected.items():
        assert found[name].value == pytest.approx(value, rel=tolerance), name
        low, high = found[name].interval
        assert low < found[name].value < high
        assert found[name].half_width < 0.01 * value


@pytest.mark.slow
def test_yaw_inertia_is_that_of_the_bodies(measured: Calibration) -> None:
    """The energy model leaves it out; the fit finds what the MJCF's masses give."""
    expected = kinetic_inertia_kg_m2(measured.model)
    assert measured.estimates["yaw_inertia_kg_m2"].value == pytest.approx(
        expected, rel=0.02
    )


@pytest.mark.slow
def test_the_fit_explains_what_was_measured(measured: Calibration) -> None:
    power_W = np.array([leg.power_W for leg in measured.legs])
    assert np.abs(measured.fit.residual).max() < 0.01 * np.abs(power_W).max()
    assert {leg.manoeuvre.multiplier for leg in measured.legs} == {1.0, 2.0, 4.0}
    assert (power_W < 0.0).any()


def kinetic_inertia_kg_m2(model: RobotModel) -> float:
    """Twice the kinetic energy at 1 rad/s about the reference point, by MuJoCo.

    The wheels roll without slip, each at the speed of its hub.
    """
    mjcf = mujoco.MjModel.from_xml_path(str(model.mjcf))
    data = mujoco.MjData(mjcf)
    mujoco.mj_forward(mjcf, data)
    data.qvel[5] = 1.0
    for joint in range(mjcf.njnt):
        if mjcf.joint(joint).name.startswith("spin_"):
            x, y, _ = data.xanchor[joint]
            data.qvel[mjcf.jnt_dofadr[joint]] = rolling_rad_s(model, x, y)
    momentum = np.zeros(mjcf.nv)
    mujoco.mj_mulM(mjcf, data, momentum, data.qvel)
    return float(data.qvel @ momentum)


def rolling_rad_s(model: RobotModel, x: float, y: float) -> float:
    """Rate at which a wheel at (x, y) rolls while the robot yaws at 1 rad/s.

    A steered wheel points along the way of its hub; others roll by their y alone.
    """
    way = np.hypot(x, y) if x > 1e-6 else -y
    return float(way / model.wheel_radius_m)


def test_exact_legs_give_exact_parameters(synthetic: Callable) -> None:
    found = fit_legs(CAR, synthetic([0.05, 0.02, 190.0, 70.0])).estimates
    values = [item.value for item in found.values()]
    inertia = 10.0 * CAR.wheel_radius_m**2 / 4
    np.testing.assert_allclose(values, [0.05, 0.02, 190.0, 70.0, inertia])
    assert found["rolling_coefficient"].was == CAR.rolling_coefficient
    assert found["yaw_inertia_kg_m2"].was is None


def test_the_written_wheel_inertia_gives_the_measured_effective_mass(
    synthetic: Callable,
) -> None:
    calibration = fit_legs(CAR, synthetic([0.05, 0.02, 197.3, 70.0], noise_W=1.0))
    changes = calibration.changes()
    assert set(changes) == {
        ("rolling_coefficient",),
        ("turning_coefficient",),
        ("wheel", "inertia"),
    }
    corrected = replace(
        CAR, wheel_inertia_kg_m2=float(changes["wheel", "inertia"].text)
    )
    found = calibration.estimates["effective_mass_kg"]
    assert abs(corrected.effective_mass_kg - found.value) < found.half_width


def test_a_robot_lighter_than_stated_is_refused(synthetic: Callable) -> None:
    with pytest.raises(UsageError, match=r"like 150\.0 kg, less than .* of 180 kg"):
        fit_legs(CAR, synthetic([0.05, 0.02, 150.0, 70.0]))


@pytest.mark.parametrize(
    ("value", "half_width", "text"),
    [
        (0.0600063350, 4.5e-06, "0.0600063"),
        (0.0152100948, 3.4e-05, "0.01521"),
        (196.0214, 0.018, "196.021"),
        (0.5, 0.2, "0.5"),
        (0.06, 0.0, "0.06"),
        (0.0, 0.1, "0.0"),
    ],
)
def test_values_are_rounded_below_their_uncertainty(
    value: float, half_width: float, text: str
) -> None:
    item = Estimate(value=value, half_width=half_width, unit="1", was=None, key=None)
    assert item.rounded() == text
    assert abs(float(text) - value) <= half_width / 5


def test_json_holds_values_intervals_and_residuals(synthetic: Callable) -> None:
    calibration = fit_legs(CAR, synthetic([0.05, 0.02, 190.0, 70.0], noise_W=0.5))
    data = calibration.to_json()
    assert data["model"] == "car"
    rolling = data["parameters"]["rolling_coefficient"]
    assert rolling["low"] < rolling["value"] < rolling["high"]
    assert rolling["unit"] == "1"
    assert rolling["key"] == "rolling_coefficient"
    assert data["parameters"]["wheel_inertia_kg_m2"]["key"] == "wheel.inertia"
    residuals = [leg["residual_W"] for leg in data["legs"]]
    assert data["residual_rms_W"] == pytest.approx(
        np.sqrt(np.mean(np.square(residuals)))
    )
    assert data["residual_max_W"] == np.abs(residuals).max()
    for leg in data["legs"]:
        assert leg["measured_W"] - leg["fitted_W"] == pytest.approx(leg["residual_W"])
