"""Recorded runs of the paper's method, and their replay in plain Python."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from shapely import affinity
from shapely.geometry import Point, Polygon

from mrmg.motion.dynamics import car_derivative, rk4_step
from mrmg.planning.guided_tree.planner import Growth, grow_guided_tree
from mrmg.planning.parameters import GuidedTreeParams, PlannerParams, paper_params
from mrmg.planning.problem.problem import Problem, state_mission
from mrmg.planning.routing._nrpa_kernels import with_own_tables
from mrmg.scene.loading import scene_from_document
from mrmg.scene.types import Scene

STEP = rk4_step(car_derivative(math.sin, math.cos, math.tan))

MISSION = {
    "format": 1,
    "name": "court",
    "bounds": [0, 0, 36, 24],
    "obstacles": [
        {"box": {"center": [16, 6], "size": [2, 9]}},
        {"box": {"center": [24, 17], "size": [9, 2]}},
    ],
    "terrain": [{"polygon": [[18, 0], [26, 0], [26, 10], [18, 10]], "multiplier": 2.0}],
    "goals": [
        {"id": "g1", "circle": {"center": [28, 5], "radius": 1.5}},
        {"id": "g2", "circle": {"center": [31, 20], "radius": 1.5}},
        {"id": "g3", "circle": {"center": [8, 20], "radius": 1.5}},
        {"id": "g4", "circle": {"center": [12, 12], "radius": 1.5}},
    ],
    "stations": [{"id": "s1", "circle": {"center": [21, 13], "radius": 1.5}}],
    "battery": {"capacity_m": 32, "reserve": 0.05},
    "robots": [
        {"id": "r1", "model": "car", "pose": [4, 4, 0], "energy": "paper"},
        {"id": "r2", "model": "car", "pose": [4, 9, 0], "energy": "paper"},
    ],
}
"""A mission in which robots collide, recharge, and lack energy for some tours."""


@dataclass(frozen=True)
class Recording:
    """A run of the method with all that was recorded of it."""

    scene: Scene
    problem: Problem
    params: PlannerParams
    growth: Growth


def record(seed: int, scene: Scene | None = None, **changes: object) -> Recording:
    """Return a run of a scene, or the mission, with changed parameters."""
    scene = scene or scene_from_document(MISSION, source="court")
    method = replace(GuidedTreeParams(iterations=4000), **changes)
    params = replace(paper_params(), guided_tree=method, samples=300)
    problem = state_mission(scene, seed, params)
    growth = grow_guided_tree(problem, params, seed, np.zeros(1, np.bool_))
    return Recording(scene, problem, params, growth)


class Replay:
    """Vertices, groups and expansions of a recording, as plain lists."""

    def __init__(self, recording: Recording) -> None:
        self.scene, self.params = recording.scene, recording.params
        self.method = recording.params.guided_tree
        self.growth = recording.growth
        tree = recording.growth.tree
        self.n = recording.growth.counts["vertices"]
        self.iterations = recording.growth.counts["iterations"]
        self.vertices, self.tours, self.trace = tree.vertices, tree.tours, tree.trace
        self.groups = tree.groups
        self.roadmap = recording.problem.roadmap.arrays
        self.fleet = recording.problem.mission.fleet
        self.routing = with_own_tables(recording.problem.mission.routing)
        self.robots = len(self.scene.robots)
        self.goals = len(self.scene.goals)
        self.joined = np.isfinite(self.roadmap.cost_to_go[0]).any(axis=0)
        self.made: list[list[int]] = [[] for _ in range(self.iterations)]
        for v in range(1, self.n):
            self.made[self.vertices.iteration[v]].append(v)

    def visited(self, v: int) -> tuple[bool, ...]:
        return tuple(bool(x) for x in self.groups.visited[self.vertices.group[v]])

    def tour(self, v: int) -> list[list[int]]:
        return self.tours_of(int(self.vertices.tour[v]))

    def tours_of(self, row: int) -> list[list[int]]:
        moves = self.tours.move[row]
        return [moves[moves[:, 0] == r, 1].tolist() for r in range(self.robots)]

    def region(self, v: int, r: int) -> int:
        """Return the nearest vertex of the roadmap that has a path to a target."""
        apart = self.roadmap.vertex - self.vertices.state[v, r, :2]
        return int(np.where(self.joined, np.hypot(*apart.T), np.inf).argmin())

    def path(self, v: int, r: int, t: int) -> float:
        """Return the energy along the roadmap from a vertex to a target [J]."""
        w = self.region(v, r)
        x, y = self.vertices.state[v, r, :2]
        terrain = self.growth_terrain(x, y)
        field = self.fleet[r]["field"]
        metres = math.inf
        for _ in range(4):
            if w >= 0:
                straight = math.dist(self.roadmap.vertex[w], (x, y)) * terrain
                on = float(self.roadmap.cost_to_go[field, t, w])
                metres = min(metres, straight + on)
                w = int(self.roadmap.successor[field, t, w])
        return metres * float(self.fleet[r]["plain"])

    def growth_terrain(self, x: float, y: float) -> float:
        for area in self.scene.terrain:
            # The planner's terrain is a raster of 0.25 m.
            cell = Point(0.25 * (x // 0.25 + 0.5), 0.25 * (y // 0.25 + 0.5))
            if area.shape.contains(cell):
                return area.multiplier
        return 1.0

    def feasible(self, v: int, row: int) -> bool:
        """Return whether the batteries of a vertex last for a tour."""
        margin = 1.0 + self.params.route_margin
        for r in range(self.robots):
            left = self.vertices.energy[v, r] - self.fleet[r]["reserve"]
            targets = self.tours_of(row)[r]
            if len(targets):
                left -= self.path(v, r, targets[0])
            for a, b in pairwise(targets):
                if a >= self.goals:
                    break
                left -= self.routing.cost[r, a, b] / margin
            if left < -1e-6:
                return False
        return True

    def outline(self, r: int, state: np.ndarray) -> Polygon:
        body = Polygon(self.scene.robots[r].model.footprint_m)
        turned = affinity.rotate(body, state[2], origin=(0, 0), use_radians=True)
        return affinity.translate(turned, state[0], state[1])

    def collision_free(self, state: np.ndarray, slack: float) -> bool:
        """Return whether all margins and limits hold, or nearly do (slack > 0)."""
        x0, y0, x1, y1 = self.scene.bounds
        frame = Polygon([(x0, y0), (x1, y0), (x1, y1), (x0, y1)])
        outlines = [self.outline(r, state[r]) for r in range(self.robots)]
        for r, outline in enumerate(outlines):
            low, high, psi = self.fleet[r]["limit"][:3]
            if not low - 1e-6 <= state[r, 3] <= high + 1e-6:
                return False
            if abs(state[r, 4]) > psi + 1e-6:
                return False
            need = float(self.fleet[r]["margin"]) - slack
            walls = [item.shape for item in self.scene.obstacles]
            if any(outline.distance(item) < need for item in walls):
                return False
            if not frame.contains(outline):
                return False
            if outline.distance(frame.exterior) < need:
                return False
            for other in outlines[:r]:
                if outline.distance(other) < float(self.fleet[r]["spacing"]) - slack:
                    return False
        return True

    def advanced(self, v: int, control: np.ndarray) -> np.ndarray:
        """Return the composite state one step after a vertex."""
        after = np.empty((self.robots, 5))
        for r in range(self.robots):
            robot = self.fleet[r]
            after[r] = STEP(
                self.vertices.state[v, r],
                control[r],
                float(robot["wheelbase"]),
                self.params.dt_s,
            )
        return after


@pytest.fixture(scope="package")
def recording() -> Recording:
    """Return a run whose trace is checked."""
    return record(3)


@pytest.fixture(scope="package")
def replay(recording: Recording) -> Replay:
    """Return that run for a check in plain Python."""
    return Replay(recording)


@pytest.fixture
def recorded() -> Callable[..., Recording]:
    """Return the maker of recordings."""
    return record


@pytest.fixture
def mission() -> dict[str, Any]:
    """Return the document of the mission."""
    return MISSION
