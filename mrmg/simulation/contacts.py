"""Watching for touches other than tyre to floor."""

from __future__ import annotations

from mrmg.mujoco_import import mujoco
from mrmg.simulation.log import Contact
from mrmg.simulation.world_model import MujocoWorld


class ContactWatch:
    """Notes the beginning of every touch of a robot's hull.

    Attributes:
        contacts: in order of time.
    """

    def __init__(self, world: MujocoWorld) -> None:
        """Watch the robots of `world`."""
        self.contacts: list[Contact] = []
        self._owner, self._label = world.hull_owner, world.geom_label
        self._robots = [robot.id for robot in world.scene.robots]
        self._touching: set[tuple[str, str]] = set()

    def look(self, data: mujoco.MjData) -> None:
        """Record which touches of the present state are new."""
        geoms = data.contact.geom
        owners = self._owner.take(geoms)
        # Most often there are but tyres on the floor.
        if owners.max(initial=-1) < 0:
            self._touching.clear()
            return
        touching: dict[tuple[str, str], int] = {}
        for index in (owners.max(axis=1) >= 0).nonzero()[0]:
            hull, other = geoms[index]
            if owners[index][0] < 0:
                hull, other = other, hull
            pair = (self._robots[self._owner[hull]], self._label[other])
            touching.setdefault(pair, int(index))
        for robot, other in sorted(touching.keys() - self._touching):
            x_m, y_m, _ = data.contact.pos[touching[robot, other]]
            self.contacts.append(
                Contact(float(data.time), robot, other, float(x_m), float(y_m))
            )
        self._touching = set(touching)
