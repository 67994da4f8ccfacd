"""What must not change a plan or its bound, and which way a bound may change.

That a mission may lie anywhere is in `test_frame`; that refinement never makes a plan
worse, in `test_refine`.
"""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from shapely.geometry import Point, Polygon, box

import mrmg
from mrmg.planning import PlannerParams, plan_mission
from mrmg.planning.bound.bound import lower_bound_J
from mrmg.planning.bound.clearance import blocked_ground
from mrmg.planning.bound.exact_tours import exact_routing
from mrmg.planning.bound.geodesic import Ground
from mrmg.planning.routing.instance import RoutingInstance
from mrmg.plans import Plan
from mrmg.scene.loading import scene_from_document
from mrmg.scene.types import Scene

SCENES = Path(__file__).parents[1] / "scenes"
PARAMS = PlannerParams(samples=300, improvements=0)

FEW = settings(
    max_examples=4,
    phases=(Phase.explicit, Phase.generate),
)
"""A bound takes a good part of a second."""

CELLS_SHARE = 5e-3
"""By how much less than it might a bound certifies on its cells, as a share. Each bound
holds for certain; but a field is certified by division where it is too steep, and what
an obstacle takes away in this manner may be a little more than it adds to the way. That
neither cells nor tours get cheaper, on either side of it, holds exactly."""

YARD: dict[str, Any] = {
    "format": 1,
    "name": "yard",
    "bounds": [0, 0, 40, 30],
    "goals": [
        {"id": "g1", "circle": {"center": [34, 6], "radius": 1.5}},
        {"id": "g2", "circle": {"center": [30, 24], "radius": 1.5}},
        {"id": "g3", "polygon": [[4, 22], [8, 22], [8, 26], [4, 26]]},
    ],
    "stations": [{"id": "s1", "circle": {"center": [20, 15], "radius": 2}}],
    "battery": {"capacity_m": 60},
    "robots": [
        {"id": "r1", "model": "car", "pose": [4, 4, 0]},
        {"id": "r2", "model": "car", "pose": [4, 12, 0]},
    ],
}
"""Room for obstacles between all that must stay free."""


MUD = {"polygon": [[10, 2], [30, 2], [26, 20], [14, 12]], "multiplier": 2.5}


def scene_of(document: dict[str, Any]) -> Scene:
    return scene_from_document(document, source="invariants")


def plan_of(scene: Scene, seed: int = 0) -> Plan:
    result = plan_mission(scene, seed=seed, params=PARAMS)
    assert result.plan is not None, result.reason
    return result.plan


def bound_of(**changes: Any) -> float:
    return _bound_J(json.dumps({**YARD, **changes}))


@cache
def _bound_J(document: str) -> float:
    return lower_bound_J(scene_of(json.loads(document)))


# --- names -------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["two_swap", "one_charger"])
def test_permuting_ids_permutes_the_plan(name: str) -> None:
    """Names are swapped, r1 for r2 and so on; every number stays."""
    scene = mrmg.load_scene(SCENES / f"{name}.yaml")
    document = dict(scene.document)
    old, new = [], []
    for kind in ("robots", "goals", "stations"):
        ids = [entry["id"] for entry in document.get(kind) or []]
        old, new = old + ids, new + ids[::-1]
    named = dict(zip(old, new, strict=True))
    for kind in ("robots", "goals", "stations"):
        document[kind] = [
            {**entry, "id": named[entry["id"]]} for entry in document.get(kind) or []
        ]
    plan, other = plan_of(scene), plan_of(scene_of(document))
    assert named != dict(zip(old, old, strict=True))
    assert other.cost_J == plan.cost_J
    assert other.tours == {
        named[robot]: tuple(named[target] for target in tour)
        for robot, tour in plan.tours.items()
    }
    for one, two in zip(plan.trajectories, other.trajectories, strict=True):
        assert two.robot == named[one.robot]
        assert two.state.tobytes() == one.state.tobytes()


def test_the_order_of_the_file_does_not_change_the_bound() -> None:
    lists = ("goals", "stations", "robots")
    reordered = bound_of(**{key: YARD[key][::-1] for key in lists})
    assert reordered == pytest.approx(bound_of(), rel=1e-6)


# --- bounds ------------------------------------------------------------------------


