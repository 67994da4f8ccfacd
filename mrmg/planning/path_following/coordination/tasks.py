"""What each robot is to do, in the form that its search needs."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from math import ceil, pi

import numpy as np

from mrmg.energy.model import CONSUMERS_W
from mrmg.motion._kernels import USER
from mrmg.planning.path_following.band import Path
from mrmg.planning.path_following.coordination._motion_kernels import WAYPOINTS
from mrmg.planning.path_following.coordination._node_kernels import Task
from mrmg.planning.path_following.coordination.fields import NO_GUIDE
from mrmg.planning.path_following.coordination.rounds import Round
from mrmg.planning.problem._clearance_kernels import keeps_clear
from mrmg.planning.problem.problem import Problem
from mrmg.planning.problem.targets import poses_at
from mrmg.planning.roadmap._fleet_kernels import MOST_CORNERS
from mrmg.planning.standing import roomiest_pose

MOTION_SHARE = 0.6
"""Way that a motion leads at full speed, in lengths of the robot."""

LEAST_MOTION_S = 0.3
"""Time that a motion lasts at least [s]."""

WAYPOINT_SHARE = 4.0
"""How far ahead its waypoints lie, in ways of a motion."""

GENTLE_SHARE = 0.3
"""Share of the largest steering in gentle turns."""

HEADINGS = 18
"""Cells of the heading."""

LEVELS = 2
"""Cells of speed and of steering to either side of zero."""

END_SLACK_M = 0.05
"""Clearance beyond the margin that robots end with where they can: driving ends about
so far off."""

HOLD_SHARE = 0.3
"""Cost of standing, as a share of that of moving: it takes time, but no energy."""

LONG_HOLD_SHARE = 0.02
"""The same where robots wait for each other at stations, which takes minutes."""


SLOWEST = 4.0
"""Motions may take so many times as long as way and stays do at full speed ..."""

LEAST_STEPS, BRAKINGS = 1500, 5.0
"""... and so many steps more, or times as long as braking from full speed takes."""


def motion_steps(robot: np.ndarray, dt_s: float, fineness: float) -> int:
    """Return the number of steps that a robot's motions last."""
    way_m = MOTION_SHARE * 2.0 * float(robot["radius"]) / fineness
    lasting_s = max(LEAST_MOTION_S, way_m / float(robot["limit"][1]))
    return ceil(lasting_s / dt_s - 1e-9)


def motions(robot: np.ndarray, steps: int, dt_s: float) -> np.ndarray:
    """Return what a robot's motions aim at, shape (P, 2).

    Speed and steering. Of a custom motion model first WAYPOINTS in its frame that it is
    steered to, then controls to hold: its steering may know no way backwards.
    """
    v_min, v_max, w_max = (float(x) for x in robot["limit"][:3])
    if robot["model"] == USER:
        angle = np.linspace(0.0, 2.0 * pi, WAYPOINTS, endpoint=False)
        far_m = WAYPOINT_SHARE * v_max * steps * dt_s
        to = far_m * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        held = [one for one in product((1.0, 0.0, -1.0), repeat=2) if one != (0.0, 0.0)]
        return np.vstack([to, held * robot["limit"][3:5]])
    speeds = (v_max, v_min, 0.0) if v_min < 0.0 else (v_max, 0.0)
    angles = (0.0, w_max, -w_max, GENTLE_SHARE * w_max, -GENTLE_SHARE * w_max)
    pairs = [(v, w) for v in speeds for w in angles[: 5 if v else 3]]
    return np.array([pair for pair in pairs if pair != (0.0, 0.0)])


def no_path(problem: Problem, r: int) -> Path:
    """Return a path that leads robot r nowhere."""
    node, heading = problem.start[r : r + 1, :2].copy(), float(problem.start[r, 2])
    return Path(node, np.zeros(0, np.int64), heading)


def is_one_pose(problem: Problem, r: int, tour: Sequence[int]) -> bool:
    """Return whether robot r has but one target, and that wants a heading."""
    return len(tour) == 1 and bool(np.isfinite(problem.aims(r, tour)).all())


def arrival_poses(problem: Problem, r: int, tour: Sequence[int]) -> np.ndarray:
    """Return (x, y, yaw) that robot r drives to at its legs' targets and its finish.

    That is the middle, and the heading that is wanted there; where the robot has no
    room in that pose, the one in which it has most.

    Returns:
        Shape (L + 1, 3); 0 in the last row without a finish.
    """
    own, spaces = problem.mission.fleet[r : r + 1], problem.mission.spaces
    margin_m, corner = float(own[0]["margin"]), np.empty((MOST_CORNERS, 2))
    enough_m = margin_m + END_SLACK_M
    pose = np.zeros((len(tour) + int(problem.mission.targets.finish[r] < 0), 3))
    for i, target in enumerate(tour):
        poses = poses_at(problem.mission.targets, target)
        pose[i] = *poses.region.center, poses.heading_rad
        if poses.tolerance_rad < pi and not keeps_clear(
            own, spaces, pose[i], enough_m, corner
        ):
            robot = problem.scene.robots[r]
            best = roomiest_pose(problem.scene, robot, poses, enough_m)
            pose[i] = best.pose if best else pose[i]
    return pose


