"""Orders and states of VDA 5050, for fleet managers: versions 2.1.0 and 3.0.0.

Each robot has one order, `vda5050/VERSION/ROBOT/order.json`, whose nodes are its start,
goals, stations, changes of direction and end. The edges carry the planned path as a
trajectory. The states along the drive (or the plan, where nothing was driven) are lines
of `states.jsonl`: one a second, and one whenever a node is reached or left. Actions:
`startCharging` and `stopCharging` at stations, and `visit`, which the standard does not
define, at goals. Orders carry no times: that robots wait for each other is up to the
fleet manager. Time stamps count from 1970-01-01, the start of the mission.
"""

from __future__ import annotations

import json
import math
from collections.abc import Collection, Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np

from mrmg.export.mission import Course, Mission, bends, every
from mrmg.export.route import STANDING_M_S, Node, Route, route_of
from mrmg.export.table import Files, Format
from mrmg.scene.robot_model import RobotModel
from mrmg.scene.types import Goal, Scene
from mrmg.viz.activities import lengths_along

MANUFACTURER = "mrmg"
STATE_PERIOD_S = 1.0

_NAMES = ("order.json", "states.jsonl")
"""Files of a robot."""

_PATH_TOLERANCE_M = 0.02
_FORWARDS, _BACKWARDS = 0.0, math.pi
_DECIMALS = 4
_EPSILON_S = 1e-9
_START = datetime(1970, 1, 1, tzinfo=UTC)

_Json = dict[str, Any]

_NAMES_3 = {
    "nodeDescription": "nodeDescriptor",
    "actionDescription": "actionDescriptor",
    "maxSpeed": "maximumSpeed",
    "agvPosition": "mobileRobotPosition",
    "positionInitialized": "localized",
    "batteryState": "powerSupply",
    "batteryCharge": "stateOfCharge",
    "eStop": "activeEmergencyStop",
}
"""What version 3.0.0 calls keys of 2.1.0."""

_ONLY_2 = ("startNodeId", "endNodeId", "rotationAllowed")
"""Keys that version 3.0.0 does without."""


def files(mission: Mission, versions: tuple[str, ...]) -> Files:
    """Return orders and states of all robots, for each version."""
    written: dict[str, bytes] = {}
    for course in mission.courses:
        route = route_of(mission.scene, mission.plan, course.robot)
        order = _order(mission, course, route)
        states = list(_states(mission, course, route, order))
        for version in versions:
            folder = f"vda5050/{version}/{course.robot}"
            text = json.dumps(_in_version(order, version), indent=1) + "\n"
            lines = [f"{json.dumps(_in_version(state, version))}\n" for state in states]
            contents = (text, "".join(lines))
            for name, content in zip(_NAMES, contents, strict=True):
                written[f"{folder}/{name}"] = content.encode()
    return written


def written_before(folder: Path, versions: tuple[str, ...]) -> Iterator[Path]:
    """Yield the orders and states in a folder that this module has written there."""
    mark = f'"manufacturer": "{MANUFACTURER}"'
    for version in versions:
        for path in folder.glob(f"vda5050/{version}/*/*"):
            own = path.name in _NAMES and path.is_file()
            if own and mark in path.read_text(errors="replace"):
                yield path


def _in_version(message: _Json, version: str) -> _Json:
    """Return a message as a version has it."""
    three = version.startswith("3.")
    stamp = _START + timedelta(seconds=message["timestamp"])
    text = stamp.strftime("%Y-%m-%dT%H:%M:%S.%f")[: -3 if three else -4]
    changed = {**message, "version": version, "timestamp": f"{text}Z"}
    return _renamed({**changed, "instantActionStates": []}) if three else changed


def _renamed(value: Any) -> Any:
    """Return a part of a message of version 2.1.0 as version 3.0.0 has it."""
    if isinstance(value, list):
        return [_renamed(item) for item in value]
    if not isinstance(value, dict):
        return value
    renamed = {
        _NAMES_3.get(key, key): _renamed(item)
        for key, item in value.items()
        if key not in _ONLY_2
    }
    if "allowedDeviationXY" in renamed:
        radius_m = renamed["allowedDeviationXY"]
        renamed["allowedDeviationXY"] = {"a": radius_m, "b": radius_m, "theta": 0.0}
    return renamed


