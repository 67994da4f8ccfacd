"""Driving a fleet along given paths."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mrmg.energy import EFFECTIVE_MASS_KG, ROLLING_N
from mrmg.mission import Trajectory
from mrmg.motion._kernels import UNICYCLE
from mrmg.planning import _tracking_kernels
from mrmg.planning._tracking_kernels import Courses
from mrmg.planning.band import Path
from mrmg.planning.haste import brakes_hard
from mrmg.planning.motion_tree import Problem
from mrmg.planning.parameters import PlannerParams

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
        place: where, shape (2,).
    """

    trajectories: tuple[Trajectory, ...]
    stuck: int
    place: np.ndarray


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
    steps, stuck = _tracking_kernels.drive(
        mission.fleet,
        mission.spaces,
        mission.gates,
        courses_of(problem, paths, slow),
        given,
        problem.start,
        np.arange(len(paths)),
        params.dt_s,
        control,
        halt,
    )
    steps = max(steps, 1)
    states = []
    for r in range(len(paths)):
        state = np.zeros((steps + 1, 5))
        state[0] = problem.start[r]
        own = np.ascontiguousarray(control[:steps, r])
        _tracking_kernels.write_states(mission.fleet, r, params.dt_s, own, state)
        states.append((own, state))
    if stuck >= 0:
        return Drive((), int(stuck), states[stuck][1][-1, :2])
    trajectories = tuple(
        Trajectory(robot=robot.id, dt_s=params.dt_s, state=state, control=own)
        for robot, (own, state) in zip(problem.scene.robots, states, strict=True)
    )
    return Drive(trajectories, -1, np.zeros(2))


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
    ease = _decelerations(problem)
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
        fastest[r, :n] = _speed_limits(path, slow[r], float(ease[r]))
    return Courses(
        node=node,
        gear=gear,
        bend=bend,
        way=way,
        end=end,
        fastest=fastest,
        nodes=np.array([len(path.node) for path in paths]),
        ease=ease,
    )


def _most_steps(
    problem: Problem,
    params: PlannerParams,
    paths: Sequence[Path],
    given: np.ndarray,
) -> int:
    top = np.minimum(*np.abs(problem.mission.fleet["limit"][:, :2].T))
    lengths = np.array([path.way[-1] for path in paths])
    return int(
        given.max() + SLOWEST * (lengths / top).max() / params.dt_s + LEAST_STEPS
    )


def _speed_limits(path: Path, slow: Sequence[SlowPlace], ease: float) -> np.ndarray:
    """Return the speed at which each node is passed at most, shape (n,).

    Before slow places it falls no faster than a robot slows down for free.
    """
    fastest = np.full(len(path.node), np.inf)
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
    return np.where(brakes_hard(problem.scene, problem.hurried), braking, eased)
