"""The world around the robots: floor, obstacles, walls, goals and stations.

Collision bits: floor 1, hull of a robot 2, obstacle and wall 4. A tyre takes bit 1
only, a hull bits 2 and 4, everything here takes none, so that static things never test
each other. Groups: 1 drawn, 3 hidden solids.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import shapely
from shapely.geometry import Polygon

from mrmg.mujoco_import import mujoco
from mrmg.scene.driven_parts import FLOOR_BIT, OBSTACLE_BIT
from mrmg.scene.region import Region
from mrmg.scene.types import Obstacle, Scene
from mrmg.simulation import palette
from mrmg.simulation.convex import (
    convex_pieces,
    prism_corners,
    triangles,
    upright_solid,
)
from mrmg.simulation.ground_shape import (
    FOUNDATION_M,
    add_height_field,
    draped_mark,
    height_span,
    on_map,
)

_DRAWN_GROUP, _SOLID_GROUP = 1, 3

FLOOR = "floor"
BOUNDS = "bounds"
_FLOOR_MARGIN_M = 4.0
_WALL_HEIGHT_M = 0.5
_WALL_THICKNESS_M = 0.4
_TARGET_THICKNESS_M = 0.03


def add_floor(spec: mujoco.MjSpec, scene: Scene) -> None:
    """Add the ground, a plane or a field of heights."""
    x_min, y_min, x_max, y_max = scene.bounds
    half = np.array([x_max - x_min, y_max - y_min]) / 2 + _FLOOR_MARGIN_M
    center = np.array([x_min + x_max, y_min + y_max]) / 2
    if scene.elevation is None:
        ground = {
            "type": mujoco.mjtGeom.mjGEOM_PLANE,
            "pos": [*center, 0.0],
            "size": [*half, 1.0],
        }
    else:
        foot_m = add_height_field(spec, FLOOR, scene, center, half)
        ground = {
            "type": mujoco.mjtGeom.mjGEOM_HFIELD,
            "hfieldname": FLOOR,
            "pos": [*center, foot_m],
        }
    spec.worldbody.add_geom(
        name=FLOOR, contype=FLOOR_BIT, conaffinity=0, castshadow=False, **ground
    )


def add_obstacle(
    spec: mujoco.MjSpec, scene: Scene, obstacle: Obstacle
) -> mujoco.MjsBody | None:
    """Add one obstacle as a body: hidden convex solids and one drawn mesh.

    One that lies beside the map is left out.

    On a slope it is founded in its lowest ground and rises its height above the
    highest.

    Obstacles stay bodies of their own, even where they overlap, so that a contact can
    name what was touched and so that an exclusion can let single robots through.
    """
    shape = on_map(scene, obstacle.shape)
    if shape.area == 0.0:
        return None
    low, high = height_span(scene, shape)
    foot_m = 0.0 if scene.elevation is None else low - FOUNDATION_M
    height_m = high - foot_m + obstacle.height_m
    body = spec.worldbody.add_body(
        name=f"obstacle:{obstacle.id}", pos=[0.0, 0.0, foot_m]
    )
    for number, ring in enumerate(convex_pieces(shape)):
        name = f"solid:{obstacle.id}:{number}"
        spec.add_mesh(name=name, uservert=prism_corners(ring, height_m).ravel())
        _add_mesh_geom(body, name, contype=OBSTACLE_BIT, group=_SOLID_GROUP)
    colour = palette.OBSTACLE if obstacle.blocks is None else palette.PARTIAL_OBSTACLE
    name = f"obstacle:{obstacle.id}"
    _add_drawn_mesh(spec, name, shape, height_m)
    _add_mesh_geom(body, name, contype=0, group=_DRAWN_GROUP, rgba=[*colour, 1.0])
    return body


def add_bounds(spec: mujoco.MjSpec, scene: Scene) -> None:
    """Add four low walls whose inner faces are the scene's bounds."""
    x_min, y_min, x_max, y_max = scene.bounds
    center = np.array([x_min + x_max, y_min + y_max]) / 2
    half = np.array([x_max - x_min, y_max - y_min]) / 2
    thick = _WALL_THICKNESS_M / 2
    low, high = height_span(scene, shapely.box(*scene.bounds))
    foot_m = 0.0 if scene.elevation is None else low - FOUNDATION_M
    tall = (high - foot_m + _WALL_HEIGHT_M) / 2
    body = spec.worldbody.add_body(name=BOUNDS)
    for axis in (0, 1):
        for side in (-1.0, 1.0):
            at, size = center.copy(), half + 2 * thick
            at[axis] += side * (half[axis] + thick)
            size[axis] = thick
            body.add_geom(
                type=mujoco.mjtGeom.mjGEOM_BOX,
                pos=[*at, foot_m + tall],
                size=[*size, tall],
                contype=OBSTACLE_BIT,
                conaffinity=0,
                group=_DRAWN_GROUP,
                rgba=[*palette.WALL, 1.0],
            )


def add_targets(spec: mujoco.MjSpec, scene: Scene) -> None:
    """Add goals and stations as flat marks named `goal:<id>` and `station:<id>`."""
    for station in scene.stations:
        name = f"station:{station.id}"
        _add_mark(spec, scene, name, station.region, palette.STATION)
    for goal in scene.goals:
        _add_mark(spec, scene, f"goal:{goal.id}", goal.region, palette.GOAL)


def _add_mark(
    spec: mujoco.MjSpec, scene: Scene, name: str, region: Region, colour: palette.Rgb
) -> None:
    look = {
        "contype": 0,
        "group": _DRAWN_GROUP,
        "rgba": [*colour, 0.8],
        "castshadow": False,
    }
    if scene.elevation is None and not len(region.corners):
        half = _TARGET_THICKNESS_M / 2
        spec.worldbody.add_geom(
            name=name,
            type=mujoco.mjtGeom.mjGEOM_CYLINDER,
            pos=[*region.center, half],
            size=[region.radius_m, half, 0.0],
            conaffinity=0,
            **look,
        )
        return
    if scene.elevation is None:
        _add_drawn_mesh(spec, name, region.shape, _TARGET_THICKNESS_M)
    else:
        _add_mesh(spec, name, *draped_mark(scene, region))
    _add_mesh_geom(spec.worldbody, name, **look)


def _add_mesh_geom(body: mujoco.MjsBody, name: str, **look: Any) -> None:
    """Add the mesh of a name as a geom of that name, which tests for no contacts."""
    body.add_geom(
        name=name,
        type=mujoco.mjtGeom.mjGEOM_MESH,
        meshname=name,
        conaffinity=0,
        **look,
    )


def _add_drawn_mesh(
    spec: mujoco.MjSpec, name: str, polygon: Polygon, height_m: float
) -> None:
    """Add the polygon's extrusion as a mesh with flat faces."""
    corners, faces = upright_solid(triangles(polygon), height_m)
    # Shared corners would make MuJoCo smooth the edges away.
    _add_mesh(spec, name, corners[faces.ravel()], np.arange(faces.size))


def _add_mesh(
    spec: mujoco.MjSpec, name: str, corners: np.ndarray, faces: np.ndarray
) -> None:
    spec.add_mesh(
        name=name,
        uservert=corners.ravel(),
        userface=faces.ravel(),
        inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,
    )
