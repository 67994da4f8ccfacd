"""Search over one robot's states in space and time, among robots that move as given.

A weighted A* over the robot's own motions (`_motion_kernels`): follow the path, hold,
and hold each of some speeds and steerings; half way it grows greedy. States that share
a cell of position, heading, speed, steering, target and time count as one, as in hybrid
A*: D. Dolgov et al., Practical search techniques in path planning for autonomous
driving, 2008. From time to time it tries to drive home along the shortest curve.
"""

from __future__ import annotations

from math import atan2, pi, sqrt

import numpy as np

from mrmg.compilation import borrowed, inlined, kernel
from mrmg.motion._kernels import copy_numbers
from mrmg.planning.path_following._following_kernels import advance
from mrmg.planning.path_following.coordination._end_kernels import (
    brake,
    braking_steps,
    conflict_cost,
    drive_to,
    end_from,
    is_tried,
    list_near,
    passing_cost,
)
from mrmg.planning.path_following.coordination._motion_kernels import (
    BRAKE,
    HOLD,
    HOME,
    MOVE,
    STAY,
    TRACK,
    VISIT,
    clear,
    move,
)
from mrmg.planning.path_following.coordination._node_kernels import (
    OFF_PATH,
    add,
    cell_of,
    grow_greedy,
    is_new,
    place_of,
)
from mrmg.planning.problem._control_kernels import wrap
from mrmg.planning.problem._target_kernels import at_target
from mrmg.planning.roadmap._heap_kernels import pop, push
from mrmg.world._kernels import multiplier_in

REJOIN_M, REJOIN_ANGLE = 0.4, 0.4
"""Distance [m] and deviation [rad] within which a robot takes to its path again."""

WAYS_ON = 5
"""Ways on from a node beside its motions: to track, hold, stay, visit, end."""

WIDENING_SHARE = 0.25
"""How much later than the motion along the path the others are looked at, as a share
of a motion's time."""


@inlined
def legs_done(targets, task, leg, state, first, last):
    """Return the leg that a robot is on after some states; a stay ends none."""
    for k in range(first, last + 1):
        while (
            leg < len(task.leg)
            and task.stay[leg] == 0
            and at_target(targets, task.leg[leg], state[k])
        ):
            leg += 1
    return leg


@inlined
def rejoined(course, left, state):
    """Return (segment or OFF_PATH, least segment it may rejoin) of a state."""
    i, s = advance(course, left, state[0], state[1])
    for _ in range(2):
        dx = course.node[i + 1].x - course.node[i].x
        dy = course.node[i + 1].y - course.node[i].y
        size = max(sqrt(dx * dx + dy * dy), 1e-9)
        ex, ey = state[0] - course.node[i].x, state[1] - course.node[i].y
        along, off = (ex * dx + ey * dy) / size, (dx * ey - dy * ex) / size
        ahead = atan2(dy, dx) + (0.0 if course.node[i].gear > 0 else pi)
        near = abs(off) < REJOIN_M and -REJOIN_M < along < size + REJOIN_M
        if near and abs(wrap(state[2] - ahead)) < REJOIN_ANGLE:
            return i, i
        last = course.node[i].end
        if last + 1 >= course.size[0] or s < course.node[last].way - REJOIN_M:
            break
        i = last  # from the next stretch on
    return OFF_PATH, left


