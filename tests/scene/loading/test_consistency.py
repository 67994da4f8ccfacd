"""`robot.yaml` and MJCF describe the same robot, or every difference is named."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from mrmg import shipped
from mrmg.cli.main import main
from mrmg.errors import ExitCode, SceneError
from mrmg.scene.loading import load_scene
from mrmg.scene.loading.consistency import mjcf_faults
from mrmg.scene.loading.models import load_model

Change = tuple[str, str]


def own_model(folder: Path, like: str, *changes: Change) -> Path:
    """Copy a shipped model; each change is of whichever file has its first text."""
    model = folder / like
    shutil.copytree(shipped.models_folder() / like, model)
    for old, new in changes:
        files = [model / "robot.yaml", model / f"{like}.xml"]
        found = [file for file in files if re.search(old, file.read_text())]
        assert len(found) == 1, (old, found)
        found[0].write_text(re.sub(old, new, found[0].read_text()))
    return model


def faults_of(model: Path) -> dict[str, str]:
    """Return the messages of a model's faults by their keys."""
    try:
        load_model(model)
    except SceneError as error:
        keys = [fault.path for fault in error.faults]
        return {
            key: "; ".join(item.message for item in error.faults if item.path == key)
            for key in keys
        }
    return {}


@pytest.mark.parametrize("name", shipped.model_names())
def test_shipped_models_agree_and_are_known_to(name: str) -> None:
    folder = shipped.models_folder() / name
    model, parameters = load_model(folder)
    assert model.mjcf is not None
    assert mjcf_faults(model, model.mjcf) == []
    # If a file was changed on purpose: put the new digest into mrmg/shipped.py.
    digest = shipped.model_digest(parameters, model.mjcf)
    assert shipped.is_unchanged_model(parameters, model.mjcf), digest


