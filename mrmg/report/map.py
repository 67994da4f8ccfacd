"""The report's map: an SVG whose parts are named when pointed at, and can be hidden."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping

import numpy as np
from markupsafe import Markup
from shapely import box
from shapely.geometry import Point, Polygon

from mrmg.plans import Plan
from mrmg.report.page import macros
from mrmg.scene.types import Goal, Scene, Station
from mrmg.simulation.log import ExecutionLog
from mrmg.viz import style
from mrmg.viz.activities import breakdowns, lengths_along, visit_ranks
from mrmg.viz.contours import contour_lines
from mrmg.viz.map_labels import KINDS, MapLabel, map_labels
from mrmg.viz.map_shapes import enclosing_circle, end_poses, wanted_headings
from mrmg.viz.scene_drawing import polygons_of

_SVG = macros("map.svg.jinja")
_PATH_SPACING_M = 0.25
_GROUND_KINDS = ("terrain", "obstacle", "height")
_TARGET_KINDS = ("goal", "station")
_ROBOT_KINDS = ("path", "breakdown")


def mission_map(scene: Scene, plan: Plan | None, log: ExecutionLog | None) -> Markup:
    """Return the mission's map as inline SVG; its unit is the metre, y points down.

    Elements with `data-tip` say what they are; those of a robot carry `data-robot` and
    the colour variable `--r<index>`; groups `data-layer` can be hidden.
    """
    x_min, y_min, x_max, y_max = scene.bounds
    width, height = x_max - x_min, y_max - y_min
    letter = max(width, height) / 48.0
    canvas = _Canvas(scene, letter)
    kinds = [kind for kind in KINDS if kind != "stop"]
    labels = map_labels(scene, plan, log, em_m=letter, kinds=kinds)
    names = {label.of: label for label in labels if label.kind == "robot"}
    layers = [
        ("ground", [*canvas.ground(), *canvas.texts(labels, _GROUND_KINDS)]),
        ("planned", canvas.planned(plan)),
        ("driven", canvas.driven(log)),
        ("targets", [*canvas.targets(plan), *canvas.texts(labels, _TARGET_KINDS)]),
        (
            "robots",
            [
                *canvas.texts(labels, _ROBOT_KINDS),
                *canvas.robots(names),
                *canvas.breakdowns(plan, log),
            ],
        ),
    ]
    return Markup(_SVG.map(scene.name, width, height, 0.6 * letter, letter, layers))


class _Canvas:
    """Turns a scene's things into SVG elements."""

    def __init__(self, scene: Scene, letter_m: float) -> None:
        self._scene, self._letter_m = scene, letter_m
        self._x_min, self._y_max = scene.bounds[0], scene.bounds[3]
        self._index = {robot.id: at for at, robot in enumerate(scene.robots)}

    def ground(self) -> Iterable[Markup]:
        bounds = box(*self._scene.bounds)
        yield self._shape(bounds, "ground", "plain ground, terrain ×1")
        classes = style.terrain_classes(self._scene)
        for area in self._scene.terrain:
            tip = f"{area.id}: driving costs ×{area.multiplier:g}"
            fill = f"--c:{classes[area.multiplier].color}"
            for part in polygons_of(area.shape.intersection(bounds)):
                yield self._shape(part, "terrain", tip, fill)
        for level_m, line in contour_lines(self._scene):
            yield _SVG.contour(self._points(line), level_m)
        for obstacle in self._scene.barriers:
            look, tip = "obstacle", f"{obstacle.id}: obstacle"
            if obstacle.is_steep_ground:
                look, tip = "obstacle steep", "too steep"
            if obstacle.blocks is not None:
                look += " partial"
                tip += f" for {', '.join(obstacle.blocks)}"
            yield self._shape(obstacle.shape, look, tip)

    def texts(
        self, labels: Iterable[MapLabel], kinds: Collection[str]
    ) -> Iterable[Markup]:
        """Write the names of some kinds where they were placed."""
        for label in labels:
            if label.kind in kinds:
                x, y = self._point(label.x_m, label.y_m)
                yield _SVG.name(label, x, y, self._index.get(label.of))

    def planned(self, plan: Plan | None) -> Iterable[Markup]:
        for item in plan.trajectories if plan else ():
            yield self._path(item.robot, item.state, "planned")
        for passage in plan.narrow if plan else ():
            tip = f"{passage.robot} keeps {passage.margin_m:.2f} m from obstacles here"
            ring = Point(passage.x_m, passage.y_m).buffer(self._letter_m)
            yield self._shape(ring, "narrow", tip)

    def driven(self, log: ExecutionLog | None) -> Iterable[Markup]:
        if log is None:
            return
        for robot, state in zip(log.robots, log.state, strict=True):
            yield self._path(robot, state, "driven")
        for contact in log.contacts:
            x, y = self._point(contact.x_m, contact.y_m)
            tip = f"{contact.robot} touched {contact.other} at {contact.time_s:.2f} s"
            yield _SVG.mark(x, y, tip)

    def breakdowns(
        self, plan: Plan | None, log: ExecutionLog | None
    ) -> Iterable[Markup]:
        ends = end_poses(plan, log)
        for robot, time_s in breakdowns(log).items():
            middle, _ = enclosing_circle(self._scene.robot(robot), ends[robot])
            x, y = self._point(*middle)
            tip = f"{robot} broke down at {time_s:.1f} s"
            yield _SVG.mark(x, y, tip, robot)

    def targets(self, plan: Plan | None) -> Iterable[Markup]:
        ranks = visit_ranks(plan) if plan else {}
        for target in self._scene.targets():
            yield self._target(target, ranks.get(target.id, []))
        for robot in self._scene.robots:
            if robot.finish:
                color = f"--c:var(--r{self._index[robot.id]})"
                tip = f"finish of {robot.id}"
                yield self._shape(robot.finish.region.shape, "finish", tip, color)
        for name, arrow, heading_rad in wanted_headings(self._scene):
            tip = f"{name}: heading {heading_rad:.2f} rad"
            yield self._shape(arrow, "heading", tip)

    def _target(self, target: Goal | Station, visits: list[tuple[str, int]]) -> Markup:
        station = isinstance(target, Station)
        tip = f"{target.id}: {'recharging station' if station else 'goal'}"
        tip += "".join(f"; stop {rank} of {robot}" for robot, rank in visits)
        look, robot, color = ("station" if station else "goal"), "", ""
        if visits and not station:
            robot = visits[0][0]
            look += " assigned"
            color = f"--c:var(--r{self._index[robot]})"
        return self._shape(target.region.shape, look, tip, color, target.id)

    def robots(self, names: Mapping[str, MapLabel]) -> Iterable[Markup]:
        """Draw the robots at their starts, with names that go with them."""
        for at, robot in enumerate(self._scene.robots):
            outline = " ".join(f"{x:.3f},{-y:.3f}" for x, y in robot.model.footprint_m)
            x, y = self._point(*robot.pose[:2])
            turn = -np.degrees(robot.pose[2])
            name = names[robot.id]
            beside = name.x_m - robot.pose[0], robot.pose[1] - name.y_m
            capacity_kJ = robot.battery.capacity_J / 1000
            tip = f"{robot.id}: {robot.model.name}, {capacity_kJ:.1f} kJ"
            yield _SVG.robot(robot.id, at, tip, x, y, turn, outline, beside)

    def _path(self, robot: str, state: np.ndarray, look: str) -> Markup:
        points = self._points(_thinned(state[:, :2]))
        length_m = float(lengths_along(state)[-1])
        return Markup(_SVG.path(robot, self._index[robot], look, points, length_m))

    def _shape(
        self, shape: Polygon, look: str, tip: str, fill: str = "", target: str = ""
    ) -> Markup:
        rings = [shape.exterior, *shape.interiors]
        path = "".join(
            "M" + "L".join("{} {}".format(*self._point(x, y)) for x, y in ring.coords)
            for ring in rings
        )
        return Markup(_SVG.shape(look, fill, f"{path}Z", tip, target))

    def _points(self, line: Iterable[tuple[float, float]]) -> str:
        return " ".join("{},{}".format(*self._point(x, y)) for x, y in line)

    def _point(self, x_m: float, y_m: float) -> tuple[float, float]:
        return round(float(x_m - self._x_min), 2), round(float(self._y_max - y_m), 2)


def _thinned(points: np.ndarray) -> np.ndarray:
    """Return points of a path about `_PATH_SPACING_M` apart, both ends included."""
    way_m = lengths_along(points)
    marks = np.diff(np.floor(way_m / _PATH_SPACING_M), prepend=-1.0) > 0.0
    marks[-1] = True
    return np.asarray(points[marks])
