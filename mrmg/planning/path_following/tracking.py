"""Driving a fleet along given paths."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mrmg.energy.model import EFFECTIVE_MASS_KG, ROLLING_N
from mrmg.motion._kernels import UNICYCLE
from mrmg.planning.parameters import PlannerParams
from mrmg.planning.path_following import _tracking_kernels
from mrmg.planning.path_following._following_kernels import Courses
from mrmg.planning.path_following._tracking_kernels import Driving, Progress
from mrmg.planning.path_following.band import Path, nimble_share
from mrmg.planning.path_following.cost_map import path_curvature
from mrmg.planning.problem.problem import Problem
from mrmg.planning.problem.time_weighting import brakes_hard
from mrmg.plans import Trajectory

SLOWEST = 4
"""Driving may take so many times as long as the longest path does at full speed."""

LEAST_STEPS = 400
"""Steps that driving may take in any case."""

COASTING_SHARE = 0.95
"""Share of rolling resistance's deceleration that robots slow down with."""

TURNING_SHARE = 0.3
"""The same for robots that turn by their wheels' speeds: nearly without traction one
wheel would push in a turn and the other one brake, which takes up to a tenth more than
planned."""

HARD_SHARE = 0.9
"""Share of the largest deceleration that robots in a hurry brake with."""

BRAKING = 1.5
"""Multiple of that deceleration from which on it is braking."""

LEAST_BRAKING_M_S = 0.1
"""Change of speed by braking that is worth to be avoided [m/s]."""

CRAWL_M_S = 0.3
"""Speed to which places slow down at least."""

STIFFNESS = 0.8
"""How fast robots return to their paths [1/m]; nimbler ones faster."""

PLACE_M = 0.6
"""Distance within which nodes belong to a place."""


@dataclass(frozen=True, slots=True)
class SlowPlace:
    """A place that a robot passes slowly.

    Attributes:
        place: shape (2,).
        speed_m_s: at most.
    """

    place: np.ndarray
    speed_m_s: float


@dataclass(frozen=True, slots=True)
class Drive:
    """What driving along paths gave.

    Attributes:
        trajectories: of all robots; empty if somebody got stuck.
        stuck: the robot that got stuck, or -1.
        state: of all robots in the end, shape (R, 5).
        driven: way that each robot has driven along its path [m], shape (R,); -inf
            before it takes to it, inf behind its end.
    """

    trajectories: tuple[Trajectory, ...]
    stuck: int
    state: np.ndarray
    driven: np.ndarray

    @property
    def place(self) -> np.ndarray:
        """Where a robot got stuck, shape (2,)."""
        return np.asarray(self.state[self.stuck, :2])


def redriven(
    problem: Problem,
    params: PlannerParams,
    paths: Sequence[Path],
    slow: Sequence[Sequence[SlowPlace]],
    repeated: Sequence[np.ndarray],
    halt: np.ndarray,
) -> Drive:
    """Drive the fleet along paths.

    Args:
        problem: the mission.
        params: gives the step.
        paths: one for each robot, from where repeating ends.
        slow: places that each robot passes slowly.
        repeated: controls with which each robot begins, shape (n, 2).
        halt: shape (1,); driving ends soon after it has turned true.
    """
    mission = problem.mission
    given = np.array([len(controls) for controls in repeated])
    control = np.zeros((_most_steps(problem, params, paths, given), len(paths), 2))
    for r, controls in enumerate(repeated):
        control[: len(controls), r] = controls
    driving = Driving(
        fleet=mission.fleet,
        spaces=mission.spaces,
        zones=mission.zones,
        courses=courses_of(problem, paths, slow),
        given=given,
        start=problem.start,
        dt=params.dt_s,
        halt=halt,
    )
    progress = Progress(
        segment=np.zeros(len(paths), np.int64),
        still=np.zeros(len(paths), np.int64),
        stood=np.zeros(len(paths), np.int64),
        done=driving.courses.nodes < 2,
        driven=np.full(len(paths), -np.inf),
        idle=np.zeros(1, np.int64),
    )
    steps, stuck = _tracking_kernels.drive(driving, progress, control)
    steps = max(steps, 1)
    states = []
    for r in range(len(paths)):
        state = np.zeros((steps + 1, 5))
        state[0] = problem.start[r]
        own = np.ascontiguousarray(control[:steps, r])
        _tracking_kernels.write_states(mission.fleet, r, params.dt_s, own, state)
        states.append((own, state))
    last = np.array([state[-1] for _, state in states])
    if stuck >= 0:
        return Drive((), int(stuck), last, progress.driven)
    trajectories = tuple(
        Trajectory(robot=robot.id, dt_s=params.dt_s, state=state, control=own)
        for robot, (own, state) in zip(problem.scene.robots, states, strict=True)
    )
    return Drive(trajectories, -1, last, progress.driven)


def braking_places(problem: Problem, r: int, trajectory: Trajectory) -> list[SlowPlace]:
    """Return the places before which robot r had to brake, with the speeds there.

    Whoever arrives there slowly has lost nothing: rolling resistance slows it down.
    """
    ease = _decelerations(problem)[r]
    speed = np.abs(trajectory.state[:, 3])
    brakes = np.diff(speed) < -BRAKING * ease * trajectory.dt_s
    change = np.diff(np.concatenate([[False], brakes, [False]]).astype(int))
    begins, ends = np.flatnonzero(change > 0), np.flatnonzero(change < 0)
    return [
        SlowPlace(trajectory.state[end, :2], max(float(speed[end]), CRAWL_M_S))
        for begin, end in zip(begins, ends, strict=True)
        if speed[begin] - max(speed[end], CRAWL_M_S) > LEAST_BRAKING_M_S
    ]


