"""ROS 2 messages: their types, their definitions, and their bytes (CDR)."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Any

import numpy as np

from mrmg.extras import import_extra

MAP_FRAME = "map"
"""Frame of the scene's coordinates."""


class RosTypes:
    """Message types of ROS 2 Humble; later releases have not changed those used."""

    def __init__(self) -> None:
        """Load the types.

        Raises:
            MachineError: if rosbags is not installed.
        """
        typesys = import_extra(
            "rosbags.typesys", extra="ros", purpose="encodes ROS 2 messages"
        )
        self._store = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
        self.time = self["builtin_interfaces/Time"]
        self.point = self["geometry_msgs/Point"]
        self.vector = self["geometry_msgs/Vector3"]
        self.quaternion = self["geometry_msgs/Quaternion"]
        self._header, self._pose = self["std_msgs/Header"], self["geometry_msgs/Pose"]

    def __getitem__(self, name: str) -> Any:
        """Return the class of a type such as "geometry_msgs/Pose"."""
        return self._store.types[name.replace("/", "/msg/")]

    def made(self, name: str, **known: Any) -> Any:
        """Return a message of a type, blank (0, "" or empty) where nothing is known."""
        kind = self[name]
        blank = {
            field: self._blank(*described)
            for field, described in self._store.fielddefs[kind.__msgtype__][1]
            if field not in known
        }
        return kind(**known, **blank)

    def _blank(self, sort: Any, element: Any) -> Any:
        """Return the blank value of a field from its description in `fielddefs`."""
        if sort.name == "NAME":
            return self.made(element.replace("/msg/", "/"))
        if sort.name == "BASE":
            return "" if element[0] == "string" else 0
        return np.empty(0, dtype=np.uint8)

    def definition(self, kind: str) -> bytes:
        """Return the definition of a `__msgtype__`, and of the types in it."""
        return bytes(self._store.generate_msgdef(kind, ros_version=2)[0], "utf8")

    def encoded(self, message: Any) -> bytes:
        """Return a message as CDR."""
        return bytes(self._store.serialize_cdr(message, message.__msgtype__))

    def header(self, time_s: float, frame: str = MAP_FRAME) -> Any:
        """Return the header of a message in a frame."""
        stamp = self.time(*divmod(nanoseconds(time_s), 1_000_000_000))
        return self._header(stamp, frame)

    def pose(self, position: Iterable[float], turn: Iterable[float]) -> Any:
        """Return a pose from a position (x, y, z) and a quaternion (x, y, z, w)."""
        return self._pose(self.point(*position), self.quaternion(*turn))


def nanoseconds(time_s: float) -> int:
    """Return a time of the mission in nanoseconds, as ROS and MCAP count it."""
    return round(float(time_s) * 1e9)


def ros_names(ids: Iterable[str]) -> dict[str, str]:
    """Return a name for topics and frames by id: letters, digits and underscores.

    Ids that differ have names that differ.
    """
    names: dict[str, str] = {}
    for item in ids:
        name = re.sub(r"\W", "_", item, flags=re.ASCII)
        name = f"_{name}" if name[0].isdigit() else name
        while name in names.values():
            name += "_"
        names[item] = name
    return names
