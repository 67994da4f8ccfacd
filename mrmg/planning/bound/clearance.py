"""Where the reference point of a robot cannot be, and where it need not be.

It cannot be nearer to an obstacle than the largest disc about it inside the footprint
reaches, r. A robot that only moves along its heading need not be nearer than h, up to
half its width, on its way from one place to another: some way that keeps h costs no
more. Only next to those places, and where prices change, it may have to. What follows
is why.

Let the footprint hold the box from -r to 2 h - r along the heading (or against it) and
from -h to h across, with r <= h <= 2 r. Each point q of an obstacle has a distance
h(q) to be kept, which is h, or r within h of the ends of the way. Let p be a point of
the way nearer to obstacles than that, q the point for which |p - q| - h(q) is least,
d = |p - q| < h the distance and n the direction from q to p. As q is outside the box,
the heading is so near to n, or to -n, that |cos| >= r / d. So the robot moves across n
by at most sqrt(1 - r^2 / d^2) of its speed. Move each such point along the gradient of
that least difference until it is 0:

- At first that leads along n. What moves across n is stretched by at most h / d, as
  about a corner, and (h / d) sqrt(1 - r^2 / d^2) <= 1, as h <= 2 r.
- Where the least is that of several points, it leads on along a ridge. All points that
  get to a ridge at the same side of its lowest point end at one point, which stands
  still.
- The least difference is semiconcave, so its gradient flow is continuous (Petrunin,
  Semiconcave functions in Alexandrov's geometry, Surveys in Differential Geometry 11,
  2007), and the way stays in one piece, but for points from which 0 is not reached:
  those straight between two points of obstacles less than 2 h apart, and pockets that
  such lines enclose. All lines through the reference point are at least 2 h long
  within the box, as r >= h / 2, so it never crosses one of them.

So the moved way is no longer, and its ends, which are h(q) away, are where they were.
It costs no more if the price is the same all over the connected piece of ground nearer
than h(q) that a point is moved within.
"""

from __future__ import annotations

import numpy as np
import shapely

from mrmg.planning.bound.geodesic import ROUND_MARGIN, charged_within_m
from mrmg.scene.robot_model import RobotModel
from mrmg.scene.types import Robot, Scene

TOLERANCE_M = 0.02
"""How much smaller than it is a footprint is taken to be."""


def blocked_ground(scene: Scene, robot: Robot) -> shapely.Geometry:
    """Return where the reference point cannot be."""
    return _obstacles(scene, robot).buffer(_inscribed_m(robot.model))


def avoided_ground(
    scene: Scene, robot: Robot, ends: shapely.Geometry, step_m: float
) -> shapely.Geometry:
    """Return where the reference point need not be on its way between some places.

    Args:
        scene: the scene.
        robot: gives obstacles and footprint.
        ends: the places.
        step_m: longest way of one planning step.
    """
    passing_m = passing_radius_m(robot.model)
    far = _obstacles(scene, robot).difference(ends.buffer(ROUND_MARGIN * passing_m))
    blocked = blocked_ground(scene, robot)
    parts = shapely.get_parts(blocked.union(far.buffer(passing_m)))
    changes = shapely.union_all([area.shape.boundary for area in scene.terrain])
    same = ~shapely.dwithin(parts, changes, 2.0 * charged_within_m(step_m))
    return shapely.union_all([blocked, *parts[same]])


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


def _obstacles(scene: Scene, robot: Robot) -> shapely.Geometry:
    return shapely.union_all([o.shape for o in scene.barriers if o.stops(robot.id)])
