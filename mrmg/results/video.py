"""The video of a mission, drawn from the log; nothing is simulated again."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import av
import numpy as np
from scipy.ndimage import gaussian_filter1d

from mrmg import storage
from mrmg.accounting import LoggedMotion, step_energy_parts
from mrmg.errors import UsageError
from mrmg.execution.log import ExecutionLog
from mrmg.execution.world_model import build_world
from mrmg.mission import Plan
from mrmg.results import style
from mrmg.results.energy_plot import BatteryCurve, simulated_curves
from mrmg.results.ground_image import TrailPainter, paint_ground
from mrmg.results.overlay import Panel, Reading, RobotReading, Tag
from mrmg.results.world_view import (
    CHASE_FOVY_DEG,
    WorldView,
    chase_camera,
    floor_frame,
    open_view,
    top_camera,
)
from mrmg.scene.types import Scene

VIEWS = ("top", "chase", "split")
"""What a video can show."""

Progress = Callable[[float, str], None]

_CRF, _PRESET = "22", "veryfast"
_TRAIL_AHEAD_M = 1.2
_YAW_SMOOTHING_S = 0.8
_MAP_MARGIN = 1.03
_FITTING_S = 30.0
_OPEN = (1.0, 1.0, 1.0, 0.9)


@dataclass(frozen=True, slots=True, kw_only=True)
class VideoOptions:
    """How a video is to look.

    Attributes:
        view, robot, speed, size, fps, from_s, to_s: as in `render_video`.
    """

    view: str
    robot: str | None
    speed: float
    size: tuple[int, int]
    fps: int
    from_s: float
    to_s: float


def render_video(
    scene: Scene,
    plan: Plan,
    log: ExecutionLog,
    path: Path,
    *,
    view: str = "top",
    robot: str | None = None,
    speed: float | None = None,
    size: tuple[int, int] = (1280, 720),
    fps: int = 30,
    from_s: float = 0.0,
    to_s: float | None = None,
    on_progress: Progress | None = None,
) -> None:
    """Render the driven mission to an MP4 file (H.264, yuv420p).

    Args:
        scene: the map.
        plan: adds the planned paths and tours.
        log: what is shown.
        path: file to write, atomically.
        view: one of `VIEWS`.
        robot: id of the robot the chase camera follows; None takes the first.
        speed: mission seconds per second of video; None fits the window to half a
            minute.
        size: width and height [pixels], even.
        fps: frames per second.
        from_s: mission time of the first frame.
        to_s: mission time of the last frame at the latest; None is the log's end.
        on_progress: called with the share done and a text.

    Raises:
        UsageError: if an option is out of its range; names it.
        MachineError: if this machine has no OpenGL that draws offscreen.
    """
    end_s = float(log.time_s[-1]) if to_s is None else to_s
    options = VideoOptions(
        view=view,
        robot=robot,
        speed=_fitting_speed(end_s - from_s) if speed is None else speed,
        size=size,
        fps=fps,
        from_s=from_s,
        to_s=end_s,
    )
    ticks = frame_ticks(scene, log, options)
    with storage.atomic_path(path) as temporary:
        _write_video(temporary, _Film(scene, plan, log, options), ticks, on_progress)


def frame_ticks(scene: Scene, log: ExecutionLog, options: VideoOptions) -> np.ndarray:
    """Return the tick of the log each frame shows, shape (frames,).

    Raises:
        UsageError: if an option is out of its range.
    """
    _check(scene, log, options)
    end_s = min(options.to_s, float(log.time_s[-1]))
    step_s = options.speed / options.fps
    count = int((end_s - options.from_s) / step_s + 1e-9) + 1
    time_s = options.from_s + step_s * np.arange(count)
    after = np.searchsorted(log.time_s, time_s + 1e-9, side="right")
    return np.asarray(np.maximum(after - 1, 0))


def _fitting_speed(window_s: float) -> float:
    return float(max(np.ceil(window_s / _FITTING_S), 1.0))


def _check(scene: Scene, log: ExecutionLog, options: VideoOptions) -> None:
    ids = [robot.id for robot in scene.robots]
    end_s = float(log.time_s[-1])
    width, height = options.size
    faults = {
        f"view {options.view!r} is unknown; use one of {', '.join(VIEWS)}": (
            options.view not in VIEWS
        ),
        f"robot {options.robot!r} is not in the scene; use one of {', '.join(ids)}": (
            options.robot is not None and options.robot not in ids
        ),
        f"speed {options.speed:g} must be greater than 0": not options.speed > 0.0,
        f"fps {options.fps} must be 1 to 120": not 1 <= options.fps <= 120,
        f"size {width}x{height} must be even numbers, 320x240 to 3840x2160": (
            width % 2 != 0
            or height % 2 != 0
            or not (320 <= width <= 3840 and 240 <= height <= 2160)
        ),
        f"the time window {options.from_s:g} to {options.to_s:g} s must lie within "
        f"0 to {end_s:g} s": not 0.0 <= options.from_s <= min(options.to_s, end_s),
    }
    for message, wrong in faults.items():
        if wrong:
            raise UsageError(message)


class _Film:
    """All that is computed once per video: panes, curves, cameras, readings."""

    def __init__(
        self, scene: Scene, plan: Plan, log: ExecutionLog, options: VideoOptions
    ) -> None:
        self.scene, self.plan, self.log, self.options = scene, plan, log, options
        self.world = build_world(scene)
        self.frame = floor_frame(self.world)
        self.colors = style.scene_robot_colors(scene)
        self.curves = simulated_curves(scene, plan, log)
        self.capacity_J = [robot.battery.capacity_J for robot in scene.robots]
        self.used_J = _used_J(scene, log)
        self.followed = self._followed()
        self.yaw = self._smooth_yaw()
        self._place_panes()

    def _followed(self) -> int:
        ids = [robot.id for robot in self.scene.robots]
        return 0 if self.options.robot is None else ids.index(self.options.robot)

    def _smooth_yaw(self) -> np.ndarray:
        yaw = np.unwrap(self.log.state[self.followed, :, 2])
        sigma = _YAW_SMOOTHING_S * self.options.speed**0.5 / self.log.control_period_s
        return np.asarray(gaussian_filter1d(yaw, sigma, mode="nearest"))

    def _place_panes(self) -> None:
        """Divide the picture: map or chase on the left, panel on the right."""
        width, height = self.options.size
        x_min, y_min, x_max, y_max = self.scene.bounds
        ratio = (x_max - x_min) / (y_max - y_min)
        share = 0.26 if self.options.view == "chase" else 1.0 - height * ratio / width
        panel_width = round(min(max(share, 0.26), 0.42) * width)
        main = width - panel_width
        cut = round(0.46 * height) if self.options.view == "split" else 0
        self.main_pane = (slice(0, height), slice(0, main))
        self.chase_pane = (slice(0, cut), slice(main, width))
        self.panel_pane = (slice(cut, height), slice(main, width))
        self.panel_size = (panel_width, height - cut)
        pane_ratio = main / height
        self.map_height_m = _MAP_MARGIN * max(
            y_max - y_min, (x_max - x_min) / pane_ratio
        )
        self.map_center = np.array([(x_min + x_max) / 2, (y_min + y_max) / 2])

    def reading(self, tick: int) -> Reading:
        """Return what the panel says at a tick."""
        goals = {goal.id for goal in self.scene.goals}
        return Reading(
            time_s=float(self.log.time_s[tick]),
            used_J=float(self.used_J[tick]),
            visited={
                visit.target: visit.robot
                for curve in self.curves
                for visit in curve.visits
                if visit.step <= tick and visit.target in goals
            },
            robots=tuple(
                RobotReading(
                    robot=curve.robot,
                    charge=float(curve.energy_J[tick]) / capacity_J,
                    speed_m_s=float(state[tick, 3]),
                    heading_for=_next_target(self.plan, curve, tick),
                )
                for curve, state, capacity_J in zip(
                    self.curves, self.log.state, self.capacity_J, strict=True
                )
            ),
        )


def _used_J(scene: Scene, log: ExecutionLog) -> np.ndarray:
    """Return the energy the fleet has drawn at each tick, shape (n,)."""
    used_J = np.zeros(len(log.time_s))
    for robot, state in zip(log.robots, log.state, strict=True):
        motion = LoggedMotion(robot=robot, time_s=log.time_s, state=state)
        used_J[1:] += np.cumsum(step_energy_parts(scene, motion).sum(axis=1))
    return used_J


def _next_target(plan: Plan, curve: BatteryCurve, tick: int) -> str:
    done = sum(visit.step <= tick for visit in curve.visits)
    tour = plan.tours.get(curve.robot, ())
    return tour[done] if done < len(tour) else ""


class _Stage:
    """The changing side of a video: trails on the ground, marks, tags."""

    def __init__(self, film: _Film, view: WorldView, ground: np.ndarray) -> None:
        self._film, self._view = film, view
        self._panel = Panel(film.scene, film.panel_size, film.options.speed)
        height = film.options.size[1]
        self._tags = [
            Tag(robot, film.colors[robot.id], height) for robot in film.scene.robots
        ]
        self._painter = TrailPainter(ground, film.frame)
        self._painted = 0
        self._marked: set[str] = set()
        for goal in film.scene.goals:
            view.color_target(goal.id, _OPEN)
        for station in film.scene.stations:
            view.color_target(station.id, _rgba(style.STATION))

    def draw(self, tick: int) -> np.ndarray:
        """Return the picture at a tick of the log."""
        film = self._film
        width, height = film.options.size
        picture = np.empty((height, width, 3), dtype=np.uint8)
        reading = film.reading(tick)
        self._extend_trails(tick)
        self._mark_goals(reading)
        self._view.place(film.log.qpos[tick])
        if film.options.view == "chase":
            self._draw_chase(picture[film.main_pane], tick, reading)
        else:
            self._draw_top(picture[film.main_pane], tick, reading)
        if film.options.view == "split":
            self._draw_chase(picture[film.chase_pane], tick, reading)
        picture[film.panel_pane] = self._panel.draw(reading)
        return picture

    def _draw_top(self, pane: np.ndarray, tick: int, reading: Reading) -> None:
        camera = top_camera(self._film.map_center)
        self._view.draw(camera, fovy=self._film.map_height_m, shadows=False, out=pane)
        self._lay_tags(pane, tick, reading)

    def _draw_chase(self, pane: np.ndarray, tick: int, reading: Reading) -> None:
        film = self._film
        x_m, y_m = film.log.state[film.followed, tick, :2]
        camera = chase_camera(float(x_m), float(y_m), float(film.yaw[tick]))
        self._view.draw(camera, fovy=CHASE_FOVY_DEG, shadows=True, out=pane)
        self._lay_tags(pane, tick, reading)

    def _lay_tags(self, pane: np.ndarray, tick: int, reading: Reading) -> None:
        robots = self._film.scene.robots
        spots = self._film.log.state[:, tick, :2]
        tops = np.array(
            [[*spot, r.model.height_m] for spot, r in zip(spots, robots, strict=True)]
        )
        pixels = self._view.project(tops)
        for tag, spot, robot in zip(self._tags, pixels, reading.robots, strict=True):
            tag.blit(pane, spot, robot.charge)

    def _extend_trails(self, tick: int) -> None:
        # Painting ahead, by less than a car's length, makes uploads rare.
        if self._painted > tick:
            return
        log = self._film.log
        way_m = np.cumsum(np.abs(log.state[:, tick:, 3]).max(axis=0))
        way_m *= log.control_period_s
        end = tick + 1 + int(np.searchsorted(way_m, _TRAIL_AHEAD_M))
        for robot, state in zip(log.robots, log.state, strict=True):
            start = max(self._painted - 1, 0)
            points = state[start:end, :2]
            self._painter.paint(points, self._film.colors[robot], self._view.ground)
        self._painted = end
        self._view.update_ground()

    def _mark_goals(self, reading: Reading) -> None:
        for goal, robot in reading.visited.items():
            if goal not in self._marked:
                self._view.color_target(goal, _rgba(self._film.colors[robot]))
                self._marked.add(goal)


def _write_video(
    path: Path, film: _Film, ticks: np.ndarray, on_progress: Progress | None
) -> None:
    width, height = film.options.size
    ground = paint_ground(film.scene, film.plan, film.frame)
    with (
        open_view(film.world, ground, film.options.size) as view,
        av.open(str(path), "w", format="mp4", options={"movflags": "faststart"}) as box,
    ):
        stage = _Stage(film, view, ground)
        stream = box.add_stream("libx264", rate=film.options.fps)
        stream.width, stream.height, stream.pix_fmt = width, height, "yuv420p"
        stream.options = {"preset": _PRESET, "crf": _CRF}
        for number, tick in enumerate(ticks):
            frame = av.VideoFrame.from_ndarray(stage.draw(int(tick)), format="rgb24")
            box.mux(stream.encode(frame))
            if on_progress is not None:
                on_progress((number + 1) / len(ticks), "rendering video")
        box.mux(stream.encode(None))


def _rgba(color: str) -> tuple[float, float, float, float]:
    red, green, blue = style.rgb(color)
    return red / 255.0, green / 255.0, blue / 255.0, 0.9
