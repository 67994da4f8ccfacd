"""The drawn shapes of a MuJoCo world as triangle meshes, by body and colour."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import trimesh

from mrmg.mujoco_import import mujoco
from mrmg.scene.loading.mjcf import mesh_of

_LAST_DRAWN_GROUP = 2
_SIDES = 24


Rgb = tuple[int, int, int]


def body_meshes(
    model: mujoco.MjModel, *, without: frozenset[int] = frozenset()
) -> Iterator[tuple[int, Rgb, trimesh.Trimesh]]:
    """Yield (body, colour, mesh in the body's frame): one per body and colour.

    Args:
        model: the world.
        without: geoms to leave out.
    """
    for body in range(model.nbody):
        start, count = model.body_geomadr[body], model.body_geomnum[body]
        by_color: dict[Rgb, list[trimesh.Trimesh]] = {}
        for geom in range(start, start + count):
            if geom not in without and _is_solid(model, geom):
                red, green, blue = np.round(255.0 * geom_rgba(model, geom)[:3])
                color = (int(red), int(green), int(blue))
                by_color.setdefault(color, []).append(geom_mesh(model, geom))
        for color, parts in by_color.items():
            joined: Any = trimesh.util.concatenate(parts)
            yield body, color, joined


def geom_mesh(model: mujoco.MjModel, geom: int) -> trimesh.Trimesh:
    """Return the shape of a geom in its body's frame."""
    mesh = _shape(model, geom)
    turned: Any = trimesh.transformations.quaternion_matrix
    pose = turned(model.geom_quat[geom])
    pose[:3, 3] = model.geom_pos[geom]
    mesh.apply_transform(pose)
    return mesh


def geom_rgba(model: mujoco.MjModel, geom: int) -> np.ndarray:
    """Return the colour of a geom, or of its material where it has one."""
    material = model.geom_matid[geom]
    source = model.geom_rgba[geom] if material < 0 else model.mat_rgba[material]
    return np.asarray(source)


def _is_solid(model: mujoco.MjModel, geom: int) -> bool:
    return bool(
        model.geom_group[geom] <= _LAST_DRAWN_GROUP
        and model.geom_type[geom] != mujoco.mjtGeom.mjGEOM_PLANE
        and geom_rgba(model, geom)[3] > 0.0
    )


def _shape(model: mujoco.MjModel, geom: int) -> trimesh.Trimesh:
    size, kind = model.geom_size[geom], mujoco.mjtGeom(model.geom_type[geom])
    create: Any = trimesh.creation
    shape: Any
    if kind == mujoco.mjtGeom.mjGEOM_MESH:
        shape = mesh_of(model, model.geom_dataid[geom])
    elif kind == mujoco.mjtGeom.mjGEOM_BOX:
        shape = create.box(extents=2.0 * size)
    elif kind == mujoco.mjtGeom.mjGEOM_CYLINDER:
        shape = create.cylinder(radius=size[0], height=2.0 * size[1], sections=_SIDES)
    elif kind == mujoco.mjtGeom.mjGEOM_CAPSULE:
        shape = create.capsule(
            radius=size[0], height=2.0 * size[1], count=[_SIDES, _SIDES // 2]
        )
        shape.apply_translation(-shape.bounds.mean(axis=0))
    else:
        shape = create.icosphere(subdivisions=2)
        is_ball = kind == mujoco.mjtGeom.mjGEOM_SPHERE
        shape.apply_scale(size[0] if is_ball else size)
    return trimesh.Trimesh(vertices=shape.vertices, faces=shape.faces)
