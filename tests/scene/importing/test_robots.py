"""Robots of other tools: what is read agrees with the file, and they can be driven."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import trimesh

import mrmg
from mrmg import shipped
from mrmg.cli.main import main
from mrmg.errors import SceneError, UsageError
from mrmg.scene.importing.robots import importing
from mrmg.scene.importing.robots.importing import ImportedRobot, import_robot
from mrmg.scene.loading.models import load_model
from mrmg.scene.robot_model import RobotModel

URDF = Path(__file__).parents[4] / "shared" / "urdf"
BUGGY = Path(__file__).parent / "buggy.xacro"

WHEEL = """
<link name="{name}"><collision><origin rpy="1.570796 0 0"/><geometry>
  <cylinder radius="0.165" length="0.1"/></geometry></collision>
  <inertial><mass value="2.5"/>
  <inertia ixx="0.02" iyy="0.04" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="{name}_joint" type="continuous"><parent link="base"/><child link="{name}"/>
  <origin xyz="{x} {y} 0.03"/><axis xyz="0 1 0"/>
  <limit velocity="8" effort="20"/></joint>
<gazebo reference="{name}"><mu1>0.8</mu1></gazebo>
"""
BASE = """
<link name="base">{visual}<collision><origin xyz="0 0 0.1"/><geometry>
  <box size="0.9 0.5 0.2"/></geometry></collision><inertial><mass value="40"/>
  <inertia ixx="0.6" iyy="1.7" izz="2.0" ixy="0" ixz="0" iyz="0"/></inertial></link>
"""
PLACES = {
    "fl": (0.25, 0.3),
    "fr": (0.25, -0.3),
    "rl": (-0.25, 0.3),
    "rr": (-0.25, -0.3),
}


def written(folder: Path, wheels: str, visual: str = "", extra: str = "") -> Path:
    parts = [
        WHEEL.format(name=name, x=PLACES[name][0], y=PLACES[name][1])
        for name in wheels.split()
    ]
    path = folder / "description.urdf"
    body = BASE.format(visual=visual) + "".join(parts) + extra
    path.write_text(f'<robot name="r">{body}</robot>')
    return path


def imported(
    path: Path, folder: Path, **keys: object
) -> tuple[RobotModel, ImportedRobot]:
    found = import_robot(path, folder, **keys)  # type: ignore[arg-type]
    model, _ = load_model(folder)
    return model, found


@pytest.fixture(scope="module")
def turtles(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Models of both shared robots, in one folder."""
    if not URDF.exists():
        pytest.skip("no shared robots")
    folder = tmp_path_factory.mktemp("models")
    for name in ("burger", "waffle_pi"):
        import_robot(URDF / f"turtlebot3_{name}.urdf", folder / name)
    return folder


@pytest.mark.parametrize(
    ("name", "mass_kg", "track_m"),
    [("burger", 1.0017, 0.16), ("waffle_pi", 1.566, 0.288)],
)
def test_turtlebot(turtles: Path, name: str, mass_kg: float, track_m: float) -> None:
    """Masses and places as the description states them; no mesh of it is here."""
    model, _ = load_model(turtles / name)
    assert model.motion_model == "unicycle"
    assert model.mass_kg == pytest.approx(mass_kg, rel=1e-3)
    assert model.track_m == pytest.approx(track_m)
    assert model.wheel_radius_m == pytest.approx(0.033, rel=1e-3)
    assert model.limits.v_max_m_s == pytest.approx(6.5 * 0.033, rel=1e-3)


def test_turtlebots_drive_a_mission(turtles: Path, tmp_path: Path) -> None:
    disc = {"radius": 0.2}
    scene = mrmg.load_scene("quickstart").with_(
        bounds=[0, 0, 4, 3],
        obstacles=[],
        terrain=[],
        goals=[
            {"id": "g1", "circle": {"center": [3.2, 2.2], **disc}},
            {"id": "g2", "circle": {"center": [3.2, 0.8], **disc}},
        ],
        stations=[],
        battery={"capacity_m": 20},
        robots=[
            {"id": "r1", "model": f"{turtles}/burger", "pose": [0.8, 0.8, 0]},
            {"id": "r2", "model": f"{turtles}/waffle_pi", "pose": [0.8, 2.2, 0]},
        ],
    )
    result = mrmg.plan(scene, seed=0)
    assert result.plan is not None
    assert mrmg.verify(scene, result.plan).ok
    log = mrmg.execute(scene, result.plan)
    audit = mrmg.audit(scene, result.plan, log)
    assert audit.mission_ok, audit.reasons


def test_car_of_a_xacro_file(tmp_path: Path) -> None:
    model, found = imported(BUGGY, tmp_path / "buggy", arguments={"wheelbase": "0.7"})
    assert model.motion_model == "car"
    assert model.wheelbase_m == pytest.approx(0.7)
    assert model.mass_kg == pytest.approx(20 + 4 * 1 + 2 * 0.2)
    assert model.limits.v_max_m_s == pytest.approx(20 * 0.1)  # rad/s x m
    inner = math.atan(
        math.tan(model.limits.w_max)
        / (1 - 0.5 / 0.7 / 2 * math.tan(model.limits.w_max))
    )
    assert inner == pytest.approx(0.98 * math.atan(math.tan(0.6)), rel=0.01)
    assert {"limits.v_max", "limits.w_max", "wheelbase"} <= {*found.read}
    assert any(line.startswith("rolling_coefficient") for line in found.assumed)


