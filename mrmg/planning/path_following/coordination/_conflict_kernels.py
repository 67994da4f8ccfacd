"""Where motions of robots meet."""

from __future__ import annotations

from math import cos, sin

import numpy as np

from mrmg.compilation import inlined, kernel
from mrmg.planning.problem._region_kernels import in_region
from mrmg.planning.roadmap._fleet_kernels import MOST_CORNERS, middle_at
from mrmg.world._polygon_kernels import (
    convex_distance,
    pass_apart,
    place_footprint,
    place_turned,
    point_distance,
)


@inlined
def first_conflict(own, traffic, other, state, count, first, corner):
    """Return the first of some states in which two robots are too near, or -1.

    Where their margin is less than what they may come nearer to each other in half a
    step, that is also the state after a step in the course of which they meet.

    Args:
        own: the robot that moves, shape (1,).
        traffic: the other robots.
        other: one of them.
        state: states 1 to `count` are looked at; the last one lasts, shape (n, 5).
        count: number of the last one.
        first: step of state 0.
        corner: room for two footprints, shape (2, M, 2).
    """
    n, m = own[0].corners, traffic.fleet[other].corners
    mine, theirs = own[0].corner[:n], traffic.fleet[other].corner[:m]
    margin = max(own[0].spacing, traffic.fleet[other].spacing)
    closing = traffic.robot[other].closing
    narrow = margin < 0.5 * closing  # they may meet between steps and be apart at both
    enough = margin + closing if narrow else margin
    reach = own[0].radius + traffic.fleet[other].radius + enough
    last, their_last = len(state) - 1, traffic.robot[other].last
    k = 0 if narrow else 1
    while k <= count:
        j = min(max(first + k, 0), their_last)
        pose, its = state[min(k, last)], traffic.pose[other, j]
        x, y = middle_at(own[0], pose)
        middle = traffic.middle[other, j]
        apart = point_distance(x, y, middle[0], middle[1])
        if apart >= reach:  # until they may have come near to each other
            k += max(1, int((apart - reach) / closing))
            continue
        place_footprint(mine, pose[0], pose[1], pose[2], corner[0, :n])
        place_turned(theirs, its[0], its[1], its[3], its[4], corner[1, :m])
        distance = convex_distance(corner[0, :n], corner[1, :m], enough)
        if distance < margin and k > 0:
            return k
        if narrow and distance < enough and k < count:
            next_pose = state[min(k + 1, last)]
            its_next = traffic.pose[other, min(max(first + k + 1, 0), their_last)]
            if not pass_apart(
                mine, theirs, pose, next_pose, its, its_next, distance, corner
            ):
                return k + 1
        k += 1
    return -1


@kernel
def standing_cost(own, traffic, state, first, soft_s, corner):
    """Return what it costs others that a robot stands from step `first` on [s].

    Args:
        own: the robot, shape (1,).
        traffic: the others.
        state: in which it stands.
        first: step.
        soft_s: for each one that runs into it; inf if that one has priority.
        corner: room for two footprints, shape (2, M, 2).
    """
    still, cost = state.reshape(1, 5), 0.0
    for other in range(len(traffic.robot)):
        robot = traffic.robot[other]
        if not (robot.hard or robot.soft):
            continue
        count = max(1, robot.last - first + 1)
        if first_conflict(own, traffic, other, still, count, first - 1, corner) >= 0:
            if robot.hard:
                return np.inf
            cost += soft_s
    return cost


@kernel
def note_motion(fleet, zones, traffic, inside, r, count):
    """Note middles and zones of robot r's first states in the traffic.

    Args:
        fleet, zones: robots and mutual-exclusion zones.
        traffic: of all robots; `pose` of robot r is new.
        inside: receives which zones it is in, shape (R, G, K).
        r: robot.
        count: number of its states.
    """
    traffic.robot[r].last = count - 1
    for k in range(inside.shape[2]):
        pose = traffic.pose[r, min(k, count - 1)]
        if k < count:
            traffic.middle[r, k, 0], traffic.middle[r, k, 1] = middle_at(fleet[r], pose)
            pose[3], pose[4] = cos(pose[2]), sin(pose[2])
        for zone in range(len(zones.zone)):
            inside[r, zone, k] = in_region(
                zones.zone[zone], zones.corner[zone], pose[0], pose[1]
            )


@kernel
def conflicts_of(fleet, traffic, inside, r, conflict):
    """Write the step of robot r's first conflict with each other one, inf for never.

    Args:
        fleet: the robots.
        traffic: their motions; `closing` is robot r's.
        inside: which zones they are in, shape (R, G, K).
        r: robot.
        conflict: receives the steps, shape (R,).
    """
    corner = np.empty((2, MOST_CORNERS, 2))
    own = traffic.pose[r, : traffic.robot[r].last + 1]
    for other in range(len(fleet)):
        conflict[other] = np.inf
        if other == r:
            continue
        count = max(traffic.robot[r].last, traffic.robot[other].last)
        k = first_conflict(fleet[r : r + 1], traffic, other, own, count, 0, corner)
        if k >= 0:
            conflict[other] = k
        for zone in range(inside.shape[1]):
            for step in range(min(count + 1, inside.shape[2])):
                if inside[r, zone, step] and inside[other, zone, step]:
                    conflict[other] = min(conflict[other], step)
                    break
