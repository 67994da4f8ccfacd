"""OMPL's control planners on legs of mrmg's cars.

OMPL samples controls, and reaches Python at every step. A state counts as the goal if
braking from there, at full deceleration, is free and ends within the circle.
"""

from __future__ import annotations

import multiprocessing
import time
from collections.abc import Callable, Sequence
from multiprocessing.connection import Connection
from typing import Any

import numpy as np
from peer_legs import Leg

PLANNERS = ("RRT", "KPIECE1", "EST", "SST")
"""Of `ompl.control`, with their own defaults; SST improves until its time is over."""

HOLD_STEPS = (1, 10)
"""Steps for which a control is held, as OMPL has it by default."""

SPEED_WEIGHT, STEERING_WEIGHT = 0.3, 0.1
"""Weights of speed and steering angle beside metres in OMPL's distance."""

CELLS = 20
"""Cells of KPIECE's and EST's projection on positions along each side of a scene."""

GRACE_S = 10.0
"""After this time beyond its limit a planner counts as hung."""


def solve(
    leg: Leg, planner: str, seed: int, limit_s: float
) -> tuple[np.ndarray | None, float]:
    """Return OMPL's controls, shape (n, R, 2), or None, and the time it took [s].

    It works in a process of its own, which it may crash.
    """
    here, there = multiprocessing.Pipe()
    fork = multiprocessing.get_context("fork")
    worker = fork.Process(
        target=_work, args=(there, leg, planner, seed, limit_s), daemon=True
    )
    worker.start()
    there.close()
    try:
        found: tuple[np.ndarray | None, float] = (
            here.recv() if here.poll(limit_s + GRACE_S) else (None, limit_s)
        )
    except EOFError:
        worker.join()
        if worker.exitcode is not None and worker.exitcode > 0:
            raise RuntimeError(f"{planner} could not be called") from None
        found = None, limit_s
    worker.kill()
    worker.join()
    return found


def _work(end: Connection, leg: Leg, planner: str, seed: int, limit_s: float) -> None:
    end.send(_solve(leg, planner, seed, limit_s))


def _solve(
    leg: Leg, planner: str, seed: int, limit_s: float
) -> tuple[np.ndarray | None, float]:
    from ompl import base, control, util

    util.setLogLevel(util.LOG_ERROR)
    util.RNG.setSeed(seed + 1)
    space, read, write = _space(base, leg)
    inputs = control.RealVectorControlSpace(space, 2 * len(leg.fleet))
    most = [float(limit) for robot in leg.fleet for limit in robot["limit"][3:]]
    inputs.setBounds(_bounds(base, [(-limit, limit) for limit in most]))
    information = control.SpaceInformation(space, inputs)
    numbers = range(2 * len(leg.fleet))

    def propagate(state: Any, held: Any, duration_s: float, result: Any) -> None:
        states = read(state)
        leg.advance(states, [held[k] for k in numbers])
        write(result, states)

    information.setStatePropagator(control.StatePropagatorFn(propagate))
    valid = base.StateValidityCheckerFn(lambda state: leg.clear(read(state)))
    information.setStateValidityChecker(valid)
    information.setPropagationStepSize(leg.dt_s)
    information.setMinMaxControlDuration(*HOLD_STEPS)
    problem = base.ProblemDefinition(information)
    start = space.allocState()
    states = leg.start()
    write(start, states)
    problem.addStartState(start)
    problem.setGoal(_goal(base, information, leg, read, write))
    space.registerDefaultProjection(_projection(base, space, leg, read))
    found = getattr(control, planner)(information)
    found.setProblemDefinition(problem)
    found.setup()
    began = time.perf_counter()
    found.solve(limit_s)
    took_s = time.perf_counter() - began
    if not problem.hasExactSolution():
        return None, took_s
    path = problem.getSolutionPath()
    held = [
        [path.getControl(k)[i] for i in numbers]
        for k, duration_s in enumerate(path.getControlDurations())
        for _ in range(round(duration_s / leg.dt_s))
    ]
    for each in held:
        leg.advance(states, each)
    controls = np.array(held).reshape(-1, len(leg.fleet), 2)
    return np.concatenate([controls, leg.braking(states)]), took_s


