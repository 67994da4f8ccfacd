"""How a robot drives to a pose, whom it meets on its way, and where it may stay."""

from __future__ import annotations

from math import cos, pi, sin

import numpy as np

from mrmg.compilation import borrowed, inlined, kernel
from mrmg.motion._kernels import CAR, USER, copy_numbers, steer_user, step
from mrmg.planning.path_following.coordination._conflict_kernels import (
    first_conflict,
    standing_cost,
)
from mrmg.planning.path_following.coordination._motion_kernels import (
    BRAKE,
    HOME,
    clear,
    drivable_radius,
    drive_curve,
    write_curve,
)
from mrmg.planning.problem._control_kernels import braking_control, stands, wrap
from mrmg.planning.problem._target_kernels import at_target
from mrmg.planning.roadmap._heap_kernels import push
from mrmg.world._polygon_kernels import point_distance

ROOM_STEPS = 300
"""Steps that are left for braking at least."""

HOME_STEPS = 4000
"""Steps that driving home may take."""

CREEPING_SHARE = 1e-3
"""Share of its top speed with which a custom motion model turns at its finish."""

LEAST_NEARNESS = 0.2
"""Share of the cost of a conflict that it costs in any case."""


@kernel
def braking_steps(own, dt):
    """Return steps within which a robot comes to rest from any speed."""
    limit = own[0].limit
    stop_s = max(limit[1], -limit[0]) / limit[3]
    if own[0].model != CAR:
        stop_s = max(stop_s, limit[2] / limit[4])
    return max(ROOM_STEPS, int(stop_s / dt) + 2)


@kernel
def brake(own, dt, state, control):
    """Write the braking from state[0] until the robot stands; return the steps."""
    k, most = 0, braking_steps(own, dt)
    while k < most and not stands(own, 0, state[k]):
        u1, u2 = braking_control(own, 0, state[k], dt)
        control[k, 0], control[k, 1] = u1, u2
        step(own[0], state[k], u1, u2, dt, state[k + 1])
        k += 1
    return k


@kernel
def steer_to(search, target, state, control):
    """Write a drive of a custom motion model to a target; return the steps, or -1.

    It is steered to the target's middle, then slowly at a point that lies in the
    direction of its heading.
    """
    own, targets, dt = search.own, search.targets, search.dt
    aim = targets.target[target]
    center, heading, near = aim.center, aim.heading, 0.5 * aim.reach
    arrived = False
    for k in range(min(HOME_STEPS, len(control) - braking_steps(own, dt))):
        here = state[k]
        gap = point_distance(here[0], here[1], center[0], center[1])
        arrived = gap < (2.0 * near if arrived else near)
        if arrived and at_target(targets, target, here):
            return k + brake(own, dt, state[k:], control[k:])
        share, wx, wy = 1.0, center[0], center[1]
        if arrived:
            share = CREEPING_SHARE
            wx, wy = here[0] + cos(heading), here[1] + sin(heading)
        u1, u2 = steer_user(own[0], here, wx, wy, share, dt)
        control[k, 0], control[k, 1] = u1, u2
        step(own[0], here, u1, u2, dt, state[k + 1])
    return -1


@kernel
def drive_to(search, leg, room, control):
    """Write a drive to where a leg ends, without others; return the steps, or -1.

    A car drives along the shortest curve, a robot that turns on the spot straight.
    """
    own, targets, task = search.own, search.targets, search.task
    target = task.leg[leg] if leg < len(task.leg) else task.finish
    course, state = room.curve, room.state
    if own[0].model == USER:
        return steer_to(search, target, state, control)
    x, y, heading = task.pose[leg]
    free = targets.target[target].tolerance >= pi
    tolerance = np.inf if free else targets.target[target].tolerance
    radius = 0.0
    if own[0].model == CAR:
        radius = drivable_radius(own[0])
        if free:
            heading = np.arctan2(y - state[0, 1], x - state[0, 0])
            if abs(wrap(heading - state[0, 2])) > 0.5 * pi:
                heading = wrap(heading + pi)
    total = write_curve(own, state[0], x, y, heading, tolerance, course, radius)
    if not total < np.inf:
        return -1
    return drive_curve(search, course, state, control)


