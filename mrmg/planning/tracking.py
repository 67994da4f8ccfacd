"""Driving a fleet along given paths."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mrmg.energy import EFFECTIVE_MASS_KG, ROLLING_N
from mrmg.mission import Trajectory
from mrmg.planning import _tracking_kernels
from mrmg.planning._tracking_kernels import Courses
from mrmg.planning.band import Path
from mrmg.planning.motion_tree import Problem
from mrmg.planning.parameters import PlannerParams

SLOWEST = 3
"""A mission may take so many times as long as before."""

COASTING_SHARE = 0.95
"""Share of rolling resistance's deceleration that robots slow down with."""


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
    before: Sequence[Trajectory],
    paths: Sequence[Path],
    given: np.ndarray,
    halt: np.ndarray,
) -> Drive:
    """Drive the fleet along paths.

    Args:
        problem: the mission.
        params: gives the step.
        before: trajectories whose controls are repeated at first.
        paths: one for each robot, from where repeating ends.
        given: number of steps that are repeated, shape (R,).
        halt: shape (1,); driving ends soon after it has turned true.
    """
    mission = problem.mission
    most = SLOWEST * max(len(t.control) for t in before) + 200
    control = np.zeros((most, len(paths), 2))
    for r, trajectory in enumerate(before):
        control[: given[r], r] = trajectory.control[: given[r]]
    steps, stuck = _tracking_kernels.drive(
        mission.fleet,
        mission.spaces,
        mission.gates,
        courses_of(problem, paths),
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


def courses_of(problem: Problem, paths: Sequence[Path]) -> Courses:
    """Return paths in the form that driving needs."""
    robots, most = len(paths), max([2, *(len(path.node) for path in paths)])
    node = np.zeros((robots, most, 2))
    gear = np.ones((robots, most), np.int64)
    bend, way = np.zeros((robots, most)), np.zeros((robots, most))
    end = np.zeros((robots, most), np.int64)
    for r, path in enumerate(paths):
        n = len(path.node)
        if n < 2:
            continue
        chord = np.diff(path.node, axis=0)
        size = np.hypot(*chord.T)
        node[r, :n] = path.node
        gear[r, : n - 1] = path.gear
        way[r, 1:n] = np.cumsum(size)
        edges = [0, *(np.flatnonzero(np.diff(path.gear)) + 1).tolist(), n - 1]
        for a, b in zip(edges, edges[1:], strict=False):
            end[r, a:b] = b
            bend[r, a : b + 1] = _bends(chord[a:b], size[a:b])
    return Courses(
        node=node,
        gear=gear,
        bend=bend,
        way=way,
        end=end,
        nodes=np.array([len(path.node) for path in paths]),
        ease=_free_decelerations(problem),
    )


def _bends(chord: np.ndarray, size: np.ndarray) -> np.ndarray:
    """Return the curvature at the nodes of a stretch, shape (n, 2) -> (n + 1,)."""
    if len(chord) < 2:
        return np.zeros(len(chord) + 1)
    direction = np.arctan2(chord[:, 1], chord[:, 0])
    turn = (np.diff(direction) + np.pi) % (2.0 * np.pi) - np.pi
    inner = turn / (0.5 * (size[:-1] + size[1:]))
    return np.concatenate([inner[:1], inner, inner[-1:]])


def _free_decelerations(problem: Problem) -> np.ndarray:
    """Return what each robot slows down with [m/s^2] so that no energy is braked away.

    That is rolling resistance on the easiest ground; at least a tenth of the limit.
    """
    ground = float(problem.mission.terrain.multiplier.min())
    fleet = problem.mission.fleet
    mass = np.maximum(fleet["energy"][:, EFFECTIVE_MASS_KG], 1e-9)
    rolling = COASTING_SHARE * ground * fleet["energy"][:, ROLLING_N] / mass
    hardest = fleet["limit"][:, 3]
    return np.asarray(np.clip(rolling, 0.1 * hardest, 0.9 * hardest))
