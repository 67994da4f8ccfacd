"""What each frame of the video shows: panes, cameras, readings, trails, tags."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from matplotlib.colors import to_rgba
from scipy.ndimage import gaussian_filter1d

from mrmg.energy.battery_curves import BatteryCurve, measured_curves
from mrmg.plans import Plan
from mrmg.scene.types import Scene
from mrmg.simulation.log import ExecutionLog, require_same_mission
from mrmg.simulation.world_model import build_world
from mrmg.viz import style
from mrmg.viz.activities import breakdowns, standing_of, stops_behind
from mrmg.viz.ground_image import PAINTED, GroundFrame, paint_trail, video_labels
from mrmg.viz.map_shapes import enclosing_circle
from mrmg.viz.overlay import Panel, Reading, RobotReading
from mrmg.viz.scene_drawing import LABEL_COLORS
from mrmg.viz.tags import Label, Tag, letter_px, place_tags
from mrmg.viz.top_view import TopView
from mrmg.viz.video_options import VideoOptions
from mrmg.viz.world_view import CHASE_FOVY_DEG, WorldView, chase_camera, floor_frame
from mrmg.world.elevation import height_at, lifted

_TRAIL_AHEAD_M = 1.2
_YAW_SMOOTHING_S = 0.8
_MAP_MARGIN = 1.03
_CHASE_SHARE = 0.35
_TAG_LIFT_M = 0.5
_NAMED_WITHIN_M = 40.0
_MARK_OPACITY = 0.9


class Film:
    """All that is computed once per video: panes, curves, cameras, readings."""

    def __init__(
        self, scene: Scene, plan: Plan, log: ExecutionLog, options: VideoOptions
    ) -> None:
        """Compute everything that no frame changes.

        Raises:
            IdentityError: if scene, plan and log do not belong together.
        """
        require_same_mission(scene, plan, log)
        self.curves = measured_curves(scene, plan, log)
        if log.disturbance:
            scene = log.disturbance.actual_scene(scene)  # with the reserves to show
        self.scene, self.plan, self.log, self.options = scene, plan, log, options
        self.world = build_world(scene)
        self.frame = floor_frame(self.world)
        self.colors = style.scene_robot_colors(scene)
        self.names = style.target_labels(scene)
        self.used_J = np.sum([curve.used_J for curve in self.curves], axis=0)
        self.broken_s = breakdowns(log)
        ids = [robot.id for robot in scene.robots]
        self.followed = ids.index(options.robot or ids[0])
        self.yaw = self._smooth_yaw()
        self._place_panes()

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
        cut = round(_CHASE_SHARE * height) if self.options.view == "split" else 0
        self.main_pane = (slice(0, height), slice(0, main))
        self.chase_pane = (slice(0, cut), slice(main, width))
        self.panel_pane = (slice(cut, height), slice(main, width))
        self.panel_size = (panel_width, height - cut)
        pane_ratio = main / height
        half_m = 0.5 * _MAP_MARGIN * max(y_max - y_min, (x_max - x_min) / pane_ratio)
        self.map_frame = GroundFrame(
            center_m=np.array([(x_min + x_max) / 2, (y_min + y_max) / 2]),
            half_m=half_m * np.array([pane_ratio, 1.0]),
            pixels=max(main, height),
        )
        self.em_m = letter_px(height) / self.map_frame.pixels_per_m

    def reading(self, tick: int) -> Reading:
        """Return what the panel shows at a tick."""
        goals = {goal.id for goal in self.scene.goals}
        now_s = float(self.log.time_s[tick])
        return Reading(
            time_s=now_s,
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
                    charge=float(curve.energy_J[tick] / curve.battery.capacity_J),
                    speed_m_s=round(float(state[tick, 3]), 1) + 0.0,
                    heading_for=self._heading_for(curve, tick, state[tick, :2]),
                    standing=self._standing(curve.robot, now_s),
                )
                for curve, state in zip(self.curves, self.log.state, strict=True)
            ),
        )

    def goal_colors(self, reading: Reading) -> dict[str, str]:
        """Return the colour of each goal: of the robot that visited it, if any."""
        colors = {goal.id: style.GOAL_OPEN for goal in self.scene.goals}
        visited = reading.visited.items()
        return colors | {goal: self.colors[robot] for goal, robot in visited}

    def _standing(self, robot: str, now_s: float) -> str:
        whole = now_s < self.broken_s.get(robot, 0.0)
        return (
            "" if whole else standing_of(self.scene.robot(robot), self.plan, self.log)
        )

    def _heading_for(self, curve: BatteryCurve, tick: int, place: np.ndarray) -> str:
        tour = self.plan.tours.get(curve.robot, ())
        stop = int(stops_behind(tour, curve.visits, tick))
        if stop < len(tour):
            return self.names[tour[stop]]
        finish = self.scene.robot(curve.robot).finish
        if finish is not None and finish.region.depth(place)[0] < 0.0:
            return "its finish"
        # The plan in force does not know where one was going that broke down.
        return "…" if curve.robot in self.broken_s else ""


class Stage:
    """The changing side of a video: trails on the ground, marks, tags."""

    def __init__(self, film: Film, view: WorldView) -> None:
        """Set the stage for the first frame."""
        self._film, self._view = film, view
        self._panel = Panel(
            film.scene, film.panel_size, film.options.speed, film.options.size[1]
        )
        height = film.options.size[1]
        self._tags = [
            Tag(robot, film.colors[robot.id], height) for robot in film.scene.robots
        ]
        self._named = _labels(film)
        self._cross = Label("✖", style.RESERVE, height, size_em=1.6)
        self._painted = 0
        self._trailed = 0
        radius_m = max(r.model.circumscribed_radius_m for r in film.scene.robots)
        self._top = TopView(view, film.map_frame, radius_m)
        self._map_labels = [
            (label, film.map_frame.to_pixels(spot)) for _, label, spot in self._named
        ]
        self._marked: set[str] = set()
        for target in film.scene.targets():
            fill, _ = style.target_colors(target)
            view.color_target(target.id, to_rgba(fill, _MARK_OPACITY))

    def draw(self, tick: int) -> np.ndarray:
        """Return the picture at a tick of the log; ticks must not decrease."""
        film = self._film
        width, height = film.options.size
        picture = np.empty((height, width, 3), dtype=np.uint8)
        reading = film.reading(tick)
        marked = self._mark_goals(reading)
        if film.options.view != "top":
            self._extend_ground_trails(tick)
        if film.options.view == "chase":
            self._draw_chase(picture[film.main_pane], tick, reading)
        else:
            self._draw_top(picture[film.main_pane], tick, reading, anew=marked)
        if film.options.view == "split":
            self._draw_chase(picture[film.chase_pane], tick, reading)
        picture[film.panel_pane] = self._panel.draw(reading)
        return picture

    def _draw_top(
        self, pane: np.ndarray, tick: int, reading: Reading, *, anew: bool
    ) -> None:
        log, colors, frame = self._film.log, self._film.colors, self._film.map_frame
        trails = {
            colors[robot]: state[: tick + 1, :2]
            for robot, state in zip(log.robots, log.state, strict=True)
        }
        if anew or self._trailed == 0:
            self._top.draw_background(log.qpos[tick], trails, self._map_labels)
        else:
            for color, points in trails.items():
                self._top.extend_trail(points[self._trailed - 1 :], color)
        self._trailed = tick + 1
        pane[:] = self._top.draw(log.qpos[tick], log.state[:, tick, :2])
        circles = [
            enclosing_circle(robot, tuple(state[tick, :3]))
            for robot, state in zip(self._film.scene.robots, log.state, strict=True)
        ]
        spots = frame.to_pixels(np.array([middle for middle, _ in circles]))
        reaches = [radius_m * frame.pixels_per_m for _, radius_m in circles]
        taken = [(spot, label.half) for label, spot in self._map_labels]
        beside = place_tags(self._tags, spots, reaches, taken, frame.size)
        self._lay_tags(pane, spots, beside, reading)

    def _draw_chase(self, pane: np.ndarray, tick: int, reading: Reading) -> None:
        film = self._film
        self._view.place(film.log.qpos[tick])
        x_m, y_m = film.log.state[film.followed, tick, :2]
        z_m = height_at(film.scene, np.array([[x_m, y_m]]))[0]
        camera = chase_camera(float(x_m), float(y_m), float(z_m), float(film.yaw[tick]))
        size = (pane.shape[1], pane.shape[0])
        pane[:] = self._view.draw(camera, size, fovy=CHASE_FOVY_DEG, shadows=True)
        near_m = np.array([x_m, y_m])
        for kind, label, spot in self._named:
            if kind != "obstacle" and np.hypot(*(spot - near_m)) < _NAMED_WITHIN_M:
                at = self._view.project(lifted(film.scene, spot, 0.0))[0]
                label.blit(pane, at)
        tops = [
            lifted(film.scene, state[tick, :2], robot.model.height_m + _TAG_LIFT_M)
            for robot, state in zip(film.scene.robots, film.log.state, strict=True)
        ]
        spots = self._view.project(np.concatenate(tops))
        self._lay_tags(pane, spots, spots, reading)

    def _lay_tags(
        self,
        pane: np.ndarray,
        spots: Iterable[np.ndarray],
        beside: Iterable[np.ndarray],
        reading: Reading,
    ) -> None:
        for tag, spot, at, robot in zip(
            self._tags, spots, beside, reading.robots, strict=True
        ):
            if robot.broken_down:
                self._cross.blit(pane, spot)
            tag.blit(pane, at, robot.charge, broken=robot.broken_down)

    def _extend_ground_trails(self, tick: int) -> None:
        # Painting ahead, by less than a car's length, makes uploads rare.
        if self._painted > tick:
            return
        film, log = self._film, self._film.log
        way_m = np.cumsum(np.abs(log.state[:, tick:, 3]).max(axis=0))
        way_m *= log.control_period_s
        end = tick + 1 + int(np.searchsorted(way_m, _TRAIL_AHEAD_M))
        for robot, state in zip(log.robots, log.state, strict=True):
            start = max(self._painted - 1, 0)
            points, color = state[start:end, :2], film.colors[robot]
            paint_trail(self._view.ground, film.frame, points, color)
        self._painted = end
        self._view.update_ground()

    def _mark_goals(self, reading: Reading) -> bool:
        """Give visited goals their robot's colour; return whether any is new."""
        new = reading.visited.keys() - self._marked
        for goal in new:
            color = self._film.colors[reading.visited[goal]]
            self._view.color_target(goal, to_rgba(color, _MARK_OPACITY))
        self._marked |= new
        return bool(new)


def _labels(film: Film) -> list[tuple[str, Label, np.ndarray]]:
    """Return the names laid over the map: kind, name and place [m] of each."""
    height = film.options.size[1]
    return [
        (
            label.kind,
            Label(label.text, LABEL_COLORS[label.kind], height, size_em=label.size_em),
            np.array([label.x_m, label.y_m]),
        )
        for label in video_labels(film.scene, film.plan, film.em_m)
        if label.kind not in PAINTED
    ]