def test_unchanged_shipped_models_need_no_mujoco() -> None:
    code = (
        "import sys, mrmg; mrmg.load_scene('mixed'); sys.exit('mujoco' in sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


ONE_DIFFERENCE: list[tuple[str, Change, str, str]] = [
    ("car", ("mass: 180.0", "mass: 182.0"), "mass", r"182 kg, car.xml has 180"),
    ("car", ('mass="156"', 'mass="280"'), "mass", r"180 kg, car.xml has 304"),
    ("car", ("center_of_mass: 0.383", "center_of_mass: 0.6"),
     "center_of_mass", "0.6 m"),
    ("car", ("wheelbase: 1.2", "wheelbase: 1.3"), "wheelbase", r"1.3 m, .* has 1.2 "),
    ("car", ("track: 0.9", "track: 0.8"), "track", r"0.8 m, car.xml has 0.9 "),
    ("diffdrive", ("track: 0.56", "track: 0.5"), "track", r"0.5 m, .* has 0.56 "),
    ("car", ("radius: 0.25 ", "radius: 0.3 "), "wheel.radius", r"0.3 m, .* has 0.25 "),
    ("hauler", ('size="0.32"', 'size="0.4"'), "wheel.radius", r"0.32 m, .* has 0.4 "),
    ("diffdrive", ('coef="-0.15"', 'coef="-0.2"'), "wheel.radius", r"tendon 'swing'"),
    ("diffdrive", ('coef="0.075"', 'coef="0.1"'), "wheel.radius", r"tendon 'axle'"),
    ("car", ("inertia: 0.25 ", "inertia: 0.9 "), "wheel.inertia", r"has 0.25 "),
    ("car", ("mass: 6.0 ", "mass: 1000 "), "wheel.mass",
     r"1000 kg a wheel, car.xml has 6 "),
    ("car", ("count: 4", "count: 2"), "wheel.count", r"2 wheels, car.xml has 4"),
    ("car", ("height: 0.8 ", "height: 1.2 "), "height", r"1.2 m, car.xml has 0.8 "),
    ("car", ("friction_coefficient: 1.0", "friction_coefficient: 1.2"),
     "friction_coefficient", r"1.2 .* has 1 "),
    ("car", ('friction="1.0 0.005', 'friction="0.6 0.005'),
     "friction_coefficient", r"1 .* has 0.6 "),
    ("car", (r"1.5, -0.55\]\n  - \[1.5,", "1.4, -0.55]\n  - [1.4,"),
     "footprint", r"in front it ends 1.4 m .* hull of car.xml reaches 1.5 m"),
    ("car", ('size="0.9 0.55 0.4"', 'size="0.9 0.57 0.4"'),
     "footprint", r"on the right it ends 0.55 .* reaches 0.57 .*on the left"),
    ("car", ('size="0.9 0.55 0.4"', 'size="0.4 0.55 0.4"'),
     "footprint", r"reaches only 1 m"),
    ("car", ("w_max: 0.6", "w_max: 0.75"), "limits.w_max", r"asks the inner wheel for"),
    ("car", ('limited="true" range="-0.9 0.9"', 'limited="true" range="-0.5 0.9"'),
     "limits.w_max", r"steer_fl, steer_fr of car.xml may only go from -0.5 to 0.9"),
    ("car", ('kv="34" ctrlrange="-0.9 0.9"', 'kv="34" ctrlrange="-0.9 0.3"'),
     "limits.w_max", r"steer_l, steer_r .* from -0.9 to 0.3 rad"),
    ("car", ('tendon="axle" gear="1"', 'tendon="axle" forcerange="-90 90"'),
     "limits.u1_max", r"for 356 N .* 'drive' of car.xml gives 90 N"),
    ("car", ('tendon="axle" gear="1"', 'tendon="axle" ctrlrange="-90 900"'),
     "limits.u1_max", r"gives 90 N"),
    ("car", ("u1_max: 1.5", "u1_max: 4.5"),
     "limits.u1_max", r"asks for 856 N .* tyres of friction 1 transmit, 706 N"),
    ("diffdrive", ("u2_max: 2.0", "u2_max: 60"),
     "limits.u2_max", r"51 rad/s\^2 .* N m"),
    ("diffdrive", ('"spin_r" gear="0.15"', '"spin_r" gear="0.15" forcerange="-1 1"'),
     "limits.u1_max", r"actuator 'drive_r'"),
    ("car", ('<motor name="drive"', '<motor name="engine"'),
     "mjcf", r"car.xml has no actuator 'drive'"),
    ("car", ('name="steer_fr" class', 'name="turn_fr" class'), "mjcf", r"cannot use"),
    ("diffdrive", ('fixed name="swing"', 'fixed name="sway"'),
     "mjcf", r"no tendon 'swing'"),
    ("car", ('geom name="hull"', 'geom name="shell"'), "mjcf", r"no geom 'hull'"),
    ("car", ('numeric name="turning_coefficient"', 'numeric name="x"'),
     "mjcf", r"no numeric 'turning_coefficient'.*add <custom>"),
    ("car", ('<freejoint name="root"/>', '<joint name="root"/>'),
     "mjcf", r"'root' must be a free joint"),
    ("car", ('<body name="chassis">', '<body name="chassis" pos="0.3 0 0">'),
     "mjcf", r"stands at \(0.3, 0\) m"),
    ("car", ('<body name="chassis">', '<body name="chassis" euler="0 0 1.57">'),
     "mjcf", r"look along x"),
    ("car", ('contype="2" conaffinity="6"', 'contype="2" conaffinity="0"'),
     "mjcf", r"cannot touch geom 'hull'"),
    ("car", ('name="roof" type="box"', 'name="roof" conaffinity="4" type="box"'),
     "mjcf", r"obstacles can touch geom 'roof'"),
    ("car", ('joint axis="0 0 1"', 'joint axis="0 0 -1"'),
     "mjcf", r"turns about \(-?0, -?0, -1\)"),
    ("car", ('contype="0" conaffinity="1" condim="3"', 'condim="3"'),
     "mjcf", r"no geom that touches the floor"),
    ("car", ('motor name="drive" tendon="axle" gear="1"',
             'position name="drive" tendon="axle" kp="900"'),
     "mjcf", r"actuator 'drive' has a bias .*make it a motor"),
    ("car", ('position name="steer_l" joint="steer_fl" kp="2560" kv="34"',
             'motor name="steer_l" joint="steer_fl"'),
     "mjcf", r"must be a position servo"),
    ("car", ("</mujoco>", "</mujoco"), "mjcf", r"MuJoCo cannot use car.xml: .*XML"),
    ("car", ('<geom name="hull" type="box"', '<geom name="hull" type="bax"'),
     "mjcf", r"MuJoCo cannot use car.xml: .*bax"),
    ("car", ("<asset>", '<asset><mesh name="m" file="absent.stl"/>'),
     "mjcf", r"cannot use car.xml: .*absent.stl"),
]  # fmt: skip


DRIVE = '<motor name="drive" tendon="axle" gear="1"/>'
DRIVES = {
    "gear": '<motor name="drive" tendon="axle" gear="-0.4"/>',
    "filter": '<general name="drive" tendon="axle" gear="3" dyntype="filterexact" '
    'dynprm="0.05" gainprm="2"/>',
    "damped": '<general name="drive" tendon="axle" gainprm="2" biastype="affine" '
    'biasprm="5 0 -30"/>',
    "velocity": '<velocity name="drive" tendon="axle" kv="900"/>',
    "limited": '<motor name="drive" tendon="axle" gear="2" ctrlrange="-300 300"/>',
    "hubs": '<motor name="drive" joint="spin_rl" gear="0.25"/>'
    '<motor name="drive_2" joint="spin_rr" gear="0.25"/>',
}


@pytest.mark.parametrize("drive", DRIVES)
def test_any_drive_that_gives_a_commanded_force_is_good(
    tmp_path: Path, drive: str
) -> None:
    found = faults_of(own_model(tmp_path, "car", (DRIVE, DRIVES[drive])))
    assert "mjcf" not in found


@pytest.mark.parametrize("drive", ["filter", "limited"])
def test_a_drive_that_is_too_weak_for_its_gear_is_named(
    tmp_path: Path, drive: str
) -> None:
    weak = DRIVES[drive].replace("/>", ' forcerange="-50 50"/>')
    found = faults_of(own_model(tmp_path, "car", (DRIVE, weak)))
    assert "actuator 'drive' of car.xml gives" in found["limits.u1_max"]


@pytest.mark.parametrize(("like", "change", "key", "message"), ONE_DIFFERENCE)
def test_a_difference_is_named(
    tmp_path: Path, like: str, change: Change, key: str, message: str
) -> None:
    faults = faults_of(own_model(tmp_path, like, change))
    assert key in faults
    assert re.search(message, faults[key]), faults[key]
    assert len(faults) <= 2  # a larger wheel is another inertia, too


AGREEING: list[tuple[str, list[Change]]] = [
    ("car", [("mass: 180.0", "mass: 204.0"), ('mass="156"', 'mass="180"'),
             ("center_of_mass: 0.383", "center_of_mass: 0.379")]),
    ("car", [("mass: 180.0", "mass: 180.9")]),
    ("car", [("wheelbase: 1.2", "wheelbase: 1.22"), ('pos="1.2 0.45', 'pos="1.22 0.45'),
             ('pos="1.2 -0.45', 'pos="1.22 -0.45')]),
    ("car", [("height: 0.8 ", "height: 0.9 "), ('pos="0.6 0 0.4"', 'pos="0.6 0 0.5"')]),
    ("car", [('tendon="axle" gear="1"', 'tendon="axle" gear="2"')]),
    ("car", [("rolling_coefficient: 0.06", "rolling_coefficient: 0.09")]),
    ("car", [("center_of_mass: 0.383 .*", "")]),
    ("car", [('name="hull" type="box" pos="0.6 0 0.4" size="0.9 0.55 0.4"',
              'name="hull" type="ellipsoid" pos="0.6 0 0.4" size="0.9 0.55 0.4"')]),
    ("car", [('type="sphere" size="0.25"',
              'type="cylinder" size="0.25 0.1" zaxis="0 1 0"')]),
    ("car", [('name="hull" type="box" pos="0.6 0 0.4" size="0.9 0.55 0.4"',
              'name="hull" type="mesh" mesh="m" pos="0.6 0 0.4"'),
             ("<asset>", '<asset><mesh name="m" vertex="-.9 -.55 -.4 .9 -.55 -.4 '
              '-.9 .55 -.4 .9 .55 -.4 -.9 0 .4 .9 0 .4"/>')]),
]  # fmt: skip


@pytest.mark.parametrize(("like", "changes"), AGREEING)
def test_what_agrees_within_its_tolerance_is_no_fault(
    tmp_path: Path, like: str, changes: list[Change]
) -> None:
    assert faults_of(own_model(tmp_path, like, *changes)) == {}


LIES = (
    ("mass: 180.0", "mass: 300"),
    ("wheelbase: 1.2", "wheelbase: 0.9"),
    (r"1.5, -0.55\]\n  - \[1.5,", "1.0, -0.55]\n  - [1.0,"),
    ("w_max: 0.6", "w_max: 0.8"),
    ("v_min: -1.2", "v_min: -1.3"),
)


def scene_of(folder: Path, model: str, robots: int = 1) -> Path:
    entries = "".join(
        f"  - {{id: r{place}, model: {model}, pose: [5, {5 + 4 * place}, 0]}}\n"
        for place in range(robots)
    )
    path = folder / "scene.yaml"
    path.write_text(
        "format: 1\nbounds: [0, 0, 40, 30]\ngoals:\n"
        f"  - {{id: g1, circle: {{center: [20, 10], radius: 2}}}}\nrobots:\n{entries}"
    )
    return path


def test_all_differences_are_told_at_once_and_once(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    own_model(tmp_path, "car", *LIES)
    scene = scene_of(tmp_path, "./car", robots=3)
    for words in (["scene", "check"], ["plan"], ["run"]):
        assert main([*words, str(scene)]) == ExitCode.INVALID_FILE
        error = capsys.readouterr().err
        for key in ("mass", "wheelbase", "footprint", "limits.w_max"):
            assert len(re.findall(rf"robot.yaml: {key}, line \d+: ", error)) == 1, error
    assert not (tmp_path / "runs").exists()


def test_mujoco_leaves_no_file_of_warnings(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    faults_of(own_model(tmp_path, "car", ('kv="34"', 'kv="nan"')))
    assert [path.name for path in tmp_path.iterdir()] == ["car"]


def test_faults_of_the_outline_do_not_hide_others(tmp_path: Path) -> None:
    model = own_model(
        tmp_path, "car", ("mass: 180.0", "mass: 300"), (r"\[1.5, 0.55\]", "[0.0, 0.0]")
    )
    assert faults_of(model).keys() == {"footprint", "mass"}


def test_a_model_that_is_only_planned_for_is_not_compared(tmp_path: Path) -> None:
    own_model(tmp_path, "car", ("mass: 180.0", "mass: 300"), ("mjcf: car.xml", ""))
    assert load_scene(scene_of(tmp_path, "./car")).robots[0].model.mass_kg == 300.0


@pytest.mark.parametrize("edit", [lambda text: text, lambda text: text + "\n"])
def test_a_copy_of_a_shipped_model_is_as_good(
    tmp_path: Path, edit: Callable[[str], str]
) -> None:
    model = own_model(tmp_path, "car")
    file = model / "robot.yaml"
    file.write_text(edit(file.read_text()))
    assert faults_of(model) == {}