@pytest.mark.parametrize(
    ("front_y_m", "wheelbase", "message"),
    [
        ("0.4", "0.6", r"wheels are 0.5 m apart, those that steer 0.8 m; .* one track"),
        ("0.25", "0", "steered wheels are at x = 0 m, its driven axle is at 0 m"),
    ],
)
def test_cars_that_no_model_can_be(
    front_y_m: str, wheelbase: str, message: str, tmp_path: Path
) -> None:
    text = BUGGY.read_text()
    for side, sign in (("left", ""), ("right", "-")):
        stated = f'name="front_{side}" y="{sign}{{}}"'
        assert stated.format("0.25") in text
        text = text.replace(stated.format("0.25"), stated.format(front_y_m))
    path = tmp_path / "buggy.xacro"
    path.write_text(text)
    with pytest.raises(SceneError, match=message) as caught:
        import_robot(path, tmp_path / "odd", arguments={"wheelbase": wheelbase})
    assert len(caught.value.faults) == 1
    assert not (tmp_path / "odd").exists()


def test_four_wheels_that_do_not_steer(tmp_path: Path) -> None:
    path = written(tmp_path, "fl fr rl rr")
    model, found = imported(path, tmp_path / "skid")
    assert (model.motion_model, model.wheel_count) == ("unicycle", 2)
    assert model.friction_coefficient == 0.8
    assert model.track_m == pytest.approx(0.6)
    assert any("4 wheels that do not steer" in note for note in found.notes)
    rear, _ = imported(
        path, tmp_path / "rear", drive=("rl_joint", "rr_joint")
    )  # the front ones stay on, and weigh what they did
    assert rear.mass_kg == pytest.approx(model.mass_kg)
    assert rear.center_of_mass_m == pytest.approx(0.25)


@pytest.mark.parametrize("name", ["car", "hauler", "diffdrive"])
def test_shipped_mjcf_comes_back(name: str, tmp_path: Path) -> None:
    folder = shipped.models_folder() / name
    before, _ = load_model(folder)
    model, _ = imported(folder / f"{name}.xml", tmp_path / "again")
    assert model.motion_model == before.motion_model
    assert model.mass_kg == pytest.approx(before.mass_kg)
    assert model.center_of_mass_m == pytest.approx(before.center_of_mass_m, abs=2e-3)
    for key in ("track_m", "wheel_radius_m", "wheel_inertia_kg_m2", "height_m"):
        assert getattr(model, key) == pytest.approx(getattr(before, key)), key
    for key in ("rolling_coefficient", "turning_coefficient", "friction_coefficient"):
        assert getattr(model, key) == pytest.approx(getattr(before, key)), key


def test_meshes(tmp_path: Path) -> None:
    """Those that are there are drawn; others are said to be missing."""
    meshes = tmp_path / "robots" / "meshes"
    meshes.mkdir(parents=True)
    trimesh.creation.box((0.9, 0.5, 0.4)).export(meshes / "body.stl")
    (meshes / "body.dae").write_text("<COLLADA/>")
    mesh = '<mesh filename="package://robots/meshes/{}"/>'
    visual = f"<visual><geometry>{mesh}</geometry></visual>"
    path = written(tmp_path, "rl rr", visual.format("body.stl"))
    _, found = imported(path, tmp_path / "drawn")
    (file,) = (tmp_path / "drawn").rglob("*.stl")
    extent = np.ptp(trimesh.load(file).vertices, axis=0)
    assert sorted(extent) == pytest.approx([0.4, 0.5, 0.9], rel=1e-4)
    assert not found.notes
    written(tmp_path, "rl rr", visual.format("body.dae") + visual.format("gone.stl"))
    _, found = imported(path, tmp_path / "shapes")
    (note,) = found.notes
    assert "body.dae of base (of a format MuJoCo does not read)" in note
    assert "gone.stl of base (missing)" in note


def test_wheels_that_cannot_be_told(tmp_path: Path) -> None:
    path = written(tmp_path, "fl rl rr")
    with pytest.raises(SceneError, match=r"hinge joints: .*rr_joint") as caught:
        import_robot(path, tmp_path / "odd")
    assert "--drive LEFT RIGHT" in str(caught.value)
    with pytest.raises(SceneError, match="no hinge joint 'nobody'"):
        import_robot(path, tmp_path / "odd", drive=("nobody", "rr_joint"))
    assert not (tmp_path / "odd").exists()
    model, _ = imported(path, tmp_path / "told", drive=("rl_joint", "rr_joint"))
    assert model.wheel_count == 2


