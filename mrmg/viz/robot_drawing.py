"""A picture of one robot: as the simulation draws it, with its footprint outlined."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from mrmg.scene.driven_parts import why_not_driven
from mrmg.scene.robot_figures import figure_lines
from mrmg.scene.robot_model import RobotModel
from mrmg.scene.types import Scene
from mrmg.simulation.world_model import build_world
from mrmg.viz import style
from mrmg.viz.figures import new_figure, require_format, write_figure
from mrmg.viz.scene_drawing import HALO
from mrmg.viz.world_view import camera_at, open_view, top_camera

_PIXELS = (1100, 800)
_GROUND = np.array([228, 232, 224], dtype=np.uint8)
_FOVY_DEG = 32.0
_OUTLINE = "#d62728"


def draw_robot(model: RobotModel, path: Path) -> None:
    """Draw a robot from its front left and from above, beside its figures.

    A model that is only planned for is drawn as its footprint.

    Args:
        model: of the robot.
        path: file to write; its suffix, one of `figures.FORMATS`, gives the format.

    Raises:
        UsageError: if the suffix is unknown.
        MachineError: if the robot has an MJCF and this machine cannot draw it.
    """
    require_format(path)
    figure = new_figure(11.0, 6.6)
    figure.suptitle(model.name, fontsize=15, fontweight="bold")
    rows = figure.add_gridspec(2, 1, height_ratios=(4.2, 2.0))
    halves = rows[0].subgridspec(1, 2)
    panels = [figure.add_subplot(place) for place in (halves[0], halves[1], rows[1])]
    for axes in panels:
        axes.axis("off")
    seen, above, table = panels
    outline = np.vstack([model.footprint_m, model.footprint_m[:1]])
    if why_not_driven(model) is None:
        _draw_rendered(model, outline, seen, above)
    else:
        seen.text(0.5, 0.5, "has no MJCF to be drawn by", ha="center", va="center")
        above.plot(outline[:, 0], outline[:, 1], color=_OUTLINE)
        above.plot(0.0, 0.0, "+", color=_OUTLINE, markersize=12)
        above.set_aspect("equal")
        above.set_axis_on()
        above.set_xlabel("x [m]")
        above.set_ylabel("y [m]")
    seen.set_title("red: the footprint on the ground", fontsize=9, color=style.MUTED)
    above.set_title("from above; +: the reference point", fontsize=9, color=style.MUTED)
    table.text(
        0.02, 1.0, "\n".join(figure_lines(model)), family="monospace", fontsize=10,
        va="top", linespacing=1.35, transform=table.transAxes,
    )  # fmt: skip
    write_figure(figure, path)


def _draw_rendered(
    model: RobotModel, outline: np.ndarray, seen: Axes, above: Axes
) -> None:
    """Draw the simulated robot with its outline on both axes."""
    size_m = 2.0 * model.circumscribed_radius_m
    world = build_world(Scene.around(model, 20.0 * size_m))
    ground = np.broadcast_to(_GROUND, (16, 16, 3)).copy()
    middle = model.middle_m
    away_m = 0.7 * (size_m + model.height_m) / math.tan(math.radians(_FOVY_DEG))
    corner = camera_at([*middle, 0.4 * model.height_m], 215.0, -22.0, away_m)
    top = top_camera(middle)
    extent = np.ptp(model.footprint_m, axis=0)
    width, height = _PIXELS
    seen_m = 1.25 * max(extent[1], extent[0] * height / width)
    points = np.column_stack([outline, np.full(len(outline), 0.01)])
    with open_view(world, ground, _PIXELS) as view:
        for axes, camera, fovy in ((seen, corner, _FOVY_DEG), (above, top, seen_m)):
            view.place(world.model.qpos0)
            axes.imshow(view.draw(camera, _PIXELS, fovy=fovy, shadows=True))
            axes.plot(*view.project(points).T, color=_OUTLINE, path_effects=HALO)
            if camera is top:
                reference = view.project(np.zeros((1, 3)))
                axes.plot(
                    *reference.T, "+", color=_OUTLINE, markersize=12, path_effects=HALO
                )
            axes.set_xlim(0, width)
            axes.set_ylim(height, 0)