@inlined
def add_motion(search, nodes, room, a, motion, nears):
    """Add what a motion leads to from node a if it is free and new; return it or -1.

    Args:
        search, nodes, room: the search.
        a, motion: where it begins and what it does.
        nears: robots that may be met.
    """
    task, course, state = search.task, search.course, room.state
    steps = task.steps
    node = nodes.node[a]
    left, first = node.left, node.step
    segment = move(search, motion, node.segment, steps, state, room.control)
    after = state[steps]
    leg = legs_done(search.targets, task, node.leg, state, 1, steps)
    stamp = first + steps if first < search.traffic.end else 0
    key = cell_of(task, after, leg, stamp)
    at = place_of(nodes.table, key)
    if nodes.table[at] == key and motion != TRACK:
        return -1
    if not clear(
        search.own, search.spaces, search.zones, search.traffic, state, steps, first,
        room.corner,
    ):  # fmt: skip
        return -1
    conflict_s = conflict_cost(search, room, nears, first, steps)
    if not conflict_s < np.inf:
        return -1
    nodes.table[at] = key
    if motion == TRACK:
        left = min(segment, course.size[0] - 2)
    elif motion >= MOVE and course.size[0] > 1:
        segment, left = rejoined(course, left, after)
    share = task.hold_share
    if motion != HOLD:
        share = multiplier_in(search.terrain, after[0], after[1])
    cost = node.cost + share * steps * search.dt + conflict_s
    place = (first + steps, leg, segment, left)
    return add(search, nodes, a, motion, after, place, cost)


@kernel
def expand(search, nodes, room, a, begin, end):
    """Add what motions from `begin` to before `end` lead to from node a.

    Returns:
        The node that the last one leads to, or -1.
    """
    search, nodes, room = borrowed((search, nodes, room))
    task, node, last = search.task, nodes.node[a], -1
    copy_numbers(nodes.state[a], room.state[0])
    nears = list_near(search, room, node.step, task.steps)
    for motion in range(begin, end):
        last = add_motion(search, nodes, room, a, motion, nears)
    return last


@kernel
def stay(search, nodes, room, a):
    """Open a stay in the leg's target, if braking from node a ends in it."""
    task, targets, before = search.task, search.targets, nodes.node[a]
    tail = brake(search.own, search.dt, room.state, room.control)
    last = tail + task.stay[before.leg]
    stop, end = braking_steps(search.own, search.dt), before.step + last
    if end + stop >= len(room.control):
        return
    if not at_target(targets, task.leg[before.leg], room.state[tail]):
        return
    for k in range(tail, last):
        copy_numbers(room.state[k], room.state[k + 1])
    leg = before.leg + 1
    if not is_new(nodes.table, cell_of(task, room.state[last], leg, end)):
        return
    conflict_s = passing_cost(search, room, last, before.step)
    if conflict_s < np.inf:
        cost = before.cost + task.hold_share * last * search.dt + conflict_s
        place = (end, leg, before.segment, before.left)
        add(search, nodes, a, STAY, room.state[last], place, cost)


@kernel
def visit(search, nodes, room, a):
    """Open a drive from node a to the pose that the leg's target wants."""
    task, first, leg = search.task, nodes.node[a].step, nodes.node[a].leg
    copy_numbers(nodes.state[a], room.state[0])
    count = drive_to(search, leg, room, room.control)
    last, stop = first + count, braking_steps(search.own, search.dt)
    if count < 0 or last + stop >= len(room.control):
        return
    after = room.state[count]
    if not at_target(search.targets, task.leg[leg], after):
        return
    conflict_s = passing_cost(search, room, count, first)
    leg += 1 if task.stay[leg] == 0 else 0
    if conflict_s < np.inf and is_new(nodes.table, cell_of(task, after, leg, last)):
        segment, left = OFF_PATH, nodes.node[a].left
        if search.course.size[0] > 1:
            segment, left = rejoined(search.course, left, after)
        cost = nodes.node[a].cost + count * search.dt + conflict_s
        add(search, nodes, a, VISIT, after, (last, leg, segment, left), cost)


