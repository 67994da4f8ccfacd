"""The report's map: an SVG whose parts tell of themselves and can be switched off."""

from __future__ import annotations

from collections.abc import Iterable
from html import escape

import numpy as np
from shapely import box
from shapely.geometry import Polygon

from mrmg.execution.log import ExecutionLog
from mrmg.mission import Plan
from mrmg.results import style
from mrmg.results.contours import contour_lines, label_spot
from mrmg.results.overview import name_spots, visit_ranks, way_to
from mrmg.results.scene_drawing import polygons_of, terrain_spots
from mrmg.scene.types import Goal, Robot, Scene, Station

_PATH_SPACING_M = 0.25


def mission_map(scene: Scene, plan: Plan | None, log: ExecutionLog | None) -> str:
    """Return the mission's map as inline SVG; its unit is the metre, y points down.

    Elements with `data-tip` say what they are; those of a robot carry `data-robot` and
    the colour variable `--r<index>`; groups `data-layer` can be hidden.
    """
    x_min, y_min, x_max, y_max = scene.bounds
    width, height = x_max - x_min, y_max - y_min
    letter = max(width, height) / 48.0
    canvas = _Canvas(scene)
    layers = [
        canvas.group("ground", canvas.ground()),
        canvas.group("planned", canvas.planned(plan)),
        canvas.group("driven", canvas.driven(log)),
        canvas.group("targets", canvas.targets(plan)),
        canvas.group("robots", [*canvas.owners(plan), *canvas.robots()]),
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
            spot = label_spot(line)
            if spot is not None:
                x, y = self._point(*spot)
                yield f'<text class="height" x="{x}" y="{y}">{level_m:g}</text>'
        for obstacle in self._scene.obstacles:
            look, tip = "obstacle", f"{obstacle.id}: obstacle"
            if obstacle.blocks is not None:
                look += " partial"
                tip += f" for {', '.join(obstacle.blocks)}"
            yield self._shape(obstacle.shape, look, tip)
        for x_m, y_m, multiplier in terrain_spots(self._scene):
            x, y = self._point(x_m, y_m)
            yield f'<text class="hint" x="{x}" y="{y}">×{multiplier:g}</text>'

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

    def targets(self, plan: Plan | None) -> Iterable[str]:
        ranks = visit_ranks(plan) if plan else {}
        names = {
            **style.goal_labels(self._scene),
            **style.station_labels(self._scene),
        }
        for target in self._scene.targets():
            yield self._target(target, names[target.id], ranks.get(target.id, []))

    def _target(
        self, target: Goal | Station, name: str, visits: list[tuple[str, int]]
    ) -> str:
        station = isinstance(target, Station)
        tip = f"{target.id}: {'recharging station' if station else 'goal'}"
        tip += "".join(f"; stop {rank} of {robot}" for robot, rank in visits)
        look, robot, color = ("station" if station else "goal"), "", ""
        if visits and not station:
            robot = visits[0][0]
            look += " assigned"
            color = f"--c:var(--r{self._index[robot]})"
        x, y = self._point(*target.region.center)
        _, top = self._point(target.region.center[0], target.region.shape.bounds[3])
        label = f"⚡{name}" if station else name
        return (
            f"{self._shape(target.region.shape, look, tip, color, target.id)}"
            f'<text class="name" x="{x}" y="{top - 0.25}">{escape(label)}</text>'
        )

    def owners(self, plan: Plan | None) -> Iterable[str]:
        """Write its robot's name on each path, for those who see no colours."""
        spots = name_spots(self._scene, plan) if plan else {}
        for robot, spot in spots.items():
            x, y = self._point(*spot)
            yield (
                f'<text class="whose" data-robot="{escape(robot)}" x="{x}" '
                f'y="{y}" style="--c:var(--r{self._index[robot]})">'
                f"{escape(robot)}</text>"
            )

    def robots(self) -> Iterable[str]:
        for at, robot in enumerate(self._scene.robots):
            outline = " ".join(f"{x:.3f},{-y:.3f}" for x, y in robot.model.footprint_m)
            x, y = self._point(*robot.pose[:2])
            turn = -np.degrees(robot.pose[2])
            yield (
                f'<g class="robot" data-robot="{escape(robot.id)}" '
                f'style="--c:var(--r{at})" data-tip="{escape(_about(robot))}">'
                f'<g class="body" transform="translate({x} {y}) rotate({turn:.2f})">'
                f'<polygon points="{outline}"/><circle r="0.18"/></g>'
                f'<text class="name" x="{x}" y="{y}" dy="2em">{escape(robot.id)}'
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
