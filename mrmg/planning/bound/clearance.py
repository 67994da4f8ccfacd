"""Where the reference point of a robot cannot be, and where it need not be.

It cannot be nearer to an obstacle than the largest disc about it inside the footprint
reaches, r. A robot that only moves along its heading need not be nearer than h on its
way from one place to another, where h is up to half its width: some way that keeps h
costs no more. What follows is why.

Let the footprint hold the box from -r to 2 h - r along the heading (or against it) and
from -h to h across, with r <= h <= 2 r. Let d < h be the distance from the nearest
obstacle at some time, n the direction away from it. The obstacle is outside the box, so
the heading is so near to n, or -n, that |cos| >= r / d. So the robot moves across n by
at most sqrt(1 - r^2 / d^2) of its speed. Move each point of the way along the gradient
of the distance from obstacles until that is h:

- Beside an edge or a corner, that leads along n. What moves across n is stretched by at
  most h / d, and (h / d) sqrt(1 - r^2 / d^2) <= 1, as h <= 2 r.
- Where obstacles are equally near, it leads on along the medial axis. All points that
  get to it at one side end at the same point, whose speed is 0.
- The flow is continuous (Lieutier, Any open bounded subset of R^n has the same homotopy
  type as its medial axis, Computer-Aided Design 36, 2004), so the way stays in one
  piece, but for points that never get to h: those between obstacles less than 2 h
  apart, and pockets that such gaps enclose. All lines through the reference point are
  at least 2 h long within the box, as r >= h / 2, so it never passes such a gap.

So the moved way is no longer. It costs no more if the price is the same all over the
piece of ground, nearer to obstacles than h, that a point is moved within.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely

from mrmg.planning.bound.geodesic import charged_within_m
from mrmg.scene.robot_model import RobotModel
from mrmg.scene.types import Robot, Scene

TOLERANCE_M = 0.02
"""How much smaller than it is a footprint is taken to be."""


def blocked_ground(scene: Scene, robot: Robot) -> shapely.Geometry:
    """Return where the reference point cannot be."""
    return _nearer_than(scene, robot, _inscribed_m(robot.model))


def avoided_ground(
    scene: Scene,
    robot: Robot,
    step_m: float,
    ends: Sequence[shapely.Geometry] = (),
) -> shapely.Geometry:
    """Return where the reference point need not be on its way between other places.

    Args:
        scene: the scene.
        robot: gives obstacles and footprint.
        step_m: longest way of one planning step.
        ends: places outside of which it must lie.
    """
    parts = shapely.get_parts(_nearer_than(scene, robot, passing_radius_m(robot.model)))
    free = ~shapely.intersects(parts, shapely.union_all(ends))
    changes = shapely.union_all([area.shape.boundary for area in scene.terrain])
    free &= ~shapely.dwithin(parts, changes, 2.0 * charged_within_m(step_m))
    return shapely.union_all([blocked_ground(scene, robot), *parts[free]])


def passing_radius_m(model: RobotModel) -> float:
    """Return the h of a robot, its r if it may move in other ways than straight on."""
    inscribed_m = _inscribed_m(model)
    if model.has_custom_motion:
        return inscribed_m
    footprint = shapely.Polygon(model.footprint_m).buffer(-TOLERANCE_M)
    wider_m = np.linspace(inscribed_m, 2.0 * inscribed_m, 101)
    back, ahead = -inscribed_m, 2.0 * wider_m - inscribed_m
    held = shapely.covers(footprint, shapely.box(back, -wider_m, ahead, wider_m))
    held |= shapely.covers(footprint, shapely.box(-ahead, -wider_m, -back, wider_m))
    return float(wider_m[held].max(initial=inscribed_m))


def _inscribed_m(model: RobotModel) -> float:
    return max(0.0, model.inscribed_radius_m - TOLERANCE_M)


def _nearer_than(scene: Scene, robot: Robot, distance_m: float) -> shapely.Geometry:
    """Return the ground nearer to a robot's obstacles."""
    shapes = [o.shape for o in scene.barriers if o.stops(robot.id)]
    return shapely.union_all(shapes).buffer(distance_m)
