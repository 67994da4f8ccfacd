"""The planners of this package keep the contract that others are held to."""

from __future__ import annotations

from dataclasses import replace

from mrmg.planning import Planner
from mrmg.planning.parameters import GuidedTreeParams, paper_params
from mrmg.planning.planners import PLANNERS
from mrmg.testing import PlannerContract


class TestPathFollowing(PlannerContract):
    def planner(self) -> Planner:
        return PLANNERS["path_following"]


class TestGuidedTree(PlannerContract):
    params = replace(
        paper_params(),
        profile="default",
        samples=500,
        guided_tree=GuidedTreeParams(iterations=30_000),
    )

    def planner(self) -> Planner:
        return PLANNERS["guided_tree"]
