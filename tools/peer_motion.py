"""OMPL's control planners on legs of mrmg's cars.

A leg: robots start at rest as in a scene and end at rest within a circle each. OMPL
samples controls over the same law of motion, limits, step and margins as mrmg's
planner, and checks footprints at every step by the same compiled tests; it reaches
Python at each of them. A state counts as the goal if braking from there, at full
deceleration, is free and ends within the circle.
"""

from __future__ import annotations

import multiprocessing
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Any

import numba
import numpy as np

from mrmg.energy.metering import plan_ledger
from mrmg.motion._kernels import step
from mrmg.planning import PlannerParams
from mrmg.planning.roadmap.fleet import fleet_array
from mrmg.plans import Plan, Trajectory
from mrmg.scene.types import Scene
from mrmg.world._kernels import (
    FreeSpace,
    convex_convex_distance,
    footprint_is_clear,
    place_footprint,
)
from mrmg.world.world import World

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


@numba.njit
def braked(robot, state, dt, controls):  # type: ignore[no-untyped-def]
    """Brake a state to rest in place, steering held; return how many steps it takes.

    Args:
        robot: record of the fleet.
        state: (x, y, theta, v, psi), ends at rest.
        dt: length of a step [s].
        controls: written, shape (n, 2); at least as long as braking takes.
    """
    n = 0
    while abs(state[3]) > 1e-9:
        u1 = -min(abs(state[3]) / dt, robot.limit[3]) * np.sign(state[3])
        step(robot, state, u1, 0.0, dt, state)
        controls[n, 0], controls[n, 1] = u1, 0.0
        n += 1
    state[3] = 0.0
    return n


@numba.njit
def states_clear(fleet, spaces, states, corners):  # type: ignore[no-untyped-def]
    """Return whether a fleet's states keep limits and margins.

    Args:
        fleet: records of the robots.
        spaces: free space of each robot.
        states: shape (R, 5).
        corners: written: placed footprints, shape (R, m, 2).
    """
    for r in range(len(fleet)):
        one = fleet[r]
        x, y, theta, v, w = states[r]
        if not one.limit[0] <= v <= one.limit[1] or abs(w) > one.limit[2]:
            return False
        place_footprint(one.corner[: one.corners], x, y, theta, corners[r])
        c, s = np.cos(theta), np.sin(theta)
        mx = x + c * one.middle[0] - s * one.middle[1]
        my = y + s * one.middle[0] + c * one.middle[1]
        if not footprint_is_clear(
            spaces[r], corners[r], mx, my, one.radius, one.margin
        ):
            return False
        for other in range(r):
            apart = convex_convex_distance(corners[r], corners[other])
            if apart < one.spacing:
                return False
    return True