def courses_of(
    problem: Problem, paths: Sequence[Path], slow: Sequence[Sequence[SlowPlace]]
) -> Courses:
    """Return paths in the form that driving needs."""
    robots, most = len(paths), max([2, *(len(path.node) for path in paths)])
    node = np.zeros((robots, most, 2))
    gear = np.ones((robots, most), np.int64)
    bend, way = np.zeros((robots, most)), np.zeros((robots, most))
    end = np.zeros((robots, most), np.int64)
    fastest = np.full((robots, most), np.inf)
    pause = np.zeros((robots, most), np.int64)
    ease = _decelerations(problem)
    targets, fleet = problem.mission.targets, problem.mission.fleet
    turned = (targets.finish >= 0) & (targets.tolerance < np.pi)
    for r, path in enumerate(paths):
        n = len(path.node)
        if n < 2:
            continue
        chord = np.diff(path.node, axis=0)
        size = np.hypot(*chord.T)
        node[r, :n] = path.node
        gear[r, : n - 1] = path.gear
        way[r, :n] = path.way
        edges = path.edges.tolist()
        for a, b in zip(edges, edges[1:], strict=False):
            end[r, a:b] = b
            bend[r, a : b + 1] = _bends(chord[a:b], size[a:b])
        tight = steerable_speeds(problem, r, bend[r, :n], way[r, :n], end[r, : n - 1])
        steps = np.ceil(path.pause_s / problem.dt_s).astype(int)
        np.add.at(pause[r], path.stop, steps)
        fastest[r, :n] = _speed_limits(path, slow[r], tight, float(ease[r]))
    return Courses(
        node=node,
        gear=gear,
        bend=bend,
        way=way,
        end=end,
        fastest=fastest,
        pause=pause,
        nodes=np.array([len(path.node) for path in paths]),
        ease=ease,
        stiffness=np.array(
            [STIFFNESS / nimble_share(path_curvature(robot)) for robot in fleet]
        ),
        heading=targets.heading,
        tolerance=np.where(turned, targets.tolerance, np.inf),
    )


def _most_steps(
    problem: Problem,
    params: PlannerParams,
    paths: Sequence[Path],
    given: np.ndarray,
) -> int:
    top = np.minimum(*np.abs(problem.mission.fleet["limit"][:, :2].T))
    lengths = np.array([path.way[-1] for path in paths])
    pauses_s = sum(float(path.pause_s.sum()) for path in paths)
    return int(
        given.max()
        + (SLOWEST * (lengths / top).max() + pauses_s) / params.dt_s
        + LEAST_STEPS
    )


def steerable_speeds(
    problem: Problem, r: int, bend: np.ndarray, way: np.ndarray, end: np.ndarray
) -> np.ndarray:
    """Return the speed up to which a robot can steer along its path, shape (n,).

    Args:
        problem: the mission.
        r: robot.
        bend: curvature at the nodes [1/m], shape (n,).
        way: way to the nodes [m], shape (n,).
        end: number of the node at which each segment's stretch ends, shape (n - 1,).
    """
    robot = problem.mission.fleet[r]
    limit = robot["limit"]
    change = np.abs(np.diff(bend)) / np.maximum(np.diff(way), 1e-6)
    change[1:][np.diff(end) != 0] = 0.0  # the robot stands there
    change = np.maximum(change, 1e-9)
    if robot["model"] == UNICYCLE:
        speed = np.sqrt(limit[4] / change)
    else:
        sharp = np.minimum(np.abs(bend[1:]), np.abs(bend[:-1]))
        arm = float(robot["wheelbase"])
        speed = limit[4] * (1.0 + (arm * sharp) ** 2) / (arm * change)
    speed = np.maximum(speed, CRAWL_M_S)
    return np.asarray(np.minimum(np.append(speed, np.inf), np.insert(speed, 0, np.inf)))


def _speed_limits(
    path: Path, slow: Sequence[SlowPlace], tight: np.ndarray, ease: float
) -> np.ndarray:
    """Return the speed at which each node is passed at most, shape (n,).

    Before slow places it falls no faster than a robot slows down for free.
    """
    fastest = tight.copy()
    for one in slow:
        far = np.hypot(*(path.node - one.place).T)
        near = far < max(PLACE_M, far.min() + 1e-6)
        fastest[near] = np.minimum(fastest[near], one.speed_m_s)
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


def _decelerations(problem: Problem) -> np.ndarray:
    """Return what each robot slows down with [m/s^2].

    Where that is worth the time, no energy is braked away: it is rolling resistance on
    the easiest ground, at least a tenth of the limit.
    """
    ground = float(problem.mission.terrain.multiplier.min())
    fleet = problem.mission.fleet
    mass = np.maximum(fleet["energy"][:, EFFECTIVE_MASS_KG], 1e-9)
    share = np.where(fleet["model"] == UNICYCLE, TURNING_SHARE, COASTING_SHARE)
    rolling = share * ground * fleet["energy"][:, ROLLING_N] / mass
    hardest = fleet["limit"][:, 3]
    braking = HARD_SHARE * hardest
    eased = np.clip(rolling, 0.1 * hardest, braking)
    return np.where(brakes_hard(problem.scene, problem.minimum_time), braking, eased)