@kernel
def write_controls(search, nodes, room, a, control):
    """Write the controls that lead to end a; return their number."""
    branch = np.empty(nodes.size[0], np.int64)
    n, b = 0, nodes.node[a].parent
    while b > 0:
        branch[n] = b
        n += 1
        b = nodes.node[b].parent
    for i in range(n - 1, -1, -1):
        b = branch[i]
        p, motion = nodes.node[b].parent, nodes.node[b].motion
        before = nodes.node[p]
        first, steps = before.step, nodes.node[b].step - before.step
        copy_numbers(nodes.state[p], room.state[0])
        if motion == VISIT:
            drive_to(search, before.leg, room, control[first:])
            continue
        held = HOLD if motion == STAY else motion
        move(search, held, before.segment, steps, room.state, control[first:])
    p = nodes.node[a].parent
    first = nodes.node[p].step
    copy_numbers(nodes.state[p], room.state[0])
    if nodes.node[a].motion == BRAKE:
        brake(search.own, search.dt, room.state, control[first:])
    else:
        drive_to(search, len(search.task.leg), room, control[first:])
    return nodes.node[a].step


@kernel
def offer(search, nodes, room, a, tries):
    """Open what ends node a's leg there, or the task; return the tries until now."""
    task, leg = search.task, nodes.node[a].leg
    if leg == len(task.leg):
        end_from(search, nodes, room, a, tries)
        return tries + 1
    if task.stay[leg] > 0:
        copy_numbers(nodes.state[a], room.state[0])
        stay(search, nodes, room, a)
    if search.targets.target[task.leg[leg]].tolerance < pi:
        if is_tried(search, task.leg[leg], nodes.state[a], tries):
            visit(search, nodes, room, a)
        return tries + 1
    return tries


@kernel
def follow_path(search, nodes, room, a, tries):
    """Add the nodes along the path from node a on; return the tries until now.

    All of them are opened for what else leads on from them.
    """
    stop = braking_steps(search.own, search.dt)
    while a >= 0 and nodes.size[0] + WAYS_ON < search.task.most:
        tries = offer(search, nodes, room, a, tries)
        segment, first = nodes.node[a].segment, nodes.node[a].step
        on_path = 0 <= segment < search.course.size[0]
        if not on_path or first + 2 * stop >= len(room.control):
            return tries
        a = expand(search, nodes, room, a, TRACK, HOLD)
    return tries


@kernel
def find_motion(search, nodes, room, begun, control):
    """Find controls for one robot's task; return their number or -1.

    Args:
        search: the robot, its surroundings, its task and the others.
        nodes: empty room for nodes; receives those that were looked at.
        room: for motions as long as `control`.
        begun: its states until the search begins, shape (k + 1, 5).
        control: those until then; receives the others, shape (n, 2), n > k.
    """
    search, nodes, room = borrowed((search, nodes, room))
    task, begun, control = search.task, borrowed(begun), borrowed(control)
    first = len(begun) - 1
    leg = legs_done(search.targets, task, 0, begun, 0, first)
    begin = 0 if search.course.size[0] > 1 else OFF_PATH
    add(search, nodes, -1, HOLD, begun[first], (first, leg, begin, 0), 0.0)
    motions, tries = len(task.motion), 0
    stop = braking_steps(search.own, search.dt)
    while nodes.size[1] > 0 and nodes.size[0] + motions + WAYS_ON < task.most:
        value, number = nodes.key[0], nodes.entry[0]
        nodes.size[1] = pop(nodes.key, nodes.entry, nodes.size[1])
        a, widened = number >> 1, number & 1
        node = nodes.node[a]
        if node.motion <= HOME:
            return write_controls(search, nodes, room, a, control)
        if node.step + 2 * stop >= len(control):
            continue
        if widened == 0:
            tries = follow_path(search, nodes, room, a, tries)
            if 0 <= node.segment < search.course.size[0]:
                later = value + WIDENING_SHARE * task.steps * search.dt
                entry = 2 * a + 1
                nodes.size[1] = push(
                    nodes.key, nodes.entry, nodes.size[1], later, entry
                )
                continue
        copy_numbers(nodes.state[a], room.state[0])
        expand(search, nodes, room, a, HOLD, MOVE + motions)
        if nodes.size[2] < 0:
            grow_greedy(nodes, task.weight, task.most)
    if nodes.size[2] >= 0:  # the best there is, if not good enough to end sooner
        return write_controls(search, nodes, room, nodes.size[2], control)
    return -1