@dataclass(frozen=True, slots=True)
class Leg:
    """A fleet's motion problem as OMPL's callbacks need it.

    Attributes:
        scene: with a finish for each robot.
        fleet: records of the robots.
        spaces: free space of each robot.
        centres: of the circles where robots end [m], shape (R, 2).
        radius_m: of the smallest of them.
        dt_s: length of a step.
    """

    scene: Scene
    fleet: np.ndarray
    spaces: tuple[FreeSpace, ...]
    centres: np.ndarray
    radius_m: float
    dt_s: float

    @staticmethod
    def of(scene: Scene, params: PlannerParams) -> Leg:
        """Return the leg of a scene, with the margins of parameters."""
        world = World.from_scene(scene)
        fleet = fleet_array(scene, world, params.margins)
        spaces = tuple(world.spaces[at] for at in world.space_of_robot)
        finishes = [robot.finish.region for robot in scene.robots]
        centres = np.array([region.center for region in finishes])
        radius_m = min(float(one.depth(centres)[r]) for r, one in enumerate(finishes))
        leg = Leg(scene, fleet, spaces, centres, radius_m, params.dt_s)
        states = leg.start()
        states[:, :2] = centres  # compiles all that is called while OMPL plans
        leg.miss_m(states)
        return leg

    def start(self) -> np.ndarray:
        """Return the states at the start, shape (R, 5)."""
        states = np.zeros((len(self.fleet), 5))
        states[:, :3] = [robot.pose for robot in self.scene.robots]
        return states

    def clear(self, states: np.ndarray) -> bool:
        """Return whether states of shape (R, 5) keep limits and margins."""
        corners = np.empty((len(states), int(self.fleet["corners"].max()), 2))
        return bool(states_clear(self.fleet, self.spaces, states, corners))

    def advance(self, states: np.ndarray, controls: Sequence[float]) -> None:
        """Move states by a step under u1, u2 of each robot."""
        for r, robot in enumerate(self.fleet):
            u1, u2 = controls[2 * r : 2 * r + 2]
            step(robot, states[r], u1, u2, self.dt_s, states[r])

    def braking(self, states: np.ndarray) -> np.ndarray:
        """Bring states to rest; return the controls, shape (n, R, 2)."""
        most = int(np.ceil(np.abs(states[:, 3]).max() / self.dt_s)) * 4 + 4
        controls = np.zeros((len(states), most, 2))
        steps = [
            braked(robot, states[r], self.dt_s, controls[r])
            for r, robot in enumerate(self.fleet)
        ]
        return controls[:, : max(steps)].transpose(1, 0, 2)

    def miss_m(self, states: np.ndarray) -> float:
        """Return how far from its finish some robot would come to rest [m]."""
        rest = states.copy()
        controls = self.braking(rest)
        off_m = float(np.hypot(*(rest[:, :2] - self.centres).T).max())
        if off_m > self.radius_m:
            return off_m
        moving = states.copy()
        for control in [*controls, np.zeros_like(self.centres)]:
            self.advance(moving, control.ravel())
            if not self.clear(moving):
                return off_m + self.radius_m
        return off_m

    def plan(self, controls: np.ndarray) -> Plan:
        """Return the plan of held controls, shape (n, R, 2), braking included."""
        states = np.zeros((len(controls) + 1, len(self.fleet), 5))
        states[0] = self.start()
        for k, control in enumerate(controls):
            states[k + 1] = states[k]
            self.advance(states[k + 1], control.ravel())
        driven = tuple(
            Trajectory(
                robot=robot.id,
                dt_s=self.dt_s,
                state=np.ascontiguousarray(states[:, r]),
                control=np.ascontiguousarray(controls[:, r]),
                motion=robot.model.motion_name,
            )
            for r, robot in enumerate(self.scene.robots)
        )
        return Plan(
            scene_name=self.scene.name,
            scene_digest=self.scene.digest,
            seed=0,
            profile="ompl",
            parameters_digest="",
            versions={},
            dt_s=self.dt_s,
            trajectories=driven,
            tours={robot.id: () for robot in self.scene.robots},
            visits=(),
            ledger=plan_ledger(self.scene, driven, ()),
        )


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
    bounds = base.RealVectorBounds(2 * len(leg.fleet))
    for r, robot in enumerate(leg.fleet):
        for axis, most in enumerate(robot["limit"][3:]):
            bounds.setLow(2 * r + axis, -float(most))
            bounds.setHigh(2 * r + axis, float(most))
    inputs.setBounds(bounds)
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


def _space(base: Any, leg: Leg) -> tuple[Any, Callable[..., Any], Callable[..., None]]:
    """Return the fleet's state space, and how its states are read and written."""
    x_min, y_min, x_max, y_max = leg.scene.bounds
    space = base.CompoundStateSpace()
    for robot in leg.fleet:
        area = base.RealVectorBounds(2)
        for axis, (low, high) in enumerate(((x_min, x_max), (y_min, y_max))):
            area.setLow(axis, low)
            area.setHigh(axis, high)
        pose = base.SE2StateSpace()
        pose.setBounds(area)
        space.addSubspace(pose, 1.0)
        v_min, v_max, w_max = map(float, robot["limit"][:3])
        for (low, high), weight in (
            ((v_min, v_max), SPEED_WEIGHT),
            ((-w_max, w_max), STEERING_WEIGHT),
        ):
            part = base.RealVectorStateSpace(1)
            bounds = base.RealVectorBounds(1)
            bounds.setLow(low)
            bounds.setHigh(high)
            part.setBounds(bounds)
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
