"""Legs of mrmg's cars for planners that find single motions.

A leg: robots start at rest as in a scene and end at rest within a circle each. Peers
plan with the same law of motion, limits, step and margins as mrmg's planner, and check
footprints at every step by the same compiled tests.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numba
import numpy as np

import mrmg
from mrmg.energy.metering import plan_ledger
from mrmg.motion._kernels import step
from mrmg.planning import PlannerParams, plan_mission
from mrmg.planning.roadmap.fleet import fleet_array
from mrmg.plans import Plan, Trajectory
from mrmg.scene.loading import scene_from_document
from mrmg.scene.types import Scene
from mrmg.world._kernels import FreeSpace, footprint_is_clear
from mrmg.world._polygon_kernels import convex_distance, place_footprint
from mrmg.world.world import World

LEGS = {
    "quickstart, 1 car": ("quickstart", ("g2",)),
    "quickstart, 2 cars": ("quickstart", ("g2", "g3")),
    "scene1, 1 car": ("scene1", ("g5",)),
}
"""Scene of each leg, and the goals where its first cars end."""

AMPLE_M = 10_000.0
"""Range of the batteries on a leg [m]: no limit."""


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
            apart = convex_distance(corners[r], corners[other], one.spacing)
            if apart < one.spacing:
                return False
    return True


@dataclass(frozen=True, slots=True)
class Leg:
    """A fleet's motion problem as peers need it.

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
        states[:, :2] = centres  # compiles all that is called while a peer plans
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


@cache
def leg_of(problem: str) -> tuple[Scene, Leg]:
    """Return a leg as a scene, planned once to load kernels, and for peers."""
    name, goals = LEGS[problem]
    document = dict(mrmg.load_scene(name).document)
    regions = {goal["id"]: goal for goal in document["goals"]}
    robots = [
        {**robot, "finish": {"circle": regions[goal]["circle"]}}
        for robot, goal in zip(document["robots"], goals, strict=False)
    ]
    for left_out in ("goals", "stations", "terrain"):
        document.pop(left_out, None)
    document |= {"robots": robots, "battery": {"capacity_m": AMPLE_M}}
    scene = scene_from_document(document, source=problem)
    plan_mission(scene)
    return scene, Leg.of(scene, PlannerParams())
