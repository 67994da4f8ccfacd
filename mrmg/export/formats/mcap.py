"""A recording of ROS 2 messages (MCAP) that Foxglove, RViz and others show as it is.

Times are seconds of the mission: it starts at time 0.

| topic | type | when |
|---|---|---|
| /map | nav_msgs/OccupancyGrid | at the start |
| /scene, /robots | visualization_msgs/MarkerArray | at the start |
| /goals | visualization_msgs/MarkerArray | at the start; each once more when visited |
| /tf | tf2_msgs/TFMessage | 20 times a second, from `map` to `ROBOT/base_link` |
| /ROBOT/pose | geometry_msgs/PoseStamped | 10 times a second |
| /ROBOT/battery | sensor_msgs/BatteryState | once a second, and at changes |
| /ROBOT/planned_path, /ROBOT/driven_path | nav_msgs/Path | at the start |
"""

from __future__ import annotations

import heapq
import io
from collections.abc import Iterator, Mapping
from operator import itemgetter
from typing import Any

import numpy as np

from mrmg import __version__
from mrmg.energy.metering import Motion
from mrmg.export.mission import Course, Mission, every, path_indices
from mrmg.export.ros_messages import RosTypes, nanoseconds, ros_names
from mrmg.export.ros_scene import (
    goal_markers,
    occupancy_grid,
    robot_markers,
    scene_markers,
)
from mrmg.export.table import Files, Format
from mrmg.extras import import_extra
from mrmg.scene.types import Scene
from mrmg.simulation import palette
from mrmg.world.elevation import ground_poses

TF_PERIOD_S = 0.05
POSE_PERIOD_S = 0.1
BATTERY_PERIOD_S = 1.0

_LATCHED = (
    "nav_msgs/msg/OccupancyGrid",
    "visualization_msgs/msg/MarkerArray",
    "nav_msgs/msg/Path",
)
_LATCHED_QOS = """\
- history: 1
  depth: 1000
  reliability: 1
  durability: 1
  deadline: {sec: 9223372036, nsec: 854775807}
  lifespan: {sec: 9223372036, nsec: 854775807}
  liveliness: 1
  liveliness_lease_duration: {sec: 9223372036, nsec: 854775807}
  avoid_ros_namespace_conventions: false
"""
"""Of map, markers and paths: who subscribes late gets what was sent before, too."""


_Message = tuple[float, str, Any]
"""Time [s], topic, and a message as rosbags has it."""


def files(mission: Mission, versions: tuple[str, ...] = ()) -> Files:
    """Return the recording.

    Raises:
        MachineError: if mcap or rosbags is not installed.
    """
    mcap = import_extra("mcap.writer", extra="ros", purpose="writes MCAP files")
    ros = RosTypes()
    data = io.BytesIO()
    writer = mcap.Writer(data)
    writer.start(profile="ros2", library=f"mrmg {__version__}")
    writer.add_metadata("mrmg", _metadata(mission))
    schemas: dict[str, int] = {}
    channels: dict[str, int] = {}
    for time_s, topic, message in _messages(ros, mission):
        kind = message.__msgtype__
        if kind not in schemas:
            text = ros.definition(kind)
            schemas[kind] = writer.register_schema(kind, "ros2msg", text)
        if topic not in channels:
            latched = {"offered_qos_profiles": _LATCHED_QOS}
            qos = latched if kind in _LATCHED else {}
            channels[topic] = writer.register_channel(topic, "cdr", schemas[kind], qos)
        time_ns = nanoseconds(time_s)
        writer.add_message(channels[topic], time_ns, ros.encoded(message), time_ns)
    writer.finish()
    return {"mission.mcap": data.getvalue()}


def _metadata(mission: Mission) -> dict[str, str]:
    """Return what the recording shows."""
    plan = mission.plan
    return {
        "motion": mission.motion,
        "scene": plan.scene_name,
        "scene_digest": plan.scene_digest,
        "plan_digest": plan.digest,
        "seed": str(plan.seed),
    }


def _messages(ros: RosTypes, mission: Mission) -> Iterator[_Message]:
    """Return all messages in the order of their times."""
    names = ros_names(course.robot for course in mission.courses)
    streams = [
        _still(ros, mission, names),
        _goals(ros, mission),
        _transforms(ros, mission, names),
    ]
    for course in mission.courses:
        name = names[course.robot]
        streams += [
            _poses(ros, mission.scene, course, f"/{name}/pose"),
            _battery(ros, course, f"/{name}/battery"),
        ]
    return heapq.merge(*streams, key=itemgetter(0))


