"""A mission or a scene in three dimensions in the browser, served from this machine."""

from __future__ import annotations

import contextlib
import io
import math
import socket
import threading
import time
from typing import Any

import numpy as np

from mrmg.errors import MachineError
from mrmg.extras import import_extra
from mrmg.mujoco_import import mujoco
from mrmg.plans import Plan
from mrmg.scene.types import Scene
from mrmg.simulation.world_model import build_world
from mrmg.viz import style
from mrmg.viz.ground_image import paint_ground, painted_elevation
from mrmg.viz.replay import SPEEDS, Replay, spoken
from mrmg.viz.solid_shapes import body_meshes, geom_mesh
from mrmg.viz.world_view import floor_frame
from mrmg.world.elevation import highest_m, lifted

_FRAME_S = 1.0 / 30.0
_TAG_LIFT_M = 0.6
_PATH_LIFT_M = 0.06
_PATH_WIDTH_M = 0.12
_BAR_CELLS = 20
_AMBIENT = 0.9


class BrowserView:
    """The world on a page that any number of browsers may look at.

    Attributes:
        address: of the page.
        targets: marks of goals and stations on the page, by id.
        tags: signs above the robots on the page, by id.
    """

    def __init__(
        self, scene: Scene, replay: Replay | None, *, host: str, port: int
    ) -> None:
        """Serve the page.

        Args:
            scene: what is shown.
            replay: how it was driven; None shows the start.
            host: address to listen on.
            port: to listen on; the next free one is taken where it is in use.

        Raises:
            MachineError: if viser is not installed, or the address is not one of this
                machine.
        """
        self._scene, self._replay = scene, replay
        self._world = replay.film.world if replay else build_world(scene)
        self._data = mujoco.MjData(self._world.model)
        self._server = _serve(host, port)
        self.address = f"http://{host}:{self._server.get_port()}"
        self._watch = threading.RLock()
        self._shown_tick = -1
        self._add_ground(replay.film.plan if replay else None)
        self.targets = self._add_targets()
        self._frames = self._add_bodies()
        self.tags = self._add_tags()
        self._place(self._world.model.qpos0)
        for body in np.flatnonzero(self._world.model.body_weldid == 0):
            self._frames.pop(int(body), None)  # it does not move: sending it takes time
        self._look_from_above()
        if replay is not None:
            self._add_driven(replay)
            self._add_controls(replay)
            self.show(replay.tick)

    def run(self) -> None:
        """Replay until interrupted."""
        before = time.monotonic()
        while True:
            time.sleep(_FRAME_S)
            now = time.monotonic()
            if self._replay is not None and self._replay.playing:
                with self._watch:
                    self._replay.advance(now - before)
                    self._slider.value = round(self._replay.time_s, 2)
                    self.show(self._replay.tick)
            before = now

    def close(self) -> None:
        """Stop serving."""
        self._server.stop()

    def show(self, tick: int) -> None:
        """Show a tick of the log."""
        if self._replay is None or tick == self._shown_tick:
            return
        with self._watch, self._server.atomic():
            self._shown_tick = tick
            self._place(self._replay.film.log.qpos[tick])
            reading = self._replay.reading()
            for goal, color in self._replay.film.goal_colors(reading).items():
                self.targets[goal].color = style.rgb(color)
            mission, lines = spoken(self._scene, reading)
            for robot_reading, (name, words) in zip(reading.robots, lines, strict=True):
                bar = _bar(robot_reading.charge)
                self.tags[name].text = f"{name} {robot_reading.percent}"
                self._bars[name].content = f"**{name}** {bar}\n\n{words}"
            self._mission.content = f"**{mission}**"

    def _place(self, qpos: np.ndarray) -> None:
        self._data.qpos[:] = qpos
        mujoco.mj_kinematics(self._world.model, self._data)
        for body, frame in self._frames.items():
            frame.position = self._data.xpos[body]
            frame.wxyz = self._data.xquat[body]
        for robot, body in zip(self._scene.robots, self._world.chassis, strict=True):
            top = self._data.xpos[body] + (0, 0, robot.model.height_m + _TAG_LIFT_M)
            self.tags[robot.id].position = top

    def _add_ground(self, plan: Plan | None) -> None:
        frame = floor_frame(self._world)
        if self._scene.elevation is not None:
            self._server.scene.add_mesh_trimesh(
                "/ground",
                painted_elevation(self._scene, plan, frame),
                cast_shadow=False,
            )
            return
        width_m, height_m = 2.0 * frame.half_m
        self._server.scene.add_image(
            "/ground",
            paint_ground(self._scene, plan, frame),
            render_width=float(width_m),
            render_height=float(height_m),
            # The picture stands upright facing -z; half a turn about x lays it flat.
            wxyz=(0.0, 1.0, 0.0, 0.0),
            position=(*frame.center_m, 0.0),
            cast_shadow=False,
        )

    def _add_targets(self) -> dict[str, Any]:
        handles = {}
        names = style.target_labels(self._scene)
        for target in self._scene.targets():
            mesh = geom_mesh(self._world.model, self._world.target_geom[target.id])
            fill, _ = style.target_colors(target)
            handles[target.id] = self._server.scene.add_mesh_simple(
                f"/targets/{target.id}",
                np.asarray(mesh.vertices),
                np.asarray(mesh.faces),
                color=style.rgb(fill),
                flat_shading=True,
                cast_shadow=False,
            )
            self._server.scene.add_label(
                f"/targets/{target.id}/name",
                names[target.id],
                position=tuple(lifted(self._scene, target.region.center, 0.5)[0]),
                anchor="bottom-center",
            )
        return handles

    def _add_bodies(self) -> dict[int, Any]:
        """Add every body's shapes; return the bodies' frames, which are not placed."""
        frames: dict[int, Any] = {}
        marks = frozenset(self._world.target_geom.values())
        for body, color, mesh in body_meshes(self._world.model, without=marks):
            name = f"/world/{body}"
            if body not in frames:
                frames[body] = self._server.scene.add_frame(name, show_axes=False)
            self._server.scene.add_mesh_simple(
                f"{name}/{'-'.join(map(str, color))}",
                np.asarray(mesh.vertices),
                np.asarray(mesh.faces),
                color=color,
                flat_shading=True,
            )
        return frames

    def _add_tags(self) -> dict[str, Any]:
        tags = {}
        for robot in self._scene.robots:
            start = robot.battery.start_J / robot.battery.capacity_J
            tags[robot.id] = self._server.scene.add_label(
                f"/tags/{robot.id}",
                f"{robot.id} {100.0 * start:.0f} %",
                anchor="bottom-center",
            )
        return tags

    def _add_driven(self, replay: Replay) -> None:
        self._driven = []
        for robot, state in zip(
            replay.film.log.robots, replay.film.log.state, strict=True
        ):
            points = lifted(self._scene, state[::10, :2], _PATH_LIFT_M)
            pieces = np.stack([points[:-1], points[1:]], axis=1)
            self._driven.append(
                self._server.scene.add_line_segments(
                    f"/driven/{robot}",
                    pieces.astype(np.float32),
                    style.rgb(replay.film.colors[robot]),
                    thickness=_PATH_WIDTH_M,
                )
            )

    def _add_controls(self, replay: Replay) -> None:
        gui = self._server.gui
        self._mission = gui.add_markdown("")
        self._slider = gui.add_slider(
            "time [s]", 0.0, max(replay.end_s, 0.01), 0.01, 0.0
        )
        play = gui.add_button("Play / pause", hint="replays the mission")
        speeds = [f"×{speed}" for speed in SPEEDS]
        speed = gui.add_dropdown("speed", speeds, initial_value=f"×{replay.speed:g}")
        driven = gui.add_checkbox("driven paths", True)
        self._bars = {robot.id: gui.add_markdown("") for robot in self._scene.robots}

        def slid(event: Any) -> None:
            # The replay moves the slider, too; only a person's doing counts.
            if event.client is not None:
                with self._watch:
                    replay.seek(self._slider.value)
                    self.show(replay.tick)

        def pressed(_: Any) -> None:
            with self._watch:
                replay.toggle()

        def sped_up(_: Any) -> None:
            replay.speed = float(speed.value.removeprefix("×"))

        def switched(_: Any) -> None:
            for path in self._driven:
                path.visible = driven.value

        self._slider.on_update(slid)
        play.on_click(pressed)
        speed.on_update(sped_up)
        driven.on_update(switched)

    def _look_from_above(self) -> None:
        x_min, y_min, x_max, y_max = self._scene.bounds
        top_m = highest_m(self._scene)
        center = np.array([(x_min + x_max) / 2, (y_min + y_max) / 2, top_m])
        reach = max(x_max - x_min, y_max - y_min)
        camera = self._server.initial_camera
        camera.position = tuple(center + reach * np.array([0.0, -0.65, 1.05]))
        camera.look_at = tuple(center)
        camera.fov = math.radians(50.0)


def _bar(share: float) -> str:
    full = round(_BAR_CELLS * min(max(share, 0.0), 1.0))
    return "█" * full + "░" * (_BAR_CELLS - full)


def _serve(host: str, port: int) -> Any:
    viser = import_extra("viser", extra="view", purpose="shows missions in the browser")
    _require_own(host)
    # It prints its address in a box of its own.
    with contextlib.redirect_stdout(io.StringIO()):
        server = viser.ViserServer(host=host, port=port, label="mrmg", verbose=False)
    server.scene.set_up_direction("+z")
    # Environment maps would be fetched from elsewhere; plain light replaces them.
    server.scene.configure_environment_map(None)
    server.scene.add_light_ambient("/light", intensity=_AMBIENT)
    server.gui.configure_theme(show_logo=False, show_share_button=False)
    server.gui.main_panel.dock_right()
    return server


def _require_own(host: str) -> None:
    """Refuse an address that is not this machine's; viser would wait for ever."""
    try:
        family, kind, *_, address = socket.getaddrinfo(host, 0)[0]
        with socket.socket(family, kind) as own:
            own.bind(address)
    except OSError as error:
        raise MachineError(f"cannot listen on {host}: {error.strerror}") from error
