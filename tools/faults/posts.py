"""Posts that no pose of a plan touches, though its motion between two poses does."""

from __future__ import annotations

from random import Random

import numpy as np
import shapely

from mrmg.motion.user_motion import plain_step
from mrmg.plans import Trajectory
from mrmg.scene.robot_model import RobotModel
from mrmg.scene.types import Obstacle

TRIES = 30
SUBSTEPS = 8


def thin_post(
    model: RobotModel, trajectory: Trajectory, random: Random
) -> Obstacle | None:
    """Return a post that is swept between two states; None where none was found.

    The front of the footprint advances by a few centimetres in a step; the post stands
    in what only poses between two states cover. Turns in place and wide footprints
    leave the largest such slivers at corners.
    """
    moving = np.flatnonzero(np.abs(trajectory.state[:-1, 3]) > 0.2)
    poses = shapely.polygons(model.footprint_at(trajectory.state))
    shapely.prepare(poses)
    for _ in range(TRIES if len(moving) else 0):
        step = int(random.choice(moving.tolist()))
        swept = shapely.polygons(model.footprint_at(_between(model, trajectory, step)))
        near = poses[shapely.intersects(poses, shapely.union_all(swept))]
        slivers = shapely.difference(shapely.union_all(swept), shapely.union_all(near))
        parts = [part for part in shapely.get_parts(slivers) if part.area > 1e-9]
        if not parts:
            continue
        sliver = max(parts, key=lambda part: part.area)
        place = shapely.get_point(shapely.maximum_inscribed_circle(sliver, 1e-5), 0)
        room_m = float(shapely.distance(place, shapely.union_all(near)))
        depth_m = float(shapely.distance(place, shapely.boundary(sliver)))
        if min(room_m, depth_m) < 1e-6:
            continue
        size_m = min(room_m, 0.01) * random.uniform(0.1, 0.9)
        post = shapely.buffer(place, size_m, quad_segs=2)
        if not shapely.intersects(poses, post).any():
            return Obstacle(id="thin_post", shape=post, height_m=1.0)
    return None


def _between(model: RobotModel, trajectory: Trajectory, number: int) -> np.ndarray:
    """Return states between two states of a trajectory, by the equations of motion."""
    step = plain_step(model)
    state = tuple(trajectory.state[number].tolist())
    control = tuple(trajectory.control[number].tolist())
    times_s = np.linspace(0.0, trajectory.dt_s, SUBSTEPS + 2)[1:-1]
    length_m = float(model.wheelbase_m)
    return np.array([step(state, control, length_m, float(time)) for time in times_s])
