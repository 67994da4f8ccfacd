"""Nodes of the search for one robot's motion: what they hold and count as."""

from __future__ import annotations

from math import ceil, floor, hypot, pi
from typing import NamedTuple

import numpy as np

from mrmg.compilation import inlined, kernel, record_type
from mrmg.motion._kernels import CAR, copy_numbers
from mrmg.planning.path_following._following_kernels import Course, advance
from mrmg.planning.path_following.coordination._guide_kernels import (
    Guide,
    guide_at,
    turning_at,
)
from mrmg.planning.path_following.coordination._motion_kernels import (
    TRACK,
    Traffic,
)
from mrmg.planning.path_following.coordination._reeds_shepp_kernels import (
    MOST_PIECES,
    reeds_shepp,
)
from mrmg.planning.problem._control_kernels import wrap
from mrmg.planning.problem._region_kernels import Zones
from mrmg.planning.problem._target_kernels import Targets
from mrmg.planning.roadmap._fleet_kernels import Spaces
from mrmg.planning.roadmap._heap_kernels import push
from mrmg.world._kernels import TerrainGrid

OFF_PATH = -1
"""Segment of a robot that is not on its path."""

CURVE_SHARE = 1.05
"""Radius of the curves that costs-to-go are reckoned with, over the least one."""

TURNING_SHARE = 0.4
"""Share of the costs-to-go of turning that counts: robots turn as they drive, too, and
other robots may be led round that way."""

GREEDY_SHARE, GREED = 0.5, 3.0
"""Share of a search's nodes after which, if none of them is an end, costs-to-go weigh
so many times as much: in dense yards, where most searches that fail would have found
a motion with some times as many nodes, that saves a quarter of the time."""

SIDEWAYS = 2.0
"""Metres of way that a metre off the path counts as."""


class Task(NamedTuple):
    """What one robot is to do, and how it is searched for.

    Attributes:
        leg: targets to visit, in order, shape (L,).
        pose: (x, y, yaw) that the robot drives to there, and at its finish, (L + 1, 3).
        stay: steps to stand in each of them, shape (L,).
        along: way along the path to each of them [m]; inf where it leads to none, (L,).
        rest_s: time from the end of the path on.
        later_s: cost of stays from each leg on, shape (L + 1,).
        finish: target to end in, or -1.
        home_along: whether the path leads to the finish.
        guide: costs-to-go on each leg.
        motion: (v, w) of each MOVE, shape (P, 2).
        steps: that a motion lasts.
        preview: how far ahead a custom motion model looks along its path [m].
        resolution: sides of cells: position [m], heading [rad], speed [m/s], steering.
        weight: of the cost-to-go: a plan takes at most so many times the least cost,
            unless the search has grown greedy.
        hold_share: cost of a second of standing, of moving it is 1.
        soft_s: cost of a conflict with a robot of lower priority [s].
        most: nodes at most.
    """

    leg: np.ndarray
    pose: np.ndarray
    stay: np.ndarray
    along: np.ndarray
    rest_s: float
    later_s: np.ndarray
    finish: int
    home_along: bool
    guide: Guide
    motion: np.ndarray
    steps: int
    preview: float
    resolution: np.ndarray
    weight: float
    hold_share: float
    soft_s: float
    most: int


class Setting(NamedTuple):
    """One robot's search.

    Attributes:
        own: the robot, shape (1,).
        spaces, terrain, targets, zones: its surroundings.
        course: its path, which may be empty.
        traffic: how the others move.
        task: what it is to do.
        dt: step [s].
    """

    own: np.ndarray
    spaces: Spaces
    terrain: TerrainGrid
    targets: Targets
    zones: Zones
    course: Course
    traffic: Traffic
    task: Task
    dt: float


NODE = record_type(
    [
        ("parent", np.int64),
        ("motion", np.int64),  # that led to it
        ("step", np.int64),  # that it is at
        ("leg", np.int64),  # that the robot is on
        ("segment", np.int64),  # of its path; OFF_PATH, or the nodes' number at its end
        ("left", np.int64),  # last segment that it was on
        ("cost", np.float64),  # what it took [s]
    ]
)
"""A node of a search."""


class Nodes(NamedTuple):
    """Nodes of a search, and what led to each.

    Attributes:
        state: shape (N, 5).
        node: `NODE`, shape (N,).
        key, entry: heap of open nodes; entries are 2 a, and 2 a + 1 for a node of which
            only the way along the path has been looked at.
        table: cells that have been reached.
        size: number of nodes, of open ones, and the cheapest end or -1, shape (3,).
        weight: of the cost-to-go, shape (1,).
    """

    state: np.ndarray
    node: np.ndarray
    key: np.ndarray
    entry: np.ndarray
    table: np.ndarray
    size: np.ndarray
    weight: np.ndarray


class Scratch(NamedTuple):
    """Room for one motion: states, controls, two footprints, near robots, a curve."""

    state: np.ndarray
    control: np.ndarray
    corner: np.ndarray
    near: np.ndarray
    curve: Course


@inlined
def cell_of(task, state, leg, step):
    """Return the number of the cell that a state lies in; `step` 0 leaves out time."""
    key = np.int64(floor(state[0] / task.resolution[0])) & 0x3FFF
    key = key << 14 | np.int64(floor(state[1] / task.resolution[0])) & 0x3FFF
    turns = int(ceil(2.0 * pi / task.resolution[1]))
    key = key << 6 | np.int64(round(wrap(state[2]) / (2.0 * pi) * turns)) % turns & 0x3F
    key = key << 4 | np.int64(round(state[3] / task.resolution[2])) & 0xF
    key = key << 4 | np.int64(round(state[4] / task.resolution[3])) & 0xF
    key = key << 8 | leg & 0xFF
    return key << 13 | step // task.steps & 0x1FFF


