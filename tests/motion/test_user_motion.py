"""A user's motion model: compiled and called by address, at the same speed and result.

The car itself, written down as a user would, must move bit for bit as the shipped one.
"""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
import yaml

import mrmg
from mrmg import shipped
from mrmg.errors import MrmgError, SceneError
from mrmg.motion import _kernels
from mrmg.motion.user_motion import motion_of, user_motion
from mrmg.planning import PlannerParams, plan_mission
from mrmg.planning.roadmap._fleet_kernels import FLEET
from mrmg.plans import Trajectory
from mrmg.scene.loading import scene_from_document
from mrmg.scene.types import Scene
from mrmg.verification.swept_footprint import SweptFootprint

SLIDER = (Path(__file__).parents[2] / "tools" / "first_order.py").read_text()
"""A robot whose control is its speed and yaw rate."""

STEERED = '''\
"""The shipped car's equations, as a user would write them."""

from math import cos, sin, tan

from numba import njit


@njit
def derivative(theta, v, psi, u1, u2, length):
    return v * cos(theta), v * sin(theta), v * tan(psi) / length, u1, u2


def step(state, control, length, dt):
    x, y, theta, v, psi = state
    u1, u2 = control
    half = 0.5 * dt
    ax, ay, at, _, _ = derivative(theta, v, psi, u1, u2, length)
    vm = v + half * u1
    pm = psi + half * u2
    bx, by, bt, _, _ = derivative(theta + half * at, vm, pm, u1, u2, length)
    cx, cy, ct, _, _ = derivative(theta + half * bt, vm, pm, u1, u2, length)
    ve = v + dt * u1
    pe = psi + dt * u2
    dx, dy, dt_, _, _ = derivative(theta + dt * ct, ve, pe, u1, u2, length)
    sixth = dt / 6.0
    return (
        x + sixth * (ax + 2.0 * bx + 2.0 * cx + dx),
        y + sixth * (ay + 2.0 * by + 2.0 * cy + dy),
        theta + sixth * (at + 2.0 * bt + 2.0 * ct + dt_),
        ve,
        pe,
    )


def steer(state, waypoint, share, limits, length, dt):
    return -state[3] / dt, -state[4] / dt
'''


def model_folder(folder: Path, source: str, name: str = "slider") -> Path:
    """Return a model of the car's size with a motion of its own."""
    path = folder / name
    path.mkdir()
    raw = yaml.safe_load((shipped.models_folder() / "car/robot.yaml").read_text())
    del raw["mjcf"]
    raw["motion_model"] = "motion.py"
    (path / "robot.yaml").write_text(yaml.safe_dump(raw))
    (path / "motion.py").write_text(source)
    return path


def slider_scene(folder: Path, **robot: object) -> Scene:
    """Return a small mission of a slider and a car."""
    return scene_from_document(
        {
            "format": 1,
            "name": "sliders",
            "bounds": [0, 0, 40, 20],
            "obstacles": [{"box": {"center": [20, 8], "size": [4, 8]}}],
            "goals": [
                {"id": "g1", "circle": {"center": [33, 5], "radius": 1}},
                {"id": "g2", "circle": {"center": [30, 16], "radius": 1}},
            ],
            "robots": [
                {"id": "r1", "model": str(folder), "pose": [5, 5, 0], **robot},
                {"id": "r2", "model": "car", "pose": [5, 15, 0]},
            ],
        },
        source="sliders",
        trust_code=True,
    )


def test_a_compiled_motion_moves_as_the_shipped_one(tmp_path: Path) -> None:
    motion = user_motion(str(model_folder(tmp_path, STEERED) / "motion.py"))
    own = np.zeros(1, FLEET)
    own["model"], own["wheelbase"] = _kernels.USER, 1.2
    own["step_at"], own["steer_at"] = motion.compiled((-1.0, 2.0, 0.5, 1.0, 1.0))
    car = np.zeros(1, FLEET)
    car["model"], car["wheelbase"] = _kernels.CAR, 1.2
    rng = np.random.default_rng(3)
    ours, theirs = np.empty(5), np.empty(5)
    for _ in range(500):
        state = rng.uniform((-50, -50, -4, -2, -0.6), (50, 50, 4, 2, 0.6))
        u1, u2 = rng.uniform((-1.5, -1.0), (1.5, 1.0))
        _kernels.step(own[0], state, u1, u2, 0.1, ours)
        _kernels.step(car[0], state, u1, u2, 0.1, theirs)
        assert ours.tolist() == theirs.tolist()
        assert motion.step(tuple(state), (u1, u2), 1.2, 0.1) == tuple(theirs.tolist())
        control = _kernels.steer_user(own[0], state, 0.0, 0.0, 0.0, 0.1)
        assert control == pytest.approx((-state[3] / 0.1, -state[4] / 0.1))


