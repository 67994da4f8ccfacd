"""The report's map: an SVG whose parts are named when pointed at, and can be hidden."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup
from shapely import box
from shapely.geometry import Point, Polygon

from mrmg.plans import Plan
from mrmg.report.page import rendered
from mrmg.scene.types import Scene
from mrmg.simulation.log import ExecutionLog
from mrmg.viz import style
from mrmg.viz.activities import breakdowns, lengths_along, thinned, visit_ranks
from mrmg.viz.contours import contour_lines
from mrmg.viz.map_labels import KINDS, map_labels
from mrmg.viz.map_shapes import enclosing_circle, end_poses, wanted_headings
from mrmg.viz.scene_drawing import polygons_of

_PATH_SPACING_M = 0.25


def mission_map(scene: Scene, plan: Plan | None, log: ExecutionLog | None) -> Markup:
    """Return the mission's map as inline SVG; its unit is the metre, y points down.

    Elements with `data-tip` say what they are; those of a robot carry `data-robot` and
    the colour variable `--r<index>`; groups `data-layer` can be hidden.
    """
    x_min, y_min, x_max, y_max = scene.bounds
    width_m, height_m = x_max - x_min, y_max - y_min
    letter_m = max(width_m, height_m) / 48.0
    bounds, ends = box(*scene.bounds), end_poses(plan, log)
    frame = _Frame(x_min, y_max)
    return rendered(
        "map.svg.jinja",
        scene=scene,
        plan=plan,
        log=log,
        width_m=width_m,
        height_m=height_m,
        margin_m=0.6 * letter_m,
        letter_m=letter_m,
        bounds=bounds,
        terrain=[
            (area, part)
            for area in scene.terrain
            for part in polygons_of(area.shape.intersection(bounds))
        ],
        classes=style.terrain_classes(scene),
        contours=contour_lines(scene),
        headings=wanted_headings(scene),
        ranks=visit_ranks(plan) if plan else {},
        broken=[
            (robot, time_s, enclosing_circle(scene.robot(robot), ends[robot])[0])
            for robot, time_s in breakdowns(log).items()
        ],
        labels=map_labels(
            scene,
            plan,
            log,
            em_m=letter_m,
            kinds=[kind for kind in KINDS if kind != "stop"],
        ),
        ring=lambda passage: Point(passage.x_m, passage.y_m).buffer(letter_m),
        point=frame.point,
        points=frame.points,
        outline=frame.outline,
        thinned=lambda state: thinned(state[:, :2], _PATH_SPACING_M),
        lengths=lengths_along,
        degrees=np.degrees,
    )


@dataclass(frozen=True, slots=True)
class _Frame:
    """The map's frame: its upper left corner is (0, 0)."""

    x_min: float
    y_max: float

    def point(self, x_m: float, y_m: float) -> tuple[float, float]:
        return round(float(x_m - self.x_min), 2), round(float(self.y_max - y_m), 2)

    def points(self, line: Iterable[tuple[float, float]]) -> str:
        return " ".join("{},{}".format(*self.point(x, y)) for x, y in line)

    def outline(self, shape: Polygon) -> str:
        rings = [
            "M" + "L".join("{} {}".format(*self.point(x, y)) for x, y in ring.coords)
            for ring in (shape.exterior, *shape.interiors)
        ]
        return f"{''.join(rings)}Z"
