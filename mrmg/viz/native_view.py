"""A mission or a scene in MuJoCo's own viewer, for machines with a screen."""

from __future__ import annotations

import math
import time
import warnings
from functools import partial

import numpy as np
from matplotlib.colors import to_rgb, to_rgba

from mrmg.errors import MachineError
from mrmg.mujoco_import import mujoco
from mrmg.scene.types import Scene
from mrmg.simulation.world_model import MujocoWorld, build_world
from mrmg.viz import style
from mrmg.viz.ground_image import paint_ground
from mrmg.viz.replay import SPEEDS, Replay, spoken
from mrmg.viz.world_view import drawable_spec, floor_frame
from mrmg.world.elevation import highest_m, lifted

KEYS = "space: play or pause, arrows left and right: 5 s, up and down: speed"
HINT = "Alt+C opens the panel Control, with a slider for the time"
"""How the replay is steered."""

TIME = "time [s]"
"""Name of the slider in the panel "Control"."""

_FRAME_S = 1.0 / 60.0
_JUMP_S = 5.0
_TAG_LIFT_M = 0.6
_LINE_LIFT_M = 0.06
_LINE_PIXELS = 3.0
_LEAST_STRIDE = 10
_HIDDEN_GROUP = 5
_SPACE, _RIGHT, _LEFT, _DOWN, _UP = 32, 262, 263, 264, 265


def open_window(scene: Scene, replay: Replay | None) -> None:
    """Show a mission, or a scene at its start, until the window is closed.

    Args:
        scene: what is shown.
        replay: how it was driven; None shows the start.

    Raises:
        MachineError: if no window can be opened.
    """
    from mujoco.viewer import launch_passive

    _refuse_without_screen()
    world = replay.film.world if replay else build_world(scene)
    model = viewed_model(scene, world, replay)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    if replay is not None:
        replay.playing = True
    window = launch_passive(
        model,
        data,
        key_callback=partial(steer, replay) if replay else None,
        show_left_ui=False,
        show_right_ui=replay is not None,
    )
    with window:
        _look_from_above(window.cam, scene)
        before = time.monotonic()
        while window.is_running():
            now = time.monotonic()
            if replay is not None:
                replay.advance(now - before)
                with window.lock():
                    _place(world, model, data, replay)
                    annotate(window.user_scn, scene, replay)
                    data.ctrl[0] = replay.time_s
                window.set_texts(_texts(scene, replay))
            window.sync()
            if replay is not None:
                follow_slider(replay, float(data.ctrl[0]))
            before = now
            time.sleep(_FRAME_S)


def _refuse_without_screen() -> None:
    # The viewer would end the whole process without a word of what to do.
    import glfw

    with warnings.catch_warnings(record=True) as raised:
        warnings.simplefilter("always")
        opened = glfw.init()
    if not opened:
        reasons = "; ".join(str(item.message) for item in raised) or "no reason given"
        raise MachineError(
            f"no window could be opened ({reasons}); 'mrmg view --in browser' needs "
            "none"
        )


def viewed_model(
    scene: Scene, world: MujocoWorld, replay: Replay | None
) -> mujoco.MjModel:
    """Return the model of the window; its one control is the time of the replay.

    The viewer draws a slider for every control and for every joint it is to show. The
    robots are placed and not driven here, so that theirs would have nothing to say.
    """
    plan = replay.film.plan if replay else None
    ground = paint_ground(scene, plan, floor_frame(world))
    spec = drawable_spec(world, ground, (1280, 720))
    for actuator in list(spec.actuators):
        spec.delete(actuator)
    for joint in spec.joints:
        joint.group = _HIDDEN_GROUP
    for light in spec.lights:
        light.castshadow = False  # over so wide a map it would be a coarse pattern
    if replay is not None:
        slider = spec.add_actuator(name=TIME, target=spec.joints[0].name)
        slider.trntype = mujoco.mjtTrn.mjTRN_JOINT
        slider.ctrllimited = True
        slider.ctrlrange = [0.0, max(replay.end_s, _FRAME_S)]
    return spec.compile()


def follow_slider(replay: Replay, control: float) -> None:
    """Go to the time a person has slid to; `control` is the slider's value."""
    if control != replay.time_s:
        replay.seek(control)


