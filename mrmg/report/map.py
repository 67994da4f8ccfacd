"""The report's map: an SVG whose parts tell of themselves and can be switched off."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from html import escape

import numpy as np
from shapely import box
from shapely.geometry import Polygon

from mrmg.plans import Plan
from mrmg.scene.types import Goal, Robot, Scene, Station
from mrmg.simulation.log import ExecutionLog
from mrmg.viz import style
from mrmg.viz.activities import breakdowns, visit_ranks, way_to
from mrmg.viz.contours import contour_lines
from mrmg.viz.map_labels import KINDS, MapLabel, map_labels
from mrmg.viz.map_shapes import enclosing_circle, end_poses
from mrmg.viz.scene_drawing import polygons_of

_PATH_SPACING_M = 0.25
_GROUND_KINDS = ("terrain", "obstacle", "height")
_TARGET_KINDS = ("goal", "station")
_ROBOT_KINDS = ("path", "breakdown")


def mission_map(scene: Scene, plan: Plan | None, log: ExecutionLog | None) -> str:
    """Return the mission's map as inline SVG; its unit is the metre, y points down.

    Elements with `data-tip` say what they are; those of a robot carry `data-robot` and
    the colour variable `--r<index>`; groups `data-layer` can be hidden.
    """
    x_min, y_min, x_max, y_max = scene.bounds
    width, height = x_max - x_min, y_max - y_min
    letter = max(width, height) / 48.0
    canvas = _Canvas(scene)
    kinds = [kind for kind in KINDS if kind != "stop"]
    labels = map_labels(scene, plan, log, em_m=letter, kinds=kinds)
    names = {label.of: label for label in labels if label.kind == "robot"}
    layers = [
        canvas.group(
            "ground", [*canvas.ground(), *canvas.texts(labels, _GROUND_KINDS)]
        ),
        canvas.group("planned", canvas.planned(plan)),
        canvas.group("driven", canvas.driven(log)),
        canvas.group(
            "targets", [*canvas.targets(plan), *canvas.texts(labels, _TARGET_KINDS)]
        ),
        canvas.group(
            "robots",
            [
                *canvas.texts(labels, _ROBOT_KINDS),
                *canvas.robots(names),
                *canvas.breakdowns(plan, log),
            ],
        ),
    ]
    margin = 0.6 * letter
    return (
        f'<svg class="map" role="img" aria-label="Map of {escape(scene.name)}"'
        f' viewBox="{-margin:.2f} {-margin:.2f} '
        f'{width + 2 * margin:.2f} {height + 2 * margin:.2f}"'
        f' style="font-size:{letter:.3f}px;--line:{letter / 10:.3f}px">'
        f"{''.join(layers)}</svg>"
    )


class _Canvas:
    """Turns a scene's things into SVG elements."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._x_min, self._y_max = scene.bounds[0], scene.bounds[3]
        self._index = {robot.id: at for at, robot in enumerate(scene.robots)}

    def group(self, layer: str, parts: Iterable[str]) -> str:
        return f'<g data-layer="{layer}">{"".join(parts)}</g>'

    def ground(self) -> Iterable[str]:
        bounds = box(*self._scene.bounds)
        yield self._shape(bounds, "ground", "plain ground, terrain ×1")
        classes = style.terrain_classes(self._scene)
        for area in self._scene.terrain:
            tip = f"{area.id}: driving costs ×{area.multiplier:g}"
            fill = f"--c:{classes[area.multiplier].color}"
            for part in polygons_of(area.shape.intersection(bounds)):
                yield self._shape(part, "terrain", tip, fill)
        for level_m, line in contour_lines(self._scene):
            points = " ".join("{},{}".format(*self._point(x, y)) for x, y in line)
            yield (
                f'<polyline class="contour" points="{points}" '
                f'data-tip="{level_m:g} m high"/>'
            )
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
    ) -> Iterable[str]:
        """Write the names of some kinds where they were placed."""
        for label in labels:
            if label.kind in kinds:
                x, y = self._point(label.x_m, label.y_m)
                of_robot = label.of in self._index
                owner = f' data-robot="{escape(label.of)}"' if of_robot else ""
                color = f"--c:var(--r{self._index[label.of]});" if of_robot else ""
                look = f"label {label.kind}-name"
                yield (
                    f'<text class="{look}"{owner} x="{x}" y="{y}" '
                    f'style="{color}font-size:{label.size_em:g}em">'
                    f"{escape(label.text)}</text>"
                )

    def planned(self, plan: Plan | None) -> Iterable[str]:
        for item in plan.trajectories if plan else ():
            yield self._path(item.robot, item.state, "planned")

    def driven(self, log: ExecutionLog | None) -> Iterable[str]:
        if log is None:
            return
        for robot, state in zip(log.robots, log.state, strict=True):
            yield self._path(robot, state, "driven")
        for contact in log.contacts:
            x, y = self._point(contact.x_m, contact.y_m)
            tip = f"{contact.robot} touched {contact.other} at {contact.time_s:.2f} s"
            yield (
                f'<text class="contact" x="{x}" y="{y}" data-tip="{escape(tip)}">'
                "✖</text>"
            )

    def breakdowns(self, plan: Plan | None, log: ExecutionLog | None) -> Iterable[str]:
        ends = end_poses(plan, log)
        for robot, time_s in breakdowns(log).items():
            middle, _ = enclosing_circle(self._scene.robot(robot), ends[robot])
            x, y = self._point(*middle)
            tip = f"{robot} broke down at {time_s:.1f} s"
            yield (
                f'<text class="contact" data-robot="{escape(robot)}" x="{x}" y="{y}" '
                f'data-tip="{escape(tip)}">✖</text>'
            )

    def targets(self, plan: Plan | None) -> Iterable[str]:
        ranks = visit_ranks(plan) if plan else {}
        for target in self._scene.targets():
            yield self._target(target, ranks.get(target.id, []))

    def _target(self, target: Goal | Station, visits: list[tuple[str, int]]) -> str:
        station = isinstance(target, Station)
        tip = f"{target.id}: {'recharging station' if station else 'goal'}"
        tip += "".join(f"; stop {rank} of {robot}" for robot, rank in visits)
        look, robot, color = ("station" if station else "goal"), "", ""
        if visits and not station:
            robot = visits[0][0]
            look += " assigned"
            color = f"--c:var(--r{self._index[robot]})"
        return self._shape(target.region.shape, look, tip, color, target.id)

    def robots(self, names: Mapping[str, MapLabel]) -> Iterable[str]:
        """Draw the robots at their starts, with names that go with them."""
        for at, robot in enumerate(self._scene.robots):
            outline = " ".join(f"{x:.3f},{-y:.3f}" for x, y in robot.model.footprint_m)
            x, y = self._point(*robot.pose[:2])
            turn = -np.degrees(robot.pose[2])
            name = names[robot.id]
            beside = name.x_m - robot.pose[0], robot.pose[1] - name.y_m
            yield (
                f'<g class="robot" data-robot="{escape(robot.id)}" '
                f'style="--c:var(--r{at})" data-tip="{escape(_about(robot))}">'
                f'<g class="body" transform="translate({x} {y}) rotate({turn:.2f})">'
                f'<polygon points="{outline}"/><circle r="0.18"/></g>'
                f'<text class="label" x="{x + beside[0]:.2f}" y="{y + beside[1]:.2f}" '
                f'data-beside="{beside[0]:.2f} {beside[1]:.2f}">{escape(robot.id)}'
                "</text></g>"
            )

    def _path(self, robot: str, state: np.ndarray, look: str) -> str:
        points = _thinned(state[:, :2])
        corners = " ".join("{},{}".format(*self._point(x, y)) for x, y in points)
        way_m = float(way_to(state)[-1])
        return (
            f'<polyline class="path {look}" data-robot="{escape(robot)}" '
            f'style="--c:var(--r{self._index[robot]})" points="{corners}" '
            f'data-tip="{escape(robot)}: {look} path, {way_m:.1f} m"/>'
        )

    def _shape(
        self, shape: Polygon, look: str, tip: str, fill: str = "", target: str = ""
    ) -> str:
        rings = [shape.exterior, *shape.interiors]
        path = "".join(
            "M" + "L".join("{} {}".format(*self._point(x, y)) for x, y in ring.coords)
            for ring in rings
        )
        named = f' data-target="{escape(target)}"' if target else ""
        return (
            f'<path class="{look}" style="{fill}" d="{path}Z" '
            f'fill-rule="evenodd" data-tip="{escape(tip)}"{named}/>'
        )

    def _point(self, x_m: float, y_m: float) -> tuple[float, float]:
        return round(float(x_m - self._x_min), 2), round(float(self._y_max - y_m), 2)


def _about(robot: Robot) -> str:
    return f"{robot.id}: {robot.model.name}, {robot.battery.capacity_J / 1000:.1f} kJ"


def _thinned(points: np.ndarray) -> np.ndarray:
    """Return points of a path about `_PATH_SPACING_M` apart, both ends included."""
    way_m = way_to(points)
    marks = np.diff(np.floor(way_m / _PATH_SPACING_M), prepend=-1.0) > 0.0
    marks[-1] = True
    return np.asarray(points[marks])