def _header(course: Course, number: int, time_s: float) -> _Json:
    return {
        "headerId": number,
        "timestamp": time_s,
        "version": "",
        "manufacturer": MANUFACTURER,
        "serialNumber": course.robot,
    }


def _order(mission: Mission, course: Course, route: Route) -> _Json:
    """Return the order of a robot, all of which is released."""
    plan, model = mission.plan, mission.scene.robot(course.robot).model
    nodes = [
        _node(mission.scene, route, number, node)
        for number, node in enumerate(route.nodes)
    ]
    return {
        **_header(course, 0, 0.0),
        "orderId": f"{plan.scene_name}-{plan.digest[:8]}-{course.robot}",
        "orderUpdateId": 0,
        "nodes": nodes,
        "edges": [
            _edge(model, 2 * number + 1, *edge)
            for number, edge in enumerate(route.edges())
        ],
    }


def _node(scene: Scene, route: Route, number: int, node: Node) -> _Json:
    x_m, y_m, heading = route.trajectory.state[node.step, :3].tolist()
    return {
        "nodeId": node.id,
        "sequenceId": 2 * number,
        "nodeDescription": ", ".join(f"{one.kind} {one.id}" for one in node.targets),
        "released": True,
        "nodePosition": {
            "x": _rounded(x_m),
            "y": _rounded(y_m),
            "theta": _angle(heading),
            "allowedDeviationXY": _rounded(node.deviation_m),
            "mapId": scene.name,
        },
        "actions": _actions(node),
    }


def _edge(
    model: RobotModel, sequence: int, start: Node, end: Node, states: np.ndarray
) -> _Json:
    """Return an edge that a robot drives along a path, forwards or backwards."""
    speed_m_s = states[:, 3]
    backwards = speed_m_s.sum() < 0.0
    corners = states[bends(states[:, :2], _PATH_TOLERANCE_M), :2]
    lengths_m = np.hypot(*np.diff(corners, axis=0).T)
    knots = np.cumsum(lengths_m) / max(lengths_m.sum(), 1e-9)
    return {
        "edgeId": f"{start.id}_{end.id}",
        "sequenceId": sequence,
        "released": True,
        "startNodeId": start.id,
        "endNodeId": end.id,
        "maxSpeed": _rounded(np.abs(speed_m_s).max()),
        "orientation": _BACKWARDS if backwards else _FORWARDS,
        "orientationType": "TANGENTIAL",
        "rotationAllowed": model.motion_model != "car",
        "length": _rounded(lengths_m.sum()),
        "trajectory": {
            "degree": 1,
            "knotVector": [0.0, 0.0, *knots[:-1].tolist(), 1.0, 1.0],
            "controlPoints": [
                {"x": _rounded(x_m), "y": _rounded(y_m)} for x_m, y_m in corners
            ],
        },
        "actions": [],
    }


def _actions(node: Node) -> list[_Json]:
    """Return what a robot does at a node."""
    actions: list[_Json] = []
    for target in node.targets:
        is_goal = isinstance(target, Goal)
        parameters = [
            {"key": f"{target.kind}Id", "value": target.id},
            {"key": "dwell", "value": target.dwell_s},
        ]
        passing = is_goal and target.dwell_s == 0.0
        for kind in ("visit",) if is_goal else ("startCharging", "stopCharging"):
            actions.append(
                {
                    "actionId": f"{node.id}-{kind}-{target.id}",
                    "actionType": kind,
                    "actionDescription": f"{kind} at {target.kind} {target.id}",
                    "blockingType": "NONE" if passing else "HARD",
                    "actionParameters": parameters,
                }
            )
    return actions