def obstacles() -> st.SearchStrategy[list[dict[str, Any]]]:
    """Return boxes and triangles that leave starts and targets of the yard free."""
    kept = [
        *(Point(goal["circle"]["center"]).buffer(3) for goal in YARD["goals"][:2]),
        box(1, 19, 11, 29),
        Point(20, 15).buffer(3.5),
        *(Point(robot["pose"][:2]).buffer(3) for robot in YARD["robots"]),
    ]

    def entry(x: float, y: float, size: tuple[float, float], cut: bool) -> Any:
        corners = [[x, y], [x + size[0], y], [x + size[0], y + size[1]]]
        shape = corners if cut else [*corners, [x, y + size[1]]]
        if any(Polygon(shape).intersects(place) for place in kept):
            return None
        return {"polygon": shape}

    side = st.integers(2, 24).map(lambda n: 0.5 * n)
    one = st.builds(
        entry,
        st.integers(0, 70).map(lambda n: 0.5 * n),
        st.integers(0, 50).map(lambda n: 0.5 * n),
        st.tuples(side, side),
        st.booleans(),
    ).filter(lambda item: item is not None)
    return st.lists(one, min_size=1, max_size=4)


@settings(FEW, suppress_health_check=[HealthCheck.filter_too_much])
@given(before=obstacles(), more=obstacles())
def test_more_obstacles_never_lower_the_bound(
    before: list[dict[str, Any]], more: list[dict[str, Any]]
) -> None:
    fewer = bound_of(obstacles=before)
    assert fewer >= bound_of() * (1.0 - CELLS_SHARE)
    both = bound_of(obstacles=[*before, *more])
    assert both >= fewer * (1.0 - CELLS_SHARE)


@settings(FEW, max_examples=20)
@given(before=obstacles(), more=obstacles())
def test_more_obstacles_never_lower_a_price(
    before: list[dict[str, Any]], more: list[dict[str, Any]]
) -> None:
    """Exactly: a cell is blocked if the obstacles together cover it."""
    fewer, both = (
        Ground.of(
            scene, blocked_ground(scene, scene.robots[0]), cell_m=0.5, step_m=0.2
        ).price
        for scene in (
            scene_of({**YARD, "terrain": [MUD], "obstacles": entries})
            for entries in (before, [*before, *more])
        )
    )
    assert (both >= fewer).all()


@settings(FEW, max_examples=50)
@given(seed=st.integers(0, 1000), costlier=st.lists(st.integers(0, 83), max_size=20))
def test_costlier_legs_never_make_tours_cheaper(seed: int, costlier: list[int]) -> None:
    """Exactly, as tours are the least of all and not sought by chance."""
    rng = np.random.default_rng(seed)
    distance = rng.uniform(1.0, 30.0, (2, 6, 6))
    start_distance = rng.uniform(1.0, 30.0, (2, 6))
    raised = np.concatenate([distance.ravel(), start_distance.ravel()])
    raised[np.array(costlier, int)] *= rng.uniform(1.0, 1.5, len(costlier))
    problems = [
        RoutingInstance(
            goals=4,
            distance=legs[:72].reshape(2, 6, 6),
            start_distance=legs[72:].reshape(2, 6),
            plain=np.ones(2),
            energy=np.array([20.0, 30.0]),
            capacity=np.array([25.0, 30.0]),
            reserve=np.ones(2),
        ).arrays
        for legs in (np.append(distance, start_distance), raised)
    ]
    before, after = (exact_routing(problem) for problem in problems)
    assert before is not None
    assert after is not None
    assert after.cost_J >= before.cost_J


def test_an_obstacle_in_the_way_raises_the_bound() -> None:
    wall = {"polygon": [[22, 0], [25, 0], [25, 28], [22, 28]]}
    assert bound_of(obstacles=[wall]) > 1.05 * bound_of()


@settings(FEW)
@given(
    multiplier=st.floats(1.0, 8.0),
    x=st.floats(0.0, 30.0),
    y=st.floats(0.0, 20.0),
)
def test_rougher_ground_never_lowers_the_bound(
    multiplier: float, x: float, y: float
) -> None:
    rough = {
        "polygon": [[x, y], [x + 10, y], [x + 10, y + 10], [x, y + 10]],
        "multiplier": multiplier,
    }
    assert bound_of(terrain=[rough]) >= bound_of() * (1.0 - CELLS_SHARE)


@settings(FEW)
@given(share=st.floats(0.5, 1.0), fewer=st.integers(1, 2))
def test_more_energy_and_fewer_goals_never_raise_the_bound(
    share: float, fewer: int
) -> None:
    smaller = bound_of(battery={"capacity_m": 60 * share})
    assert smaller >= bound_of() * (1.0 - CELLS_SHARE)
    some = bound_of(goals=YARD["goals"][:-fewer])
    assert some <= bound_of() * (1.0 + CELLS_SHARE)


@pytest.mark.parametrize("seed", range(3))
def test_no_plan_undercuts_the_bound(seed: int) -> None:
    plan = plan_of(scene_of(YARD), seed)
    assert bound_of() <= plan.cost_J < 1.5 * bound_of()
