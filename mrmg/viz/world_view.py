"""Pictures of the simulated world: one offscreen renderer, cameras and projection."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager

import numpy as np

from mrmg.errors import MachineError
from mrmg.mujoco_import import mujoco
from mrmg.simulation.scenery import FLOOR
from mrmg.simulation.world_model import MujocoWorld
from mrmg.viz.gl_backend import offscreen_context
from mrmg.viz.ground_image import GroundFrame
from mrmg.world.elevation import highest_m

_SLICES, _STACKS = 20, 2
_SMOOTH_SAMPLES = 4
_SHADOW_PIXELS = 1024
_MAX_GEOMS = 20000
_AWAY_M = 1e4
CHASE_FOVY_DEG = 50.0
_CHASE_DISTANCE_M = 9.0
_CHASE_ELEVATION_DEG = -24.0
_CHASE_AHEAD_M = 2.0


def camera_at(
    looked_at: Sequence[float], azimuth: float, elevation: float, distance_m: float
) -> mujoco.MjvCamera:
    """Return a camera that looks at a point [m] from a direction [deg]."""
    camera = mujoco.MjvCamera()
    camera.lookat[:] = looked_at
    camera.azimuth, camera.elevation = azimuth, elevation
    camera.distance = distance_m
    return camera


def top_camera(scene_center: np.ndarray, ground_m: float = 0.0) -> mujoco.MjvCamera:
    """Return an orthographic camera that looks straight down, north up.

    Args:
        scene_center: what is in the middle [m], shape (2,).
        ground_m: height of the highest ground.
    """
    camera = camera_at([*scene_center, ground_m], 90.0, -90.0, 50.0)
    camera.orthographic = 1
    return camera


def chase_camera(
    x_m: float, y_m: float, z_m: float, yaw_rad: float
) -> mujoco.MjvCamera:
    """Return a camera behind and above a robot at a pose."""
    ahead_x_m = x_m + _CHASE_AHEAD_M * math.cos(yaw_rad)
    ahead_y_m = y_m + _CHASE_AHEAD_M * math.sin(yaw_rad)
    return camera_at(
        [ahead_x_m, ahead_y_m, z_m + 0.4],
        math.degrees(yaw_rad),
        _CHASE_ELEVATION_DEG,
        _CHASE_DISTANCE_M,
    )


class WorldView:
    """Draws states of a world offscreen; made by `open_view`."""

    def __init__(self, world: MujocoWorld, model: mujoco.MjModel) -> None:
        """Set up drawing in the OpenGL context that is current."""
        self.model = model
        self.highest_m = highest_m(world.scene)
        self._data = mujoco.MjData(model)
        self._target_geom = world.target_geom
        self._scene = mujoco.MjvScene(model, _MAX_GEOMS)
        self._option = mujoco.MjvOption()
        self._context = mujoco.MjrContext(
            model, mujoco.mjtFontScale.mjFONTSCALE_100.value
        )
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value, self._context)
        self._floor = model.texture(FLOOR)
        self._size = (0, 0)

    @property
    def ground(self) -> np.ndarray:
        """Pixels of the floor's texture, shape (rows, columns, 3); to be painted on."""
        start = int(self._floor.adr[0])
        rows, columns = int(self._floor.height[0]), int(self._floor.width[0])
        pixels = self.model.tex_data[start : start + rows * columns * 3]
        return np.asarray(pixels).reshape(rows, columns, 3)

    def update_ground(self) -> None:
        """Bring a painted ground to the renderer."""
        mujoco.mjr_uploadTexture(self.model, self._context, self._floor.id)

    def color_target(
        self, target: str, rgba: tuple[float, float, float, float]
    ) -> None:
        """Give a goal's or station's mark another colour."""
        self.model.geom_rgba[self._target_geom[target]] = rgba

    def place(self, qpos: np.ndarray) -> None:
        """Put everything where `qpos` has it."""
        self._data.qpos[:] = qpos
        mujoco.mj_kinematics(self.model, self._data)
        mujoco.mj_comPos(self.model, self._data)
        mujoco.mj_camlight(self.model, self._data)

    def place_robots_away(self, qpos: np.ndarray) -> None:
        """Put everything where `qpos` has it, but the robots out of sight."""
        away = qpos.copy()
        free = self.model.jnt_type == mujoco.mjtJoint.mjJNT_FREE
        away[self.model.jnt_qposadr[free]] += _AWAY_M
        self.place(away)

    def draw(
        self,
        camera: mujoco.MjvCamera,
        size: tuple[int, int],
        *,
        fovy: float,
        shadows: bool,
    ) -> np.ndarray:
        """Return a picture of the placed world, shape (height, width, 3) of bytes.

        Args:
            camera: where to look from.
            size: width and height of the picture [pixels].
            fovy: field of view [deg], or the height seen [m] if orthographic.
            shadows: whether things cast shadows.
        """
        width, height = self._size = size
        self.model.vis.global_.fovy = fovy
        self._scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = shadows
        self._scene.flags[mujoco.mjtRndFlag.mjRND_REFLECTION] = False
        mujoco.mjv_updateScene(
            self.model,
            self._data,
            self._option,
            None,
            camera,
            mujoco.mjtCatBit.mjCAT_ALL.value,
            self._scene,
        )
        view = mujoco.MjrRect(0, 0, width, height)
        mujoco.mjr_render(view, self._scene, self._context)
        pixels = np.empty((height, width, 3), dtype=np.uint8)
        mujoco.mjr_readPixels(pixels, None, view, self._context)
        return pixels[::-1]

    def project(self, points: np.ndarray) -> np.ndarray:
        """Return where points [m] appear in the last picture, shape (n, 3) -> (n, 2).

        Points behind the camera are NaN.
        """
        width, height = self._size
        camera = mujoco.mjv_averageCamera(*self._scene.camera)
        forward, up = np.asarray(camera.forward), np.asarray(camera.up)
        offset = points - np.asarray(camera.pos)
        depth = offset @ forward
        if camera.orthographic:
            scale = np.ones_like(depth)
        else:
            scale = np.where(depth > 0.0, camera.frustum_near / depth, np.nan)
        half = 0.5 * (camera.frustum_top - camera.frustum_bottom)
        pixels_per_unit = 0.5 * height / half
        column = (
            0.5 * width + (offset @ np.cross(forward, up)) * scale * pixels_per_unit
        )
        row = 0.5 * height - (offset @ up) * scale * pixels_per_unit
        return np.stack([column, row], axis=1)

    def close(self) -> None:
        """Free what the renderer holds."""
        self._context.free()