def _bounds(base: Any, limits: Sequence[tuple[float, float]]) -> Any:
    """Return the lowest and the highest value of each axis for OMPL."""
    bounds = base.RealVectorBounds(len(limits))
    for axis, (low, high) in enumerate(limits):
        bounds.setLow(axis, low)
        bounds.setHigh(axis, high)
    return bounds


def _space(base: Any, leg: Leg) -> tuple[Any, Callable[..., Any], Callable[..., None]]:
    """Return the fleet's state space, and how its states are read and written."""
    x_min, y_min, x_max, y_max = leg.scene.bounds
    space = base.CompoundStateSpace()
    for robot in leg.fleet:
        pose = base.SE2StateSpace()
        pose.setBounds(_bounds(base, [(x_min, x_max), (y_min, y_max)]))
        space.addSubspace(pose, 1.0)
        v_min, v_max, w_max = map(float, robot["limit"][:3])
        for limits, weight in (
            ((v_min, v_max), SPEED_WEIGHT),
            ((-w_max, w_max), STEERING_WEIGHT),
        ):
            part = base.RealVectorStateSpace(1)
            part.setBounds(_bounds(base, [limits]))
            space.addSubspace(part, weight)
    robots = range(len(leg.fleet))

    def read(state: Any) -> np.ndarray:
        states = np.empty((len(robots), 5))
        for r in robots:
            pose = state[3 * r]
            states[r] = (
                pose.getX(), pose.getY(), pose.getYaw(),
                state[3 * r + 1][0], state[3 * r + 2][0],
            )  # fmt: skip
        return states

    def write(state: Any, states: np.ndarray) -> None:
        for r, (x, y, theta, v, w) in enumerate(states.tolist()):
            pose = state[3 * r]
            pose.setX(x)
            pose.setY(y)
            pose.setYaw((theta + np.pi) % (2.0 * np.pi) - np.pi)
            state[3 * r + 1][0] = v
            state[3 * r + 2][0] = w

    return space, read, write


def _goal(
    base: Any, information: Any, leg: Leg, read: Callable[..., Any], write: Any
) -> Any:
    """Return the goal: all robots come to rest within their circles."""
    rng = np.random.default_rng(0)

    class Finish(base.GoalSampleableRegion):  # type: ignore[misc, name-defined]
        def distanceGoal(self, state: Any) -> float:
            return leg.miss_m(read(state))

        def sampleGoal(self, state: Any) -> None:
            states = np.zeros((len(leg.fleet), 5))
            states[:, :2] = leg.centres
            states[:, 2] = rng.uniform(-np.pi, np.pi, len(states))
            write(state, states)

        def maxSampleCount(self) -> int:
            return 1_000_000

    goal = Finish(information)
    goal.setThreshold(leg.radius_m)
    return goal


def _projection(base: Any, space: Any, leg: Leg, read: Callable[..., Any]) -> Any:
    """Return the projection on the robots' positions, which KPIECE and EST need."""
    from ompl import util

    x_min, y_min, x_max, y_max = leg.scene.bounds

    class Positions(base.ProjectionEvaluator):  # type: ignore[misc, name-defined]
        def getDimension(self) -> int:
            return 2 * len(leg.fleet)

        def defaultCellSizes(self) -> None:
            sizes = util.vectorDouble()
            for _ in leg.fleet:
                sizes.append((x_max - x_min) / CELLS)
                sizes.append((y_max - y_min) / CELLS)
            self.setCellSizes(sizes)

        def project(self, state: Any, projection: Any) -> None:
            for axis, value in enumerate(read(state)[:, :2].ravel()):
                projection[axis] = value

    return Positions(space)