@inlined
def place_of(table, key):
    """Return the place of a key in a table of 2^n places, or the one it would have."""
    mask = len(table) - 1
    at = (key ^ (key >> 29)) * 0x9E3779B1
    at = (at ^ (at >> 17)) & mask
    while table[at] != -1 and table[at] != key:
        at = (at + 1) & mask
    return at


@kernel
def is_new(table, key):
    """Enter a key into a table of 2^n places; return whether it was not in it."""
    at = place_of(table, key)
    if table[at] == key:
        return False
    table[at] = key
    return True


@inlined
def cost_to_go_s(search, place, state):
    """Return an estimate of the time from a state to the end of the task [s].

    Args:
        search: the search.
        place: (step, leg, segment, last segment) that it is at.
        state: its state.
    """
    own, task = search.own, search.task
    step_number, leg, segment, left = place
    legs = len(task.leg)
    on_path = task.home_along if leg == legs else task.along[leg] < np.inf
    x, y = state[0], state[1]
    target = task.leg[leg] if leg < legs else task.finish
    time_s = guide_at(task.guide, leg, step_number, x, y)
    if on_path and segment < search.course.size[0]:
        time_s = along_path_s(search, leg, left, state)
    elif target >= 0:
        posed = search.targets.target[target].tolerance < pi
        if len(task.guide.turning) > 0:
            time_s += TURNING_SHARE * turning_at(task.guide, leg, state)
        elif posed and own[0].model == CAR:
            posed_s = posing_time_s(own, search.targets, target, x, y, state[2])
            if leg < legs:
                center = search.targets.target[target].center
                posed_s += guide_at(
                    task.guide, leg + 1, step_number, center[0], center[1]
                )
            time_s = max(time_s, posed_s)
        elif posed:
            time_s += posing_time_s(own, search.targets, target, x, y, state[2])
    return time_s + task.later_s[leg]


@kernel
def posing_time_s(own, targets, target, x, y, theta):
    """Return the time from a pose to a target's heading there, without obstacles [s].

    Of a car that is the time along the shortest curve, as if it could reverse; of
    robots that can turn on the spot, that of the turn alone.
    """
    aim = targets.target[target]
    if own[0].model == CAR:
        turn, length = np.empty(MOST_PIECES), np.empty(MOST_PIECES)
        dx, dy = aim.center[0] - x, aim.center[1] - y
        radius = CURVE_SHARE * own[0].turning_radius
        curve = reeds_shepp(dx, dy, theta, aim.heading, radius, True, turn, length)
        return max(0.0, curve - aim.reach) / own[0].limit[1] if curve < np.inf else 0.0
    off = abs(wrap(aim.heading - theta)) - aim.tolerance
    return max(0.0, off) / own[0].limit[2]


@kernel
def along_path_s(search, leg, left, state):
    """Return the time to the end of the task along the path [s]."""
    course, task = search.course, search.task
    i, s = advance(course, left, state[0], state[1])
    size = course.node[i + 1].way - course.node[i].way
    t = min(1.0, max(0.0, (s - course.node[i].way) / max(size, 1e-9)))
    px = (1.0 - t) * course.node[i].x + t * course.node[i + 1].x
    py = (1.0 - t) * course.node[i].y + t * course.node[i + 1].y
    rest_s = (1.0 - t) * course.node[i].rest_s + t * course.node[i + 1].rest_s
    way = SIDEWAYS * hypot(state[0] - px, state[1] - py)
    if leg < len(task.leg):
        way += 2.0 * max(0.0, course.node[i].way + t * size - task.along[leg])
    return rest_s + way / search.own[0].limit[1] + task.rest_s


@inlined
def add(search, nodes, a, motion, state, place, cost):
    """Add a node and open it, if its cost-to-go is finite; return it or -1.

    One that is reached along the path is opened for all other motions only: the way
    along the path goes on at once.

    Args:
        search: the search.
        nodes: receive it.
        a: the node before it.
        motion: that leads to it.
        state: the robot's.
        place: (step, leg, segment, last segment).
        cost: what it took [s].
    """
    step_number, leg, segment, left = place
    b = nodes.size[0]
    rest_s = cost_to_go_s(search, place, state)
    if not rest_s < np.inf:
        return -1
    nodes.size[0] = b + 1
    copy_numbers(state, nodes.state[b])
    node = nodes.node[b]
    node.parent, node.motion, node.step, node.leg = a, motion, step_number, leg
    node.segment, node.left, node.cost = segment, left, cost
    value = cost + nodes.weight[0] * rest_s
    entry = 2 * b + (1 if motion == TRACK else 0)
    nodes.size[1] = push(nodes.key, nodes.entry, nodes.size[1], value, entry)
    return b


@kernel
def grow_greedy(nodes, weight, most):
    """Let costs-to-go weigh GREED times as much if it is time for it.

    Args:
        nodes: none of which is an end; the open ones are put into their new order.
        weight: of the costs-to-go until then.
        most: nodes of the search at most.
    """
    if nodes.weight[0] > weight or nodes.size[0] < GREEDY_SHARE * most:
        return
    nodes.weight[0] = GREED * weight
    for i in range(nodes.size[1]):
        cost = nodes.node[nodes.entry[i] >> 1].cost
        value = cost + GREED * (nodes.key[i] - cost)
        push(nodes.key, nodes.entry, i, value, nodes.entry[i])