MJCF = """
<mujoco><asset><hfield name="h" file="lost.png" size="1 1 1 1"/></asset><worldbody>
  <geom type="hfield" hfield="h"/><geom type="box" pos="9 9 0" size="2 2 2"/>
  <body pos="4 4 1"><freejoint/><geom size="0.5" mass="70"/></body>
  <body name="{name}" pos="1 2 0" euler="0 0 {turn}"><freejoint/>
    <geom type="box" pos="0 0 0.2" size="0.4 0.2 0.1" mass="20"/>
    <body pos="0 0.3 0.1"><joint axis="0 1 0"/>
      <geom type="cylinder" euler="90 0 0" size="0.1 0.02" mass="1"/></body>
    <body pos="0 -0.3 0.1"><joint axis="0 1 0"/>
      <geom type="cylinder" euler="90 0 0" size="0.1 0.02" mass="1"/></body>
  </body>{more}</worldbody></mujoco>
"""


def test_robot_in_a_world(tmp_path: Path) -> None:
    """Neither where it stands nor what else is there is part of a robot."""
    path = tmp_path / "world.xml"
    for turn in (0, 40):
        path.write_text(MJCF.format(name="rover", turn=turn, more=""))
        model, _ = imported(path, tmp_path / f"rover{turn}")
        assert model.mass_kg == pytest.approx(22.0)
        assert np.abs(model.footprint_m).max(axis=0) == pytest.approx((0.4, 0.32))
    twin = MJCF[MJCF.index("<body name") : MJCF.index("{more}")]
    both = MJCF.format(name="a", turn=0, more=twin.format(name="b", turn=0))
    path.write_text(both)
    with pytest.raises(SceneError, match=r"wheels of 2 robots \(a, b\)"):
        imported(path, tmp_path / "twins")


def test_packages_and_masses_that_are_missing(tmp_path: Path) -> None:
    """A package is looked for beside and above the file; no mass is an assumed one."""
    folder = tmp_path / "src" / "rover_description"
    (folder / "urdf").mkdir(parents=True)
    wheels = written(tmp_path, "fl fr").read_text().replace("<inertial>", "<!--", 1)
    wheels = wheels.replace("</inertial>", "-->", 1)
    (folder / "wheels.xacro").write_text(wheels)
    path = folder / "urdf" / "rover.urdf.xacro"
    include = "<xacro:include filename='$(find {})/wheels.xacro'/>"
    space = 'xmlns:xacro="http://www.ros.org/wiki/xacro"'
    path.write_text(f"<robot name='r' {space}>{include}</robot>".format(folder.name))
    model, found = imported(path, tmp_path / "rover")
    assert model.mass_kg == pytest.approx(0.9 * 0.5 * 0.2 * 1000 + 5.0)
    assert any("of water: base" in note for note in found.notes)
    path.write_text(f"<robot name='r' {space}>{include}</robot>".format("gone"))
    with pytest.raises(SceneError, match="no folder of package 'gone'"):
        imported(path, tmp_path / "other")


@pytest.mark.parametrize("mass", ["-40", "0", "nan", "inf"])
def test_masses_that_none_can_be(mass: str, tmp_path: Path) -> None:
    """Zero is allowed of frames alone, which have no shape."""
    inertia = " ".join(f'{key}="0"' for key in ("ixx", "iyy", "izz", "ixy", "ixz"))
    tip = f'<mass value="0"/><inertia {inertia} iyz="0"/>'
    extra = (
        f'<link name="tip"><inertial>{tip}</inertial></link><joint name="tipped" '
        'type="fixed"><parent link="base"/><child link="tip"/></joint>'
    )
    path = written(tmp_path, "rl rr", extra=extra)
    assert imported(path, tmp_path / "good")[0].mass_kg == pytest.approx(45.0)
    path.write_text(path.read_text().replace('value="40"', f'value="{mass}"'))
    message = f"link 'base': has a mass of {float(mass):g} kg; expected more than 0 kg"
    with pytest.raises(SceneError, match=message) as caught:
        import_robot(path, tmp_path / "bad")
    assert len(caught.value.faults) == 1


def test_nothing_is_replaced(tmp_path: Path) -> None:
    path = written(tmp_path, "rl rr")
    (tmp_path / "there").mkdir()
    with pytest.raises(UsageError, match="is there already"):
        import_robot(path, tmp_path / "there")
    with pytest.raises(UsageError, match="cannot name a robot model"):
        import_robot(path, tmp_path / "car")


def test_a_model_that_was_made_meanwhile_stays_as_it_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def load_late(folder: Path) -> None:
        (tmp_path / "mine").mkdir()

    monkeypatch.setattr(importing, "load_model", load_late)
    with pytest.raises(UsageError, match="is there already"):
        import_robot(written(tmp_path, "rl rr"), tmp_path / "mine")
    assert list((tmp_path / "mine").iterdir()) == []
    assert not [*tmp_path.glob(".*")]


def test_command_names_the_next_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    path = written(tmp_path, "rl rr")
    assert main(["robot", "import", str(path)]) == 0
    out = capsys.readouterr().out
    assert "mrmg calibrate models/description" in out
    assert "limits.v_max" in out.partition("read: ")[2].partition("\n")[0]
    assert (tmp_path / "models" / "description" / "robot.yaml").exists()