def _states(
    mission: Mission, course: Course, route: Route, order: _Json
) -> Iterator[_Json]:
    """Yield the states: one a second, and one whenever a node is reached or left."""
    plan_s = mission.time_s if mission.log is None else mission.log.clock_s
    leave_s = np.array([node.leave_s for node in route.nodes])
    reached = np.searchsorted(plan_s, route.reached_s - _EPSILON_S)
    left = np.searchsorted(plan_s, leave_s - _EPSILON_S)
    way_m = lengths_along(course.state)
    visited = {visit.target for visit in course.visits}
    ticks = {*every(course.time_s, STATE_PERIOD_S), *reached, *left} - {len(plan_s)}
    for number, tick in enumerate(sorted(int(tick) for tick in ticks)):
        last = int(np.searchsorted(reached, tick, "right")) - 1
        nodes, edges = order["nodes"], order["edges"]
        yield {
            **_header(course, number, float(course.time_s[tick])),
            "orderId": order["orderId"],
            "orderUpdateId": order["orderUpdateId"],
            "lastNodeId": nodes[last]["nodeId"],
            "lastNodeSequenceId": nodes[last]["sequenceId"],
            "nodeStates": [_part(node, "nodeId") for node in nodes[last + 1 :]],
            "edgeStates": [_part(edge, "edgeId") for edge in edges[last:]],
            "actionStates": [
                _action_state(action, tick >= at, tick >= gone, visited)
                for node, at, gone in zip(nodes, reached, left, strict=True)
                for action in node["actions"]
            ],
            "distanceSinceLastNode": _rounded(way_m[tick] - way_m[reached[last]]),
            **_condition(mission, course, tick),
        }


def _part(element: _Json, name: str) -> _Json:
    """Return what a state contains of a node or edge that is still to be traversed."""
    return {key: element[key] for key in (name, "sequenceId", "released")}


def _action_state(
    action: _Json, arrived: bool, gone: bool, visited: Collection[str]
) -> _Json:
    """Return how far an action is.

    Args:
        action: of the order.
        arrived: whether the robot has reached the node.
        gone: whether it has left it.
        visited: targets that it visits in all of the mission.
    """
    kind, target = action["actionType"], action["actionParameters"][0]["value"]
    if kind == "visit":
        ended = "FINISHED" if target in visited else "FAILED"
        status = ended if gone else "RUNNING"
    else:
        status = "FINISHED" if gone or kind == "startCharging" else "WAITING"
    return {
        "actionId": action["actionId"],
        "actionType": kind,
        "actionStatus": status if arrived else "WAITING",
    }


def _condition(mission: Mission, course: Course, tick: int) -> _Json:
    """Return where a robot is, how it moves, and how it is."""
    x_m, y_m, heading, speed_m_s = course.state[tick, :4].tolist()
    turning = float(course.turning_rad_s[tick])
    broken = course.broken_s is not None and course.time_s[tick] >= course.broken_s
    error = {"errorType": "breakdown", "errorLevel": "FATAL"}
    return {
        "driving": max(abs(speed_m_s), abs(turning)) >= STANDING_M_S,
        "operatingMode": "AUTOMATIC",
        "agvPosition": {
            "x": _rounded(x_m),
            "y": _rounded(y_m),
            "theta": _angle(heading),
            "mapId": mission.scene.name,
            "positionInitialized": True,
        },
        "velocity": {"vx": _rounded(speed_m_s), "vy": 0.0, "omega": _rounded(turning)},
        "batteryState": {
            "batteryCharge": _rounded(100.0 * course.charge[tick]),
            "charging": bool(course.charging[tick]),
        },
        "errors": [error] if broken else [],
        "safetyState": {"eStop": "NONE", "fieldViolation": False},
    }


def _angle(angle_rad: float) -> float:
    """Return an angle in -pi..pi."""
    return _rounded(math.remainder(angle_rad, math.tau))


def _rounded(value: float) -> float:
    return round(float(value), _DECIMALS) + 0.0


FORMAT = Format(versions=("2.1.0", "3.0.0"), files=files, written_before=written_before)
