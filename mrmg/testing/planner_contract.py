"""What every planner must keep."""

from __future__ import annotations

import threading
from dataclasses import asdict, replace
from typing import Any

import numpy as np

from mrmg.planning.attempt import Attempt, Request
from mrmg.planning.parameters import PlannerParams
from mrmg.planning.planner import plan_mission
from mrmg.planning.planners import Planner
from mrmg.planning.problem.problem import Problem, state_mission
from mrmg.planning.routers import find_router
from mrmg.plans import Plan, PlanStatus
from mrmg.scene.loading import scene_from_document
from mrmg.scene.types import Scene
from mrmg.verification.verify import verify


def sample_scene(**changes: Any) -> Scene:
    """Return a yard of 30 x 20 m with two cars and two goals.

    Args:
        changes: entries of the scene file to replace.
    """
    document = {
        "format": 1,
        "name": "yard",
        "bounds": [0, 0, 30, 20],
        "goals": [
            {"id": "g1", "circle": {"center": [25, 15], "radius": 1.5}},
            {"id": "g2", "circle": {"center": [25, 5], "radius": 1.5}},
        ],
        "battery": {"capacity_m": 120},
        "robots": [
            {"id": "r1", "model": "car", "pose": [4, 5, 0]},
            {"id": "r2", "model": "car", "pose": [4, 15, 0]},
        ],
    }
    return scene_from_document({**document, **changes}, source="yard")


class PlannerContract:
    """Tests of a planner; subclasses return it from `planner`.

    Attributes:
        params: parameters that it plans with.
        patience_s: longest time that an attempt may go on after it was halted. It is
            generous: a planner that passes ends within a second on a quiet machine.
    """

    params = PlannerParams(samples=500, improvements=0)
    patience_s = 30.0

    def planner(self) -> Planner:
        """Return the planner to be tested."""
        raise NotImplementedError("return your planner here")

    def scenes(self) -> dict[str, Scene]:
        """Return missions, all of which the planner must solve, by what they need."""
        shed = {"id": "shed", "box": {"center": [15, 10], "size": [5, 12]}}
        mud = {"box": {"center": [14, 5], "size": [8, 8]}, "multiplier": 3}
        station = {"id": "s", "circle": {"center": [15, 17], "radius": 1.5}}
        return {
            "open ground": sample_scene(),
            "an obstacle and terrain": sample_scene(obstacles=[shed], terrain=[mud]),
            "recharging": sample_scene(
                stations=[station],
                battery={"capacity_m": 40},
                robots=[{"id": "r1", "model": "car", "pose": [4, 10, 0]}],
            ),
        }

    def hopeless(self) -> Scene:
        """Return a mission that has no solution."""
        return sample_scene(battery={"capacity_m": 6})

    def plan(self, scene: Scene, seed: int = 0, workers: int = 1) -> Plan:
        """Return the plan of a scene, which there must be."""
        result = plan_mission(
            scene,
            seed=seed,
            params=self.params,
            planner=self.planner(),
            workers=workers,
        )
        assert result.plan is not None, f"no plan: {result.status.value}"
        return result.plan

    def attempt(self, scene: Scene, halt: np.ndarray) -> tuple[Problem, Attempt]:
        """Return a problem and what one attempt at it gave."""
        problem = state_mission(scene, 0, self.params)
        router = find_router(self.params.router)
        request = Request(params=self.params, router=router, seed=0, halt=halt)
        return problem, self.planner()(problem, request)

    def test_plans_pass_the_verifier(self) -> None:
        """No collision, no limit exceeded, every goal visited, batteries kept."""
        for name, scene in self.scenes().items():
            for seed in range(2):
                violations = verify(scene, self.plan(scene, seed)).violations
                messages = [violation.message for violation in violations]
                assert not messages, f"{name}, seed {seed}: {messages}"

    def test_the_same_seed_gives_the_same_plan(self) -> None:
        """Whatever was planned in between, and whatever the number of threads."""
        scenes = self.scenes()
        for name, scene in scenes.items():
            first = self.plan(scene, seed=3)
            self.plan(next(iter(scenes.values())), seed=4)
            for workers in (1, 2):
                again = self.plan(scene, seed=3, workers=workers)
                assert again.digest == first.digest, f"{name}: plans differ"

    def test_plans_of_an_attempt_get_better(self) -> None:
        """Each is better by the scene's objective than the one before."""
        for name, scene in self.scenes().items():
            problem, found = self.attempt(scene, np.zeros(1, np.bool_))
            ranks = [problem.preference.rank(plan) for plan in found.plans]
            strictly = all(b < a for a, b in zip(ranks, ranks[1:], strict=False))
            assert strictly, f"{name}: plans of one attempt do not get better"
            times = list(found.found_at)
            assert len(times) in (0, len(ranks)), f"{name}: not a time for each plan"
            assert times == sorted(times), f"{name}: times are not in order"

    def test_the_problem_is_not_changed(self) -> None:
        """Problems are shared by all attempts."""
        for name, scene in self.scenes().items():
            problem = state_mission(scene, 0, self.params)
            before = asdict(problem)
            router = find_router(self.params.router)
            request = Request(params=self.params, router=router, seed=0)
            self.planner()(problem, request)
            changed = f"{name}: the problem was changed"
            np.testing.assert_equal(asdict(problem), before, changed)

    def test_a_mission_without_a_solution_has_no_plan(self) -> None:
        """It is no error, and an attempt at it ends by itself."""
        result = plan_mission(
            self.hopeless(),
            params=replace(self.params, budget_s=self.patience_s),
            planner=self.planner(),
        )
        assert result.plan is None
        ended = result.status is not PlanStatus.TIMEOUT
        assert ended, "the attempt went on until the budget was over"

    def test_a_halted_attempt_ends(self) -> None:
        """Whether it is halted before it begins, or while it is under way."""
        for scene in (*self.scenes().values(), self.hopeless()):
            for halted_after_s in (0.0, 0.2):
                halt = np.array([halted_after_s == 0.0])
                work = threading.Thread(
                    target=self.attempt, args=(scene, halt), daemon=True
                )
                work.start()
                work.join(halted_after_s)
                halt[0] = True
                work.join(self.patience_s)
                assert not work.is_alive(), "a halted attempt goes on"
