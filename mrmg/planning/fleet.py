"""From a scene's robots to the arrays the kernels work on."""

from __future__ import annotations

import numpy as np

from mrmg.motion._kernels import MODEL_ID
from mrmg.planning._fleet_kernels import Fleet, Spaces
from mrmg.scene.types import Scene
from mrmg.world.world import World

ROADMAP_MARGIN_M = 0.3
"""Clearance of roadmap edges beyond half the robot's width."""


def stack_spaces(world: World) -> Spaces:
    """Stack the world's free spaces; bucket starts and edges are counted through."""
    first = world.spaces[0]
    start, index, edges = [], [], []
    edge_offset = index_offset = 0
    for space in world.spaces:
        start.append(space.bucket_start + index_offset)
        index.append(space.bucket_edge + edge_offset)
        edges.append(space.edge)
        index_offset += len(space.bucket_edge)
        edge_offset += len(space.edge)
    return Spaces(
        x_min=first.x_min,
        y_min=first.y_min,
        cell=first.cell,
        distance=np.stack([space.distance for space in world.spaces]),
        bucket=first.bucket,
        bucket_columns=first.bucket_columns,
        bucket_rows=first.bucket_rows,
        bucket_start=np.stack(start),
        bucket_edge=np.concatenate(index),
        reach=first.reach,
        edge=np.concatenate(edges),
    )


def travel_classes(
    scene: Scene, world: World
) -> tuple[list[tuple[int, float]], list[int]]:
    """Return the distinct (free space, passage clearance) pairs, and each robot's index.

    Robots of one class share a roadmap and its cost-to-go fields.
    """
    keys = [
        (
            int(world.space_of_robot[i]),
            round(robot.model.half_width_m + ROADMAP_MARGIN_M, 6),
        )
        for i, robot in enumerate(scene.robots)
    ]
    distinct = list(dict.fromkeys(keys))
    return distinct, [distinct.index(key) for key in keys]


def fleet_arrays(scene: Scene, world: World) -> Fleet:
    """Return the scene's robots as arrays."""
    robots = scene.robots
    models = [robot.model for robot in robots]
    most = max(len(model.footprint_m) for model in models)
    corner = np.zeros((len(robots), most, 2))
    middle = np.zeros((len(robots), 2))
    radius = np.zeros(len(robots))
    for i, model in enumerate(models):
        outline = model.footprint_m
        corner[i, : len(outline)] = outline
        middle[i] = 0.5 * (outline.min(axis=0) + outline.max(axis=0))
        radius[i] = np.hypot(*(outline - middle[i]).T).max()
    limits = [model.limits.scaled(model.planning_share) for model in models]
    _, field = travel_classes(scene, world)
    return Fleet(
        model=np.array([MODEL_ID[model.motion_model] for model in models]),
        wheelbase=np.array([model.wheelbase_m for model in models]),
        limit=np.array(
            [
                (s.v_min_m_s, s.v_max_m_s, s.w_max, s.u1_max_m_s2, s.u2_max)
                for s in limits
            ]
        ),
        corner=corner,
        corners=np.array([len(model.footprint_m) for model in models]),
        middle=middle,
        radius=radius,
        turning_radius=np.array([model.turning_radius_m for model in models]),
        passage=np.array([m.half_width_m + ROADMAP_MARGIN_M for m in models]),
        space=np.asarray(world.space_of_robot, dtype=np.int64),
        field=np.array(field),
        energy=np.array([model.energy_model.coefficients() for model in models]),
        plain=np.array([m.energy_model.plain_ground_J_per_m() for m in models]),
        capacity=np.array([robot.battery.capacity_J for robot in robots]),
        reserve=np.array([robot.battery.reserve_J for robot in robots]),
    )
