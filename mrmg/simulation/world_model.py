"""From a scene to a compiled MuJoCo model: scenery plus one attached car per robot."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mrmg import storage
from mrmg.errors import Fault, FileError
from mrmg.mujoco_import import mujoco
from mrmg.scene.driven_parts import CHASSIS, require_drivable
from mrmg.scene.loading.mjcf import no_warning_file
from mrmg.scene.types import Robot, Scene
from mrmg.simulation import palette, scenery
from mrmg.world.elevation import ground_poses

_SPARSE_FROM_ROBOTS = 4


@dataclass(frozen=True, slots=True, kw_only=True)
class MujocoWorld:
    """A scene compiled for simulation and drawing.

    Attributes:
        scene: what it was built from.
        spec: the editable description.
        model: the compiled model.
        digest: fingerprint of the compiled model.
        target_geom: geom of each goal and station, by its id, for recolouring; none
            in a world that is not drawn.
        chassis: body of each robot, in the scene's order, shape (R,).
    """

    scene: Scene
    spec: mujoco.MjSpec
    model: mujoco.MjModel
    digest: str
    target_geom: dict[str, int]
    chassis: np.ndarray


def build_world(scene: Scene, *, drawn: bool = True) -> MujocoWorld:
    """Build and compile the MuJoCo world of a scene.

    What is drawn of the ground is left to those who look at it.

    Args:
        scene: what to build.
        drawn: whether it is to be looked at, or only driven in.

    Raises:
        FileError: if a robot's MJCF cannot be used, or MuJoCo cannot hold the scene.
        UsageError: if a robot can only be planned for.
    """
    try:
        with no_warning_file():
            return _built(scene, drawn)
    except ValueError as error:
        reason = " ".join(str(error).split())
        fault = Fault("", f"MuJoCo cannot build its world: {reason}")
        raise FileError(scene.name, [fault]) from error


def _built(scene: Scene, drawn: bool) -> MujocoWorld:
    spec = mujoco.MjSpec.from_file(str(Path(__file__).with_name("world.xml")))
    # What only the eye sees costs steps a quarter of their time in a large fleet.
    spec.compiler.discardvisual = not drawn
    _set_options(spec, scene, drawn)
    scenery.add_floor(spec, scene)
    scenery.add_bounds(spec, scene)
    scenery.add_targets(spec, scene)
    for index, robot in enumerate(scene.robots):
        _attach(spec, scene, robot, palette.robot_colour(index))
    for obstacle in scene.obstacles:
        body = scenery.add_obstacle(spec, scene, obstacle)
        for robot in scene.robots:
            if body is not None and not obstacle.stops(robot.id):
                spec.add_exclude(bodyname1=body.name, bodyname2=f"{robot.id}/{CHASSIS}")
    model = spec.compile()
    return MujocoWorld(
        scene=scene,
        spec=spec,
        model=model,
        digest=_digest(model),
        target_geom={
            target.id: model.geom(f"{target.kind}:{target.id}").id
            for target in scene.targets()
            if drawn
        },
        chassis=np.array(
            [model.body(f"{robot.id}/{CHASSIS}").id for robot in scene.robots]
        ),
    )


def _set_options(spec: mujoco.MjSpec, scene: Scene, drawn: bool) -> None:
    option = spec.option
    if not drawn:  # robots that stand take no time, until `Fleet` wakes them
        option.enableflags = mujoco.mjtEnableBit.mjENBL_SLEEP
    if len(scene.robots) >= _SPARSE_FROM_ROBOTS:
        option.jacobian = mujoco.mjtJacobian.mjJAC_SPARSE
    x_min, y_min, x_max, y_max = scene.bounds
    extent = max(x_max - x_min, y_max - y_min)
    spec.stat.center = [(x_min + x_max) / 2, (y_min + y_max) / 2, 0.0]
    spec.stat.extent = extent
    spec.visual.map.znear = 0.2 / extent
    spec.light("sun").pos = [*spec.stat.center[:2], extent]


def _attach(
    spec: mujoco.MjSpec, scene: Scene, robot: Robot, colour: palette.Rgb
) -> None:
    """Attach the robot's MJCF at its start pose, its names prefixed with `<id>/`."""
    require_drivable([robot])
    path = robot.model.mjcf
    robot.model.require_unchanged_files()
    try:
        car = mujoco.MjSpec.from_file(str(path))
    except (ValueError, OSError) as error:
        fault = Fault("", f"no usable MJCF for model '{robot.model.name}' ({error})")
        raise FileError(str(path), [fault]) from error
    (pose,) = ground_poses(scene, np.array([robot.pose]))
    frame = spec.worldbody.add_frame(pos=pose[:3], quat=pose[3:])
    spec.attach(car, prefix=f"{robot.id}/", frame=frame)
    chassis = spec.body(f"{robot.id}/{CHASSIS}")
    chassis.sleep = mujoco.mjtSleepPolicy.mjSLEEP_ALLOWED
    paint = spec.material(f"{robot.id}/paint")
    if paint is not None:
        paint.rgba = [*colour, 1.0]


def _digest(model: mujoco.MjModel) -> str:
    buffer = np.empty(mujoco.mj_sizeModel(model), dtype=np.uint8)
    mujoco.mj_saveModel(model, None, buffer)
    return storage.bytes_digest(buffer.tobytes())