def stays_s(problem: Problem, r: int, legs: Sequence[int]) -> np.ndarray:
    """Return how long robot r stays at targets at most [s], shape (L,)."""
    targets, robot = problem.mission.targets, problem.mission.fleet[r]
    stay_s = targets.target["dwell"][list(legs)].astype(float)
    if np.isfinite(robot["charge"]):
        filling_s = robot["capacity"] / (robot["charge"] - robot["energy"][CONSUMERS_W])
        stations = np.array([t >= targets.goals for t in legs], bool)
        stay_s[stations] = np.maximum(stay_s[stations], filling_s)
    return stay_s


def task_of(
    problem: Problem,
    r: int,
    tour: Sequence[int],
    path: Path,
    arrivals: np.ndarray,
    effort: Round,
    *,
    driven: bool = False,
) -> Task:
    """Return what robot r is to do, without costs-to-go but along its path.

    Args:
        problem: the mission.
        r: robot.
        tour: its targets; a finish comes last.
        path: along them, or an empty one.
        arrivals: poses that it drives to, as of `arrival_poses`.
        effort: how hard it is searched for.
        driven: whether the path has been driven, to all targets and their headings.
    """
    robot, targets = problem.mission.fleet[r], problem.mission.targets
    dt_s, finish = problem.dt_s, int(targets.finish[r])
    legs = [t for t in tour if t != finish or finish < 0]
    along, stay_s = np.full(len(legs), np.inf), stays_s(problem, r, legs)
    led = min(len(legs), len(path.stop))
    along[:led] = path.way[path.stop[:led]]
    if not driven:  # it may well pass through a target with another heading
        along[targets.target["tolerance"][legs] < pi] = np.inf
    stay_s[:led] = path.pause_s[:led]
    queues = targets.target["zone"].max() >= 0
    standing = LONG_HOLD_SHARE if queues else HOLD_SHARE
    # Stays yet to come cost what they cost, whatever the weight of the rest.
    ahead_s = np.append(np.cumsum(stay_s[::-1])[::-1], 0.0)
    steps = motion_steps(robot, dt_s, effort.fineness)
    top, turn = float(robot["limit"][1]), max(float(robot["limit"][2]), 1e-6)
    headings = round(HEADINGS * min(2.0, effort.fineness))
    sides = [0.5 * top * steps * dt_s, 2.0 * pi / headings, top / LEVELS, turn / LEVELS]
    return Task(
        leg=np.array(legs, np.int64),
        pose=arrivals,
        stay=np.ceil(stay_s / dt_s).astype(np.int64),
        along=along,
        rest_s=0.0,
        later_s=standing / effort.weight * ahead_s,
        finish=finish,
        home_along=finish >= 0 and finish in path.target[-1:],
        guide=NO_GUIDE,
        motion=motions(robot, steps, dt_s),
        steps=steps,
        preview=top * steps * dt_s,
        resolution=np.array(sides),
        weight=effort.weight,
        hold_share=standing,
        soft_s=effort.soft_s,
        most=effort.most,
    )


def horizon_steps(
    problem: Problem, tours: Sequence[Sequence[int]], paths: Sequence[Path]
) -> int:
    """Return the steps that motions may take."""
    mission = problem.mission
    top = mission.fleet["limit"][:, 1]
    spans_s, standing_s = [], 0.0
    for r, (tour, path) in enumerate(zip(tours, paths, strict=True)):
        way = np.vstack(
            [problem.start[r, :2], mission.targets.target["center"][list(tour)]]
        )
        straight_m = float(np.hypot(*np.diff(way, axis=0).T).sum())
        longest_m = max(straight_m, float(path.way[-1]))
        spans_s.append(longest_m / float(top[r]))
        # One robot may have to wait for the stays of all others.
        standing_s += max(float(stays_s(problem, r, tour).sum()), path.pause_s.sum())
    stop_s = float((top / mission.fleet["limit"][:, 3]).max())
    more = max(LEAST_STEPS, int(BRAKINGS * stop_s / problem.dt_s))
    return int((SLOWEST * max(spans_s) + standing_s) / problem.dt_s) + more