def steer(replay: Replay, key: int) -> None:
    """Do what a key stands for; see `KEYS`.

    Args:
        replay: to be steered.
        key: code of the key as GLFW has it.
    """
    if key == _SPACE:
        replay.toggle()
    elif key in (_LEFT, _RIGHT):
        replay.seek(replay.time_s + (_JUMP_S if key == _RIGHT else -_JUMP_S))
    elif key in (_UP, _DOWN):
        at = SPEEDS.index(int(replay.speed)) + (1 if key == _UP else -1)
        replay.speed = float(SPEEDS[min(max(at, 0), len(SPEEDS) - 1)])


def _place(
    world: MujocoWorld, model: mujoco.MjModel, data: mujoco.MjData, replay: Replay
) -> None:
    data.qpos[:] = replay.film.log.qpos[replay.tick]
    data.time = replay.time_s
    mujoco.mj_forward(model, data)
    for goal, color in replay.film.goal_colors(replay.reading()).items():
        model.geom_rgba[world.target_geom[goal], :3] = to_rgb(color)


def _look_from_above(camera: mujoco.MjvCamera, scene: Scene) -> None:
    x_min, y_min, x_max, y_max = scene.bounds
    camera.lookat[:] = [(x_min + x_max) / 2, (y_min + y_max) / 2, highest_m(scene)]
    camera.distance = 1.35 * max(x_max - x_min, y_max - y_min)
    camera.azimuth, camera.elevation = 90.0, -58.0


def annotate(extra: mujoco.MjvScene, scene: Scene, replay: Replay) -> None:
    """Put driven paths, names and charges into the window's extra geoms."""
    extra.ngeom = 0
    names = style.target_labels(scene)
    for target in scene.targets():
        at = lifted(scene, target.region.center, 0.3)[0]
        _add_label(extra, at, _without_signs(names[target.id]))
    log, reading = replay.film.log, replay.reading()
    for robot, state, shown in zip(
        scene.robots, log.state, reading.robots, strict=True
    ):
        above = robot.model.height_m + _TAG_LIFT_M
        at = lifted(scene, state[replay.tick, :2], above)[0]
        _add_label(extra, at, f"{robot.id} {shown.percent}")
    room = (extra.maxgeom - extra.ngeom) // len(scene.robots)
    for robot, state in zip(scene.robots, log.state, strict=True):
        color = np.array(to_rgba(replay.film.colors[robot.id]))
        stride = max(math.ceil(len(state) / max(room, 1)), _LEAST_STRIDE)
        driven = lifted(scene, state[: replay.tick + 1 : stride, :2], _LINE_LIFT_M)
        for start, end in zip(driven[:-1], driven[1:], strict=True):
            _add_line(extra, start, end, color)


def _add_label(extra: mujoco.MjvScene, at: np.ndarray, text: str) -> None:
    geom = _added(extra, mujoco.mjtGeom.mjGEOM_LABEL, at, np.ones(4))
    if geom is not None:
        geom.label = text


def _add_line(
    extra: mujoco.MjvScene, start: np.ndarray, end: np.ndarray, rgba: np.ndarray
) -> None:
    line = mujoco.mjtGeom.mjGEOM_LINE
    geom = _added(extra, line, np.zeros(3), rgba)
    if geom is not None:
        mujoco.mjv_connector(geom, line, _LINE_PIXELS, start, end)
        geom.emission = 0.0  # the lights alone show its colour as it is


def _added(
    extra: mujoco.MjvScene, kind: mujoco.mjtGeom, at: np.ndarray, rgba: np.ndarray
) -> mujoco.MjvGeom | None:
    """Return a new geom of the window; None once it has as many as it can."""
    if extra.ngeom == extra.maxgeom:
        return None
    geom = extra.geoms[extra.ngeom]
    extra.ngeom += 1
    turn = np.eye(3).ravel()
    mujoco.mjv_initGeom(geom, kind, np.zeros(3), at, turn, rgba.astype(np.float32))
    return geom


def _texts(scene: Scene, replay: Replay) -> list[tuple[int, int, str, str]]:
    mission, robots = spoken(scene, replay.reading())
    font = mujoco.mjtFontScale.mjFONTSCALE_150.value
    corner = mujoco.mjtGridPos
    left = "\n".join(["mission", *(name for name, _ in robots)])
    right = "\n".join([mission, *(words for _, words in robots)])
    return [
        (font, corner.mjGRID_TOPLEFT.value, left, _without_signs(right)),
        (
            font,
            corner.mjGRID_BOTTOMLEFT.value,
            f"speed {replay.speed:g}\n ",
            f"{KEYS}\n{HINT}",
        ),
    ]


def _without_signs(text: str) -> str:
    # The window's letters have no such sign.
    return text.replace("⚡", "")
