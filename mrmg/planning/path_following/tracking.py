"""Driving one robot along its path, as if it were alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mrmg.energy.model import EFFECTIVE_MASS_KG, ROLLING_N
from mrmg.motion._kernels import CAR, UNICYCLE, USER
from mrmg.planning.path_following import _tracking_kernels
from mrmg.planning.path_following._following_kernels import (
    COURSE_NODE,
    Course,
    pace,
)
from mrmg.planning.path_following.band import Path, nimble_share
from mrmg.planning.path_following.cost_map import path_curvature
from mrmg.planning.problem.problem import Problem
from mrmg.planning.problem.time_weighting import brakes_hard

SLOWEST = 4
"""Driving may take so many times as long as the path does at full speed."""

LEAST_STEPS, BRAKINGS = 400, 4.0
"""Steps that driving may take in any case, or times as long as braking from full speed
takes for each stretch of the path."""

COASTING_SHARE = 0.91
"""Share of rolling resistance's deceleration that robots slow down with. The rest is
traction: with too little of it, simulated drives push and brake by turns."""

TURNING_SHARE = 0.3
"""The same for robots that turn by their wheels' speeds: nearly without traction one
wheel would push in a turn and the other one brake, which takes up to a tenth more than
planned."""

HARD_SHARE = 0.9
"""Share of the largest deceleration that robots in a hurry brake with."""

CRAWL = 0.3
"""Speed to which sharp turns slow down at least, in units of the robot's `pace`."""

STIFFNESS = 0.8
"""How fast robots return to their paths [1/m]; nimbler ones faster."""


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """One robot's motion.

    Attributes:
        state: shape (n + 1, 5).
        control: shape (n, 2).
    """

    state: np.ndarray
    control: np.ndarray


@dataclass(frozen=True, slots=True, eq=False)
class Drive:
    """What driving along a path gave.

    Attributes:
        motion: of the robot, as far as it got.
        arrived: whether it rests at the end.
        spent_s: what it took to each node of the path without stays, as time on plain
            ground [s], shape (n,); inf where it did not get to. Empty if it did
            not drive along a path.
    """

    motion: Motion
    arrived: bool
    spent_s: np.ndarray


def drive_alone(problem: Problem, r: int, path: Path) -> Drive:
    """Drive robot r along its path, from its start, with the stays at its stops."""
    own = problem.mission.fleet[r : r + 1]
    speeds = np.abs(own[0]["limit"][:2])
    top = float(speeds[speeds > 0.0].min())
    longest_s = SLOWEST * float(path.way[-1]) / top + float(path.pause_s.sum())
    brakings_s = BRAKINGS * len(path.edges) * top / float(own[0]["limit"][3])
    more = max(LEAST_STEPS, int(brakings_s / problem.dt_s))
    most = int(longest_s / problem.dt_s) + more
    state, control = np.zeros((most + 1, 5)), np.zeros((most, 2))
    state[0] = problem.start[r]
    spent_s = np.full(len(path.node), np.inf)
    spent_s[0] = 0.0
    steps, arrived = _tracking_kernels.drive(
        own,
        problem.mission.spaces,
        problem.mission.terrain,
        course_of(problem, r, path),
        problem.dt_s,
        spent_s,
        state,
        control,
    )
    motion = Motion(state[: steps + 1].copy(), control[:steps].copy())
    return Drive(motion, arrived, spent_s)


def course_of(problem: Problem, r: int, path: Path) -> Course:
    """Return robot r's path in the form that driving needs."""
    robot, n = problem.mission.fleet[r], len(path.node)
    node, ease = empty_path(max(2, n)), deceleration(problem, r)
    node["x"], node["y"] = np.resize(path.node, (len(node), 2)).T
    pause = np.ceil(path.pause_s / problem.dt_s).astype(int)
    np.add.at(node["pause"], path.stop, pause)
    if n > 1:
        chord = np.diff(path.node, axis=0)
        size = np.hypot(*chord.T)
        node["gear"][:-1], node["way"] = path.gear, path.way
        edges = path.edges.tolist()
        for a, b in zip(edges, edges[1:], strict=False):
            node["end"][a:b] = b
            node["bend"][a : b + 1] = _bends(chord[a:b], size[a:b])
        tight = steerable_speeds(problem, r, node)
        node["fastest"] = _speed_limits(path, tight, ease)
        node["rest_s"] = (path.way[-1] - path.way) / robot["limit"][1]
    if robot["model"] != CAR:  # which has the heading of its path
        aims = problem.mission.targets.target[path.target]
        fixed = aims["tolerance"] < np.pi
        at = path.stop[fixed]
        node["heading"][at] = aims["heading"][fixed]
        node["tolerance"][at] = aims["tolerance"][fixed]
    return Course(
        node=node,
        size=np.array([n]),
        ease=ease,
        stiffness=STIFFNESS / nimble_share(path_curvature(robot)),
    )


