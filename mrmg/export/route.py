"""The planned way of a robot as a graph: nodes it passes, and edges between them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mrmg.energy.visits import is_at, runs
from mrmg.plans import Plan, Trajectory, Visit
from mrmg.scene.types import Goal, Scene, Station

STANDING_M_S = 0.02
"""Speed below which a robot stands."""

DEVIATION_M = 0.1
"""How far from a node a robot may pass it, if that is within the target's region."""

SAME_PLACE_M = 0.01
"""Length of a path below which its ends are one node."""


@dataclass(frozen=True, kw_only=True)
class Node:
    """A place that a robot passes or stays at.

    Attributes:
        step: index of the planned state in which it gets there.
        leave_s: until when it stays, by the plan.
        deviation_m: how far from it the robot may pass.
        targets: goals and stations that it visits there.
        id: unique in all routes of a plan; "" until all nodes of its route are known.
    """

    step: int
    leave_s: float = 0.0
    deviation_m: float = DEVIATION_M
    targets: tuple[Goal | Station, ...] = ()
    id: str = ""


@dataclass(frozen=True, kw_only=True)
class Route:
    """What a robot is to drive.

    Attributes:
        trajectory: the planned motion.
        nodes: in order; between two of them the robot drives in one direction.
    """

    trajectory: Trajectory
    nodes: tuple[Node, ...]

    @property
    def reached_s(self) -> np.ndarray:
        """When each node is reached by the plan, shape (k,)."""
        steps = [node.step for node in self.nodes]
        return np.asarray(self.trajectory.time_s[steps])

    def edges(self) -> Iterator[tuple[Node, Node, np.ndarray]]:
        """Yield start, end and planned states of every edge."""
        for start, end in zip(self.nodes, self.nodes[1:], strict=False):
            yield start, end, self.trajectory.state[start.step : end.step + 1]


def route_of(scene: Scene, plan: Plan, robot: str) -> Route:
    """Return the route of a robot: start, targets, changes of direction and end."""
    trajectory = plan.trajectory(robot)
    targets = {target.id: target for target in scene.targets()}
    ends = (0, len(trajectory.state) - 1)
    found = [
        *(Node(step=step) for step in (*ends, *_reversals(trajectory.state[:, 3]))),
        *(
            _visited(trajectory, visit, targets[visit.target])
            for visit in plan.visits
            if visit.robot == robot
        ),
    ]
    nodes = _joined(trajectory, sorted(found, key=lambda node: node.step))
    return Route(trajectory=trajectory, nodes=tuple(_named(robot, nodes)))


def _visited(trajectory: Trajectory, visit: Visit, target: Goal | Station) -> Node:
    """Return the node of a visit: where it stands or is deepest in the region."""
    states = trajectory.state[visit.step :]
    away = ~is_at(target, states)
    states = states[: int(away.argmax()) if away.any() else len(states)]
    depth_m = target.region.depth(states[:, :2])
    deepest = int(depth_m.argmax())
    standing = runs(np.abs(states[:, 3]) < STANDING_M_S)
    at, left = standing[0] if standing else (deepest, deepest)
    leave_s = float(trajectory.time_s[visit.step + min(left, len(states) - 1)])
    return Node(
        step=visit.step + at,
        leave_s=max(leave_s, visit.time_s + target.dwell_s),
        deviation_m=min(DEVIATION_M, float(depth_m[at])),
        targets=(target,),
    )


def _reversals(speed_m_s: np.ndarray) -> np.ndarray:
    """Return the steps from which a robot drives in the other direction."""
    moving = np.flatnonzero(np.abs(speed_m_s) >= STANDING_M_S)
    forward = speed_m_s[moving] > 0.0
    return np.asarray(moving[1:][forward[1:] != forward[:-1]])


def _joined(trajectory: Trajectory, nodes: Sequence[Node]) -> list[Node]:
    """Return nodes at different places: those at one place are joined."""
    steps_m = np.hypot(*np.diff(trajectory.state[:, :2], axis=0).T)
    way_m = np.concatenate([[0.0], np.cumsum(steps_m)])
    joined = [nodes[0]]
    for node in nodes[1:]:
        before = joined[-1]
        if way_m[node.step] - way_m[before.step] >= SAME_PLACE_M:
            joined.append(node)
            continue
        joined[-1] = replace(
            before,
            leave_s=max(before.leave_s, node.leave_s),
            deviation_m=min(before.deviation_m, node.deviation_m),
            targets=before.targets + node.targets,
        )
    return joined


def _named(robot: str, nodes: Sequence[Node]) -> Iterator[Node]:
    """Yield the nodes with ids of their own: goals keep theirs, being visited once."""
    for number, node in enumerate(nodes):
        names = [target.id for target in node.targets]
        if len(names) == 1 and isinstance(node.targets[0], Goal):
            yield replace(node, id=names[0])
        else:
            yield replace(node, id="-".join([robot, str(number), *names]))