@inlined
def list_near(search, room, first, steps):
    """Write which robots may be met within some steps; return their number.

    Args:
        search: gives the robot and the others.
        room: its first state is where the robot is; receives the numbers.
        first: step that it is at.
        steps: number of the steps.
    """
    own, traffic, state = search.own, search.traffic, room.state[0]
    count = 0
    for other in range(len(traffic.robot)):
        if not (traffic.robot[other].hard or traffic.robot[other].soft):
            continue
        j = min(first, traffic.robot[other].last)
        middle = traffic.middle[other, j]
        apart = point_distance(state[0], state[1], middle[0], middle[1])
        reach = 2.0 * own[0].radius + traffic.fleet[other].radius
        reach += max(own[0].spacing, traffic.fleet[other].spacing)
        if apart < reach + (steps + 1) * traffic.robot[other].closing:
            room.near[count] = other
            count += 1
    return count


@inlined
def conflict_cost(search, room, nears, first, steps):
    """Return the cost of conflicts with others in some steps [s]; inf if forbidden.

    The nearer the robots' middles come to each other, the more it costs, so that robots
    make room even where they cannot make enough.
    """
    traffic = search.traffic
    cost = 0.0
    for i in range(nears):
        other = room.near[i]
        conflict = first_conflict(
            search.own, traffic, other, room.state, steps, first, room.corner
        )
        if conflict < 0:
            continue
        if traffic.robot[other].hard:
            return np.inf
        reach = search.own[0].radius + traffic.fleet[other].radius
        apart = reach
        for k in range(conflict, min(steps, conflict + search.task.steps) + 1):
            j = min(first + k, traffic.robot[other].last)
            pose, middle = room.state[k], traffic.middle[other, j]
            gap = point_distance(pose[0], pose[1], middle[0], middle[1])
            apart = min(apart, gap)
        cost += search.task.soft_s * max(LEAST_NEARNESS, 1.0 - apart / reach)
    return cost


@kernel
def passing_cost(search, room, count, first):
    """Return what passing through states 1 to `count` costs [s]; inf if it must not be.

    That is the cost of conflicts, beside the time it takes.
    """
    search, room = borrowed((search, room))
    if not clear(
        search.own, search.spaces, search.zones, search.traffic, room.state, count,
        first, room.corner,
    ):  # fmt: skip
        return np.inf
    nears = list_near(search, room, first, count)
    return conflict_cost(search, room, nears, first, count)


@kernel
def add_end(search, nodes, room, a, motion, count):
    """Open an end of the task: through states 1 to `count` after node a, and to stay.

    Returns whether it may be.
    """
    first, finish = nodes.node[a].step, search.task.finish
    last = room.state[count]
    if count < 0 or (finish >= 0 and not at_target(search.targets, finish, last)):
        return False
    conflict_s = passing_cost(search, room, count, first)
    conflict_s += standing_cost(
        search.own, search.traffic, last, first + count, search.task.soft_s, room.corner
    )
    if not conflict_s < np.inf:
        return False
    b = nodes.size[0]
    nodes.size[0] = b + 1
    cost = nodes.node[a].cost + count * search.dt + conflict_s
    end = nodes.node[b]
    end.parent, end.motion, end.step, end.cost = a, motion, first + count, cost
    nodes.size[1] = push(nodes.key, nodes.entry, nodes.size[1], cost, 2 * b)
    if nodes.size[2] < 0 or cost < nodes.node[nodes.size[2]].cost:
        nodes.size[2] = b
    return True


@kernel
def is_tried(search, target, state, tries):
    """Return whether to drive to a target from a state: from afar more rarely."""
    center = search.targets.target[target].center
    far = point_distance(state[0], state[1], center[0], center[1])
    return tries % (1 + int(0.2 * far / max(search.own[0].radius, 0.1))) == 0


@kernel
def end_from(search, nodes, room, a, tries):
    """Open the ends of the task that node a leads to: to brake, or to drive home."""
    copy_numbers(nodes.state[a], room.state[0])
    count = brake(search.own, search.dt, room.state, room.control)
    if add_end(search, nodes, room, a, BRAKE, count):
        return
    finish = search.task.finish
    if finish >= 0 and is_tried(search, finish, room.state[0], tries):
        count = drive_to(search, len(search.task.leg), room, room.control)
        add_end(search, nodes, room, a, HOME, count)
