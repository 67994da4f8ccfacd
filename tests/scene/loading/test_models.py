"""Robot models are read as their YAML says, and refused when they make no sense."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
import yaml

from mrmg import shipped
from mrmg.energy.model import GRAVITY_M_S2
from mrmg.errors import SceneError, UsageError
from mrmg.scene.loading.models import load_model, model_folder

CAR = shipped.models_folder() / "car"


def changed_car(tmp_path: Path, old: str, new: str) -> Path:
    folder = tmp_path / "car"
    shutil.copytree(CAR, folder)
    text = (folder / "robot.yaml").read_text()
    assert old in text
    (folder / "robot.yaml").write_text(text.replace(old, new))
    return folder


def test_car_is_what_its_file_says() -> None:
    car, parameters = load_model(CAR)
    raw = yaml.safe_load((CAR / "robot.yaml").read_text())
    shown = raw.pop("tracking_error")
    assert parameters == raw
    assert car.tracking_error is not None
    assert car.tracking_error.entry == shown
    assert car.name == "car"
    assert car.mass_kg == raw["mass"]
    assert car.limits.v_max_m_s == raw["limits"]["v_max"]
    assert car.limits.w_max == raw["limits"]["w_max"]
    assert car.wheel_radius_m == raw["wheel"]["radius"]
    assert car.mjcf.is_file()


def test_car_is_about_the_stated_size() -> None:
    car, _ = load_model(CAR)
    length_m, width_m = np.ptp(car.footprint_m, axis=0)
    assert (length_m, width_m) == pytest.approx((1.8, 1.1))
    assert car.half_width_m == pytest.approx(0.55)
    assert car.inscribed_radius_m == pytest.approx(0.3)
    assert car.circumscribed_radius_m == pytest.approx(np.hypot(1.5, 0.55))
    expected_m = car.wheelbase_m / np.tan(car.planning_share * car.limits.w_max)
    assert car.turning_radius_m == pytest.approx(expected_m)


def test_standard_battery_is_250_m_of_plain_ground() -> None:
    car, _ = load_model(CAR)
    weight_N = car.mass_kg * GRAVITY_M_S2
    per_metre_J = car.rolling_coefficient * weight_N / car.drive_efficiency
    assert car.energy_model.plain_ground_J_per_m() == pytest.approx(per_metre_J)
    assert car.battery_capacity_J / per_metre_J == pytest.approx(250.0, rel=0.01)


def test_footprint_is_turned_counter_clockwise(tmp_path: Path) -> None:
    folder = tmp_path / "car"
    shutil.copytree(CAR, folder)
    raw = yaml.safe_load((CAR / "robot.yaml").read_text())
    raw["footprint"].reverse()
    (folder / "robot.yaml").write_text(yaml.safe_dump(raw))
    model, _ = load_model(folder)
    x, y = model.footprint_m.T
    area_m2 = 0.5 * (x @ np.roll(y, -1) - y @ np.roll(x, -1))
    assert area_m2 == pytest.approx(1.8 * 1.1)
    assert model.inscribed_radius_m > 0.0


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("mass: 180.0", "mass: 0", r"mass, line \d+: got 0; must be > 0"),
        ("v_min: -1.2", "v_min: 1.2", r"limits.v_min, line \d+: got 1.2; must be <= 0"),
        ("motion_model: car", "motion_model: boat", r"must be 'car' or 'unicycle'"),
        ("w_max: 0.6", "w_max: 1.6", r"steering angle must be < pi/2"),
        ("drive_efficiency: 0.85", "drive_efficiency: 1.2", r"must be <= 1"),
        ("[1.5, 0.55]", "[0.0, 0.0]", r"footprint, line \d+: not convex"),
        ("[-0.3, 0.55]", "[1.4, -0.6]", r"footprint, line \d+: crosses itself"),
        (
            "mjcf: car.xml",
            "mjcf: van.xml",
            r"mjcf, line \d+: got 'van.xml'; no such file",
        ),
        ("idle_power: 0.0", "device_power: -1\nidle_power: 0.0", r"must be >= 0"),
        (
            "format: 1",
            "format: 1\nenergy: papr",
            r"energy, line \d+: got 'papr'; must be 'full' or",
        ),
        ("wheel:", "wheels:", r"did you mean 'wheel'\?"),
        (
            "car.xml",
            f"{'long' * 99}.xml",
            r"mjcf, .*: got 'long.*; no such file in the",
        ),
        (
            "motion_model: car",
            r'motion_model: "a\0.py"',
            r"motion_model, .*no such file",
        ),
    ],
)
def test_bad_models(tmp_path: Path, old: str, new: str, message: str) -> None:
    folder = changed_car(tmp_path, old, new)
    with pytest.raises(SceneError, match=message):
        load_model(folder)


def test_a_motion_file_that_leads_to_itself_is_none(tmp_path: Path) -> None:
    folder = changed_car(tmp_path, "motion_model: car", "motion_model: loop.py")
    (folder / "loop.py").symlink_to(folder / "loop.py")
    with pytest.raises(SceneError, match="motion_model, .*got 'loop.py'; no such file"):
        load_model(folder, trust_code=True)


def test_a_motion_file_must_be_text(tmp_path: Path) -> None:
    folder = changed_car(tmp_path, "motion_model: car", "motion_model: own.py")
    (folder / "own.py").write_bytes(b"# \xff\n")
    with pytest.raises(SceneError, match=r"own.py: 1 fault\n.*not a text file"):
        load_model(folder, trust_code=True)


def test_device_power_and_the_papers_energy_are_options(tmp_path: Path) -> None:
    plain, parameters = load_model(CAR)
    assert (plain.device_power_W, plain.energy_preset) == (0.0, "full")
    assert not {"device_power", "energy"} & set(parameters)
    options = "device_power: 40\nenergy: paper\nidle_power: 0.0"
    changed, parameters = load_model(changed_car(tmp_path, "idle_power: 0.0", options))
    assert changed.device_power_W == parameters["device_power"] == 40.0
    assert parameters["energy"] == "paper"
    assert changed.energy_model == plain.energy_model.with_preset("paper")


def test_reference_point_must_be_inside(tmp_path: Path) -> None:
    folder = tmp_path / "car"
    shutil.copytree(CAR, folder)
    raw = yaml.safe_load((CAR / "robot.yaml").read_text())
    raw["footprint"] = [[x + 1.0, y] for x, y in raw["footprint"]]
    (folder / "robot.yaml").write_text(yaml.safe_dump(raw))
    with pytest.raises(SceneError, match=r"must hold \(0, 0\)"):
        load_model(folder)


def test_references() -> None:
    assert model_folder("car", None) == CAR
    assert model_folder("./car", CAR.parent) == CAR
    with pytest.raises(UsageError, match="shipped models: car"):
        model_folder("lorry", None)
    with pytest.raises(UsageError, match="no such folder"):
        model_folder("./lorry", CAR.parent)
    with pytest.raises(UsageError, match="no such folder"):
        model_folder(f"./{'lorry' * 99}", CAR.parent)
