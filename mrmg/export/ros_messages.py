"""ROS 2 messages: their types, their definitions, and their bytes (CDR)."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from mrmg.extras import import_extra

_SECONDS_MARK, _NANOSECONDS_MARK = 0x01FE02FD, 0x03FC04FB
"""Stamps to be replaced; their bytes occur in no text of ASCII letters."""

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
        return self._store.types[_full(name)]

    def definition(self, name: str) -> bytes:
        """Return the message definition, those of the types in it included."""
        return bytes(self._store.generate_msgdef(_full(name), ros_version=2)[0], "utf8")

    def encoded(self, name: str, message: Any) -> bytes:
        """Return a message as CDR."""
        return bytes(self._store.serialize_cdr(message, _full(name)))

    def encoded_series(
        self,
        name: str,
        message_of: Callable[[Any, list[float]], Any],
        time_s: np.ndarray,
        values: np.ndarray,
    ) -> list[bytes]:
        """Return messages that differ in their stamps and in some numbers, as CDR.

        One message with a mark in the place of each is encoded, and the marks are
        replaced for all messages at once: encoding each would take ten times as long.

        Args:
            name: of the type.
            message_of: returns the message of a header and of k numbers (float64).
            time_s: of the messages, shape (n,).
            values: their numbers, shape (n, k).
        """
        marks = np.arange(1, values.shape[1] + 1) * 1e300
        seconds, nanos = np.divmod(np.round(time_s * 1e9).astype(np.int64), 10**9)
        header = self._header(self.time(_SECONDS_MARK, _NANOSECONDS_MARK), MAP_FRAME)
        model = self.encoded(name, message_of(header, marks.tolist()))
        rows = np.tile(np.frombuffer(model, dtype=np.uint8), (len(time_s), 1))
        columns = [
            (np.uint32(_SECONDS_MARK), seconds.astype(np.uint32)),
            (np.uint32(_NANOSECONDS_MARK), nanos.astype(np.uint32)),
            *zip(marks, values.astype(np.float64).T, strict=True),
        ]
        for mark, column in columns:
            numbers = np.ascontiguousarray(column)[:, None].view(np.uint8)
            for place in re.finditer(re.escape(mark.tobytes()), model):
                rows[:, place.start() : place.end()] = numbers
        return [row.tobytes() for row in rows]

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


def _full(name: str) -> str:
    package, _, kind = name.partition("/")
    return f"{package}/msg/{kind}"