def test_a_fleet_with_a_users_model_plans_and_verifies(tmp_path: Path) -> None:
    folder = model_folder(tmp_path, SLIDER)
    finish = {"circle": {"center": [5, 5], "radius": 1}}
    scene = slider_scene(folder, finish=finish)
    result = plan_mission(scene, seed=2, params=PlannerParams(improvements=0))
    assert result.plan is not None
    verdict = mrmg.verify(scene, result.plan)
    assert verdict.ok, verdict.violations
    last = result.plan.trajectories[0].state[-1]
    assert np.hypot(*(last[:2] - (5, 5))) <= 1.0
    assert result.plan.tours["r1"] + result.plan.tours["r2"]


def test_the_motions_text_is_part_of_the_scenes_digest(tmp_path: Path) -> None:
    first = slider_scene(model_folder(tmp_path, SLIDER, "a")).digest
    same = slider_scene(model_folder(tmp_path, SLIDER, "b")).digest
    other = SLIDER.replace("0.5 * w", "0.50 * w")
    assert first == same
    assert slider_scene(model_folder(tmp_path, other, "c")).digest != first


def test_an_edited_motion_is_never_used_for_the_old_one(tmp_path: Path) -> None:
    folder = model_folder(tmp_path, SLIDER)
    scene = slider_scene(folder)
    before = motion_of(scene.robots[0].model)
    stays = "\n\ndef step(state, control, length, dt):\n    return state\n"
    (folder / "motion.py").write_text(SLIDER + stays)
    with pytest.raises(SceneError, match=r"motion.py: has changed since the scene"):
        plan_mission(scene, seed=0)
    again = slider_scene(folder)
    assert again != scene
    state, control = (0.0, 0.0, 0.0, 1.0, 0.5), (0.0, 1.0)
    after = motion_of(again.robots[0].model)
    assert before.step(state, control, 1.0, 0.5) != state
    assert after.step(state, control, 1.0, 0.5) == state


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("def step(", "def stride(", r"step: is not defined; expected a function step"),
        ("share, limits,", "limits,", r"steer: is steer\(.*; expected steer\(state,"),
        (
            "from math import",
            "from maths import",
            r"cannot be imported: ModuleNotFound",
        ),
        ("def step(", "def step((", r"cannot be imported: SyntaxError"),
        ("def step(", "raise SystemExit\n\ndef step(", "cannot be imported: SystemEx"),
    ],
)
def test_bad_files(tmp_path: Path, old: str, new: str, message: str) -> None:
    folder = model_folder(tmp_path, SLIDER.replace(old, new, 1))
    with pytest.raises(SceneError, match=message):
        user_motion(str(folder / "motion.py"))


def test_functions_may_be_compiled_by_the_file_itself(tmp_path: Path) -> None:
    source = SLIDER.replace("def step(", "@njit\ndef step(", 1)
    folder = model_folder(tmp_path, f"from numba import njit\n{source}")
    motion = user_motion(str(folder / "motion.py"))
    assert all(motion.compiled((0.0, 1.0, 1.0, 1.0, 1.0)))


def test_what_numba_cannot_compile_is_told(tmp_path: Path) -> None:
    source = SLIDER.replace("v, w = control", "v, w = open('/dev/null'), 0")
    motion = user_motion(str(model_folder(tmp_path, source) / "motion.py"))
    with pytest.raises(SceneError, match="step: cannot be compiled by numba"):
        motion.compiled((0.0, 1.0, 1.0, 1.0, 1.0))


@pytest.mark.parametrize(
    ("motion", "message"),
    [
        ("glide", "must be 'car' or 'unicycle', or the name of a Python file"),
        ("glide.py", "no such file in the folder"),
    ],
)
def test_bad_names(tmp_path: Path, motion: str, message: str) -> None:
    folder = tmp_path / "car"
    shutil.copytree(shipped.models_folder() / "car", folder)
    text = (folder / "robot.yaml").read_text()
    text = text.replace("motion_model: car", f"motion_model: {motion}")
    (folder / "robot.yaml").write_text(text)
    with pytest.raises(SceneError, match=message):
        slider_scene(folder)


def test_it_cannot_be_driven_in_mujoco_and_says_so(tmp_path: Path) -> None:
    from mrmg.simulation.world_model import build_world

    scene = slider_scene(model_folder(tmp_path, SLIDER))
    with pytest.raises(MrmgError, match="planned for and verified, but not driven"):
        build_world(scene)


def test_the_way_of_a_user_s_motion_is_seen_not_read_off_its_control(
    tmp_path: Path,
) -> None:
    """From rest, a control of 1.8 m/s moves the slider by 0.18 m in 0.1 s at once."""
    robot = slider_scene(model_folder(tmp_path, SLIDER)).robots[0]
    control = np.array([[1.8, 0.0], [-1.8, 1.0], [0.0, 0.0]])
    states = [(*robot.pose, 0.0, 0.0)]
    for held in control.tolist():
        step = motion_of(robot.model).step
        states.append(step(states[-1], tuple(held), 1.0, 0.1))
    trajectory = Trajectory(
        robot="r1", dt_s=0.1, state=np.array(states), control=control
    )
    footprint = SweptFootprint(robot.model, trajectory)
    assert (footprint.travel_m >= [0.18, 0.1799, 0.0]).all()
    assert footprint.travel_m == pytest.approx([0.18, 0.18, 0.0], abs=0.01)
