"""Finding a plan for the rest of a mission, or for as much of it as can be had."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from mrmg import seeding
from mrmg.errors import SceneError
from mrmg.planning import PlannerParams, plan_mission
from mrmg.planning.feasibility import impossible_goals
from mrmg.plans import Plan
from mrmg.scene.types import Scene
from mrmg.supervision.remaining import FleetCondition, is_over, remaining_scene
from mrmg.supervision.stays import OngoingStay, keeps_stays
from mrmg.verification.verify import verify

DRAWS = 2
"""Seeds a new plan is tried with."""

RESERVES = (1.25, 1.0, 0.5, 0.0)
"""Shares of the reserve a new plan may be asked to keep, in order. What was measured is
uncertain, so that a bit more is asked for at first."""

_GIVEN_UP_AT_ONCE = 3
"""One in this many goals is given up when no plan is found and no proof states why."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Replan:
    """The outcome of planning the rest of a mission.

    Attributes:
        scene: what is left of the mission without the goals given up; None where no
            goal is.
        plan: of that scene; None if nothing more can be done.
        reserve_share: share of the reserves the plan keeps.
        given_up: why goals are left out, by id.
        reason: why there is no plan; "" with one.
        time_s: simulated time at which the fleet stood.
        rolling_factor: by which the rolling resistance of each robot was found to
            differ from its model's.
    """

    scene: Scene | None = None
    plan: Plan | None = None
    reserve_share: float = 1.0
    given_up: Mapping[str, str] = field(default_factory=dict)
    reason: str = ""
    time_s: float = 0.0
    rolling_factor: Mapping[str, float] = field(default_factory=dict)

    def to_json(self) -> dict[str, Any]:
        """Return the outcome as JSON data; the scene as its document."""
        plan = self.plan
        return {
            "time_s": self.time_s,
            "rolling_factor": dict(self.rolling_factor),
            "reserve_share": self.reserve_share,
            "given_up": dict(self.given_up),
            "reason": self.reason,
            "scene": self.scene.document if self.scene else None,
            "plan": {
                "seed": plan.seed,
                "cost_J": plan.cost_J,
                "makespan_s": plan.makespan_s,
                "tours": {robot: list(tour) for robot, tour in plan.tours.items()},
            }
            if plan
            else None,
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class Replanner:
    """Plans the rests of one mission.

    Attributes:
        scene: the mission as it began.
        seed: of all random streams.
        planner: parameters of the planner.
    """

    scene: Scene
    seed: int
    planner: PlannerParams

    def replan(self, condition: FleetCondition, number: int) -> Replan:
        """Return the outcome of the `number`th new planning.

        If no plan keeps the reserves they may be used: that is what they are for. If
        none keeps the time limit, goals are better visited late than not at all. Goals
        for which there is no plan even then are given up: those proven impossible, else
        some that are farthest from all robots.
        """
        given_up: dict[str, str] = {}
        draws = DRAWS
        try:
            while True:
                left = replace(condition, visited=condition.visited | set(given_up))
                tried = self._tried(left, number, draws)
                if tried.plan is not None or tried.scene is None:
                    reasons = "; ".join(dict.fromkeys(given_up.values()))
                    reason = "" if tried.plan else reasons
                    return replace(tried, given_up=given_up, reason=reason)
                if not tried.scene.goals:
                    reason = "no plan was found that ends where the robots must end"
                    return Replan(given_up=given_up, reason=reason)
                given_up |= tried.given_up or _farthest_goals(tried.scene)
                # What is hopeless in full need not be tried as hard in part.
                draws = 1
        except SceneError as error:
            reason = "; ".join(fault.message for fault in error.faults)
            return Replan(given_up=given_up, reason=reason)

    def _tried(self, left: FleetCondition, number: int, draws: int) -> Replan:
        """Return a plan for all goals that are left, or those proven impossible."""
        if is_over(self.scene, left):
            return Replan()
        last = remaining_scene(
            self.scene, left, reserve_share=RESERVES[-1], timely=False
        )
        limited = math.isfinite(self.scene.time_limit_s)
        # Stays under way are brought to their end, or else begun anew.
        tries = [
            (share, timely, stays)
            for timely in ((True, False) if limited else (True,))
            for share in RESERVES
            for stays in ((left.stays, {}) if left.stays else ({},))
        ]
        for share, timely, stays in tries:
            held = replace(left, stays=stays)
            rest = remaining_scene(self.scene, held, reserve_share=share, timely=timely)
            plan = self._plan(rest, number, draws, stays)
            if plan is not None:
                return Replan(scene=rest, plan=plan, reserve_share=share)
            first = (share, timely, stays) == tries[0]
            impossible = impossible_goals(last) if first else {}
            if impossible:
                return Replan(scene=last, given_up=impossible)
        return Replan(scene=last)

    def _plan(
        self, rest: Scene, number: int, draws: int, stays: Mapping[str, OngoingStay]
    ) -> Plan | None:
        """Return a plan that the verifier accepts and that keeps stays, or None."""
        for draw in range(draws):
            seed = seeding.stream_seed(self.seed, "replan", number, draw)
            plan = plan_mission(rest, seed=seed, params=self.planner).plan
            if plan is None or not keeps_stays(plan.visits, stays):
                continue
            if verify(rest, plan).ok:
                return plan
        return None


def _farthest_goals(rest: Scene) -> dict[str, str]:
    """Return some goals that are farthest from all robots, as given up."""
    starts = np.array([robot.pose[:2] for robot in rest.robots])
    distance_m = {
        goal.id: float(np.hypot(*(starts - goal.region.center).T).min())
        for goal in rest.goals
    }
    count = math.ceil(len(distance_m) / _GIVEN_UP_AT_ONCE)
    farthest = sorted(distance_m, key=lambda name: -distance_m[name])[:count]
    return {name: f"no plan was found that visits goal {name}" for name in farthest}