def _still(
    ros: RosTypes, mission: Mission, names: Mapping[str, str]
) -> Iterator[_Message]:
    """Yield what does not change: map, scene, shapes of the robots, and paths."""
    scene = mission.scene
    yield 0.0, "/map", occupancy_grid(ros, scene)
    yield 0.0, "/scene", scene_markers(ros, scene)
    yield 0.0, "/robots", robot_markers(ros, scene, names)
    driven = mission.log.driven_motions() if mission.log is not None else ()
    for word, motions in (("planned", mission.plan.trajectories), ("driven", driven)):
        for each in motions:
            yield 0.0, f"/{names[each.robot]}/{word}_path", _path(ros, scene, each)


def _path(ros: RosTypes, scene: Scene, motion: Motion) -> Any:
    """Return the path of a motion, with the times at which it gets to its bends."""
    at = path_indices(motion.time_s, motion.state)
    poses = [pose for _, pose in _stamped(ros, scene, motion, at)]
    return ros["nav_msgs/Path"](ros.header(0.0), poses)


def _goals(ros: RosTypes, mission: Mission) -> Iterator[_Message]:
    """Yield all goals, then each that is visited in the colour of its robot."""
    scene = mission.scene
    every_goal = goal_markers(ros, scene, [goal.id for goal in scene.goals])
    yield 0.0, "/goals", every_goal
    robots = [course.robot for course in mission.courses]
    visits = [visit for course in mission.courses for visit in course.visits]
    for visit in sorted(visits, key=lambda visit: visit.time_s):
        if visit.kind == "goal":
            color = palette.robot_colour(robots.index(visit.robot))
            goal = goal_markers(
                ros, scene, [visit.target], color=color, time_s=visit.time_s
            )
            yield visit.time_s, "/goals", goal


def _transforms(
    ros: RosTypes, mission: Mission, names: Mapping[str, str]
) -> Iterator[_Message]:
    """Yield the frames of all robots, each time all of them."""
    stamped = ros["geometry_msgs/TransformStamped"]
    transform = ros["geometry_msgs/Transform"]
    frames = [f"{names[course.robot]}/base_link" for course in mission.courses]
    at = every(mission.time_s, TF_PERIOD_S)
    poses = [
        _ros_poses(mission.scene, course.state[at]).tolist()
        for course in mission.courses
    ]
    for time_s, *places in zip(mission.time_s[at].tolist(), *poses, strict=True):
        header = ros.header(time_s)
        transforms = [
            stamped(
                header,
                frame,
                transform(ros.vector(*pose[:3]), ros.quaternion(*pose[3:])),
            )
            for frame, pose in zip(frames, places, strict=True)
        ]
        yield time_s, "/tf", ros["tf2_msgs/TFMessage"](transforms)


def _poses(
    ros: RosTypes, scene: Scene, course: Course, topic: str
) -> Iterator[_Message]:
    """Yield the poses of a robot's reference point."""
    at = every(course.time_s, POSE_PERIOD_S)
    for time_s, pose in _stamped(ros, scene, course, at):
        yield time_s, topic, pose


def _stamped(
    ros: RosTypes, scene: Scene, motion: Motion, at: np.ndarray
) -> Iterator[tuple[float, Any]]:
    """Yield times, and a robot's poses there, at indices of its states."""
    poses = _ros_poses(scene, motion.state[at]).tolist()
    for time_s, pose in zip(motion.time_s[at].tolist(), poses, strict=True):
        header, where = ros.header(time_s), ros.pose(pose[:3], pose[3:])
        yield time_s, ros["geometry_msgs/PoseStamped"](header, where)


def _battery(ros: RosTypes, course: Course, topic: str) -> Iterator[_Message]:
    """Yield the state of charge of a robot."""
    charging, discharging = 1, 2
    unknown = float("nan")
    changes = np.flatnonzero(np.diff(course.charging.astype(int))) + 1
    ticks = np.union1d(every(course.time_s, BATTERY_PERIOD_S), changes)
    for at in ticks.tolist():
        time_s = float(course.time_s[at])
        state = ros.made(
            "sensor_msgs/BatteryState",
            header=ros.header(time_s),
            voltage=unknown,
            temperature=unknown,
            current=unknown,
            charge=unknown,
            capacity=unknown,
            design_capacity=unknown,
            percentage=float(course.charge[at]),
            power_supply_status=charging if course.charging[at] else discharging,
            present=True,
            location=course.robot,
        )
        yield time_s, topic, state


def _ros_poses(scene: Scene, state: np.ndarray) -> np.ndarray:
    """Return poses on the ground: x, y, z and a quaternion x, y, z, w, shape (n, 7)."""
    return ground_poses(scene, state[:, :3])[:, [0, 1, 2, 4, 5, 6, 3]]


FORMAT = Format(suffix=".mcap", files=files)
