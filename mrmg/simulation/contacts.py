"""Watching for touches other than tyre to floor."""

from __future__ import annotations

import math

import numpy as np

from mrmg.mujoco_import import mujoco
from mrmg.scene.driven_parts import CHASSIS, HULL
from mrmg.simulation.log import Contact
from mrmg.simulation.scenery import FLOOR
from mrmg.simulation.world_model import MujocoWorld


class ContactWatch:
    """Notes the beginning of every touch of a robot's hull.

    Attributes:
        contacts: in order of time.
    """

    def __init__(self, world: MujocoWorld) -> None:
        """Watch the robots of `world`."""
        self.contacts: list[Contact] = []
        model = world.model
        hulls = [model.geom(f"{robot.id}/{HULL}").id for robot in world.scene.robots]
        self._is_hull = np.isin(np.arange(model.ngeom), hulls)
        self._label = [_label(model, geom) for geom in range(model.ngeom)]
        self._touching: set[tuple[str, str]] = set()
        self._seen = b""

    def look(self, data: mujoco.MjData) -> None:
        """Record which touches of the present state are new."""
        geoms = data.contact.geom
        seen = geoms.tobytes()
        if seen == self._seen:
            return
        self._seen = seen
        hulls = self._is_hull.take(geoms)
        # Most often there are but tyres on the floor.
        if not hulls.any():
            self._touching.clear()
            return
        touching: dict[tuple[str, str], int] = {}
        for index in np.flatnonzero(hulls.any(axis=1)).tolist():
            hull, other = geoms[index] if hulls[index, 0] else geoms[index, ::-1]
            touching.setdefault((self._label[hull], self._label[other]), index)
        for robot, other in sorted(touching.keys() - self._touching):
            x_m, y_m, _ = data.contact.pos[touching[robot, other]].tolist()
            if math.isfinite(x_m + y_m):  # not where the physics diverge
                place = Contact(float(data.time), robot, other, x_m, y_m)
                self.contacts.append(place)
        self._touching = set(touching)


def _label(model: mujoco.MjModel, geom: int) -> str:
    """Return what a contact calls a geom: an id, or the floor or bounds."""
    body = model.body(model.body_rootid[model.geom_bodyid[geom]]).name
    if body == "world":
        return FLOOR
    return str(body.removeprefix("obstacle:").removesuffix(f"/{CHASSIS}"))