@contextmanager
def open_view(
    world: MujocoWorld,
    ground: np.ndarray,
    size: tuple[int, int],
    *,
    smooth: bool = True,
) -> Iterator[WorldView]:
    """Open a renderer for pictures up to `size`, its floor painted with `ground`.

    Args:
        world: what to draw.
        ground: image of the floor as of `floor_frame`, north up.
        size: largest width and height of a picture [pixels].
        smooth: smooth edges, which doubles the cost of drawing without a GPU.

    Raises:
        MachineError: if this machine has no OpenGL that draws offscreen.
    """
    with offscreen_context(*size):
        model = drawable_spec(world, ground, size).compile()
        model.vis.quality.offsamples = _SMOOTH_SAMPLES if smooth else 0
        try:
            view = WorldView(world, model)
        except mujoco.FatalError as error:
            raise MachineError(f"OpenGL could not be set up: {error}") from error
        with closing(view):
            yield view


def floor_frame(world: MujocoWorld) -> GroundFrame:
    """Return the rectangle of ground that the floor of the world covers."""
    floor = world.model.geom(FLOOR)
    return GroundFrame(center_m=floor.pos[:2].copy(), half_m=floor.size[:2].copy())


def drawable_spec(
    world: MujocoWorld, ground: np.ndarray, size: tuple[int, int]
) -> mujoco.MjSpec:
    """Return the world as it is drawn: its floor painted, round things lean.

    Args:
        world: what to draw.
        ground: image of the floor as of `floor_frame`, north up.
        size: largest width and height of a picture drawn offscreen [pixels].
    """
    # Cost grows with the number of vertices, so round things get few.
    spec = world.spec.copy()
    texture = spec.add_texture(
        name=FLOOR,
        type=mujoco.mjtTexture.mjTEXTURE_2D,
        colorspace=mujoco.mjtColorSpace.mjCOLORSPACE_LINEAR,
        height=ground.shape[0],
        width=ground.shape[1],
        nchannel=3,
    )
    texture.data = ground.tobytes()
    material = spec.add_material(name=FLOOR, specular=0.0, shininess=0.0)
    material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = FLOOR
    spec.geom(FLOOR).material = FLOOR
    quality = spec.visual.quality
    quality.numslices, quality.numstacks, quality.numquads = _SLICES, _STACKS, 1
    quality.shadowsize = _SHADOW_PIXELS
    spec.visual.global_.offwidth, spec.visual.global_.offheight = size
    return spec
