"""The lines of a figure are those planning went along."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from insight import Insight, look_inside

from mrmg.errors import UsageError
from mrmg.planning.parameters import PROFILES, GuidedTreeParams, profile_params
from mrmg.scene.loading import load_scene
from mrmg.scene.types import Scene
from mrmg.world.world import World


@pytest.fixture(scope="module")
def scene() -> Scene:
    return load_scene("quickstart")


@pytest.fixture(scope="module", params=PROFILES)
def inside(scene: Scene, request: pytest.FixtureRequest) -> Insight:
    return look_inside(scene, seed=0, params=profile_params(request.param))


def test_edges_of_the_roadmap_are_free_and_cost_what_their_ground_does(
    scene: Scene, inside: Insight
) -> None:
    from shapely import linestrings

    assert np.isfinite(inside.multiplier).all()
    assert inside.multiplier.min() >= 1.0 - 1e-9
    edges = linestrings(inside.roadmap)
    for union in World.from_scene(scene).obstacles:
        assert not any(edge.intersects(union) for edge in edges)
    (mud,) = scene.terrain
    # The planner's terrain is a raster: blurred at the border.
    within = np.array([mud.shape.buffer(-1.0).contains(edge) for edge in edges])
    assert within.any()
    assert inside.multiplier[within].min() >= mud.multiplier - 1e-6


def test_tours_lead_from_the_starts_through_all_goals(
    scene: Scene, inside: Insight
) -> None:
    for robot in scene.robots:
        assert inside.tours[robot.id][0] == pytest.approx(robot.pose[:2])
    points = np.concatenate(list(inside.tours.values()))
    for goal in scene.goals:
        assert goal.region.depth(points).max() > 0.0


def test_the_tree_holds_the_plan(scene: Scene, inside: Insight) -> None:
    for trajectory in inside.trajectories:
        edges = inside.tree[trajectory.robot]
        start = scene.robot(trajectory.robot).pose[:2]
        assert edges[0, 0] == pytest.approx(start)
        # The last vertex of the tree is where the final braking begins.
        nodes = edges[:, 1]
        gaps = np.hypot(*(trajectory.state[:, None, :2] - nodes).T)
        passed = gaps.min(axis=1) < 1e-9
        assert passed[-1]
        assert passed.sum() > 3


def test_failing_to_find_a_plan_is_told(scene: Scene) -> None:
    paper = profile_params("paper")
    small = replace(paper, guided_tree=GuidedTreeParams(iterations=3), trees=2)
    with pytest.raises(UsageError, match="no plan was found in 2 attempts"):
        look_inside(scene, seed=0, params=small)