def empty_path(most: int) -> np.ndarray:
    """Return room for the nodes of a path: `COURSE_NODE`, shape (most,)."""
    node = np.zeros(most, COURSE_NODE)
    node["gear"], node["fastest"], node["tolerance"] = 1, np.inf, np.inf
    return node


def steerable_speeds(problem: Problem, r: int, node: np.ndarray) -> np.ndarray:
    """Return the speed up to which a robot can steer and turn along its path, (n,).

    Args:
        problem: the mission.
        r: robot.
        node: `COURSE_NODE`, shape (n,), with bends, ways and ends of stretches.
    """
    robot, bend = problem.mission.fleet[r], node["bend"]
    limit = robot["limit"]
    if robot["model"] == USER:  # only its own steering knows
        return np.full(len(bend), np.inf)
    change = np.abs(np.diff(bend)) / np.maximum(np.diff(node["way"]), 1e-6)
    change[1:][np.diff(node["end"][:-1]) != 0] = 0.0  # the robot stands there
    change = np.maximum(change, 1e-9)
    if robot["model"] == UNICYCLE:
        speed = np.sqrt(limit[4] / change)
    else:
        sharp = np.minimum(np.abs(bend[1:]), np.abs(bend[:-1]))
        arm = float(robot["wheelbase"])
        speed = limit[4] * (1.0 + (arm * sharp) ** 2) / (arm * change)
    speed = np.maximum(speed, CRAWL * pace(robot))
    speed = np.minimum(np.append(speed, np.inf), np.insert(speed, 0, np.inf))
    if robot["model"] == UNICYCLE:
        speed = np.minimum(speed, limit[2] / np.maximum(np.abs(bend), 1e-9))
    return np.asarray(speed)


def _speed_limits(path: Path, tight: np.ndarray, ease: float) -> np.ndarray:
    """Return the speed at which each node is passed at most, shape (n,).

    Before tight turns it falls no faster than a robot slows down for free.
    """
    fastest = tight.copy()
    size = np.diff(path.way)
    for i in range(len(size) - 1, -1, -1):
        before = np.sqrt(fastest[i + 1] ** 2 + 2.0 * ease * size[i])
        fastest[i] = min(fastest[i], before)
    return fastest


def _bends(chord: np.ndarray, size: np.ndarray) -> np.ndarray:
    """Return the curvature at the nodes of a stretch, shape (n, 2) -> (n + 1,)."""
    if len(chord) < 2:
        return np.zeros(len(chord) + 1)
    direction = np.arctan2(chord[:, 1], chord[:, 0])
    turn = (np.diff(direction) + np.pi) % (2.0 * np.pi) - np.pi
    inner = turn / (0.5 * (size[:-1] + size[1:]))
    return np.concatenate([inner[:1], inner, inner[-1:]])


def deceleration(problem: Problem, r: int) -> float:
    """Return what robot r slows down with [m/s^2].

    Where that is worth the time, no energy is braked away: it is rolling resistance on
    the easiest ground, at least a tenth of the limit.
    """
    robot = problem.mission.fleet[r]
    hardest = float(robot["limit"][3])
    driving = problem.preference.driving
    if problem.minimum_time or brakes_hard(driving, problem.scene.robots[r]):
        return HARD_SHARE * hardest
    ground = float(problem.mission.terrain.multiplier.min())
    mass = max(float(robot["energy"][EFFECTIVE_MASS_KG]), 1e-9)
    share = TURNING_SHARE if robot["model"] == UNICYCLE else COASTING_SHARE
    rolling = share * ground * float(robot["energy"][ROLLING_N]) / mass
    return min(max(rolling, 0.1 * hardest), HARD_SHARE * hardest)
