"""Proofs that no tours exist, against all tours there are and against plans."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import mrmg
from mrmg.planning import PlannerParams
from mrmg.planning.bound import exact_tours, tour_existence
from mrmg.planning.bound.bound import lower_bound_J
from mrmg.planning.bound.tour_existence import (
    NoTours,
    proof_of,
    proof_of_no_tours,
    visits,
)
from mrmg.planning.feasibility import proof_of_infeasibility
from mrmg.planning.routing._nrpa_kernels import RoutingArrays
from mrmg.planning.routing.instance import RoutingInstance
from mrmg.scene.loading import load_scene, scene_from_document
from mrmg.scene.types import Scene

# --- against all tours there are ------------------------------------------------------


def random_fleet(
    seed: int, *, closed: bool = False, metric: bool = False
) -> RoutingArrays:
    """Return a mission of 4 goals, 2 stations and 2 robots.

    Args:
        seed: draws everything.
        closed: whether robots must end somewhere.
        metric: whether legs obey the triangle inequality.
    """
    rng = np.random.default_rng(seed)
    goals, stations, robots = 4, 2, 2
    targets = goals + stations
    leg = rng.uniform(1.0, 10.0, (robots, targets + robots, targets + robots))
    leg[rng.random(leg.shape) < 0.1] = np.inf
    if metric:
        point = rng.uniform(0.0, 10.0, (targets + robots, 2))
        leg[:] = np.hypot(*(point[:, None] - point[None]).transpose(2, 0, 1))
    capacity = rng.uniform(4.0, 14.0, robots) * (0.9 if metric and closed else 0.6)
    last = rng.uniform(1.0, 8.0, (robots, targets + 1)) if closed else None
    if metric and closed:
        back = [[*leg[r, :targets, targets + r], 0.0] for r in range(robots)]
        last = np.array(back)
    return RoutingInstance(
        goals=goals,
        distance=leg[:, :targets, :targets],
        start_distance=np.stack([leg[r, targets + r, :targets] for r in range(robots)]),
        plain=np.ones(robots),
        energy=rng.uniform(0.5, 1.0, robots) * capacity,
        capacity=capacity,
        reserve=0.1 * capacity,
        finish_distance=last,
    ).arrays


def drives(problem: RoutingArrays, r: int, order: tuple[int, ...], left: float) -> bool:
    """Return whether robot r can visit goals in an order, by any station chain."""
    full = float(problem.capacity[r])

    def ends(
        place: int, left: float, rest: tuple[int, ...], seen: frozenset[int]
    ) -> bool:
        onward = (
            problem.finish[r, place] if not rest else problem.cost[r, place, rest[0]]
        )
        if left - onward >= problem.reserve[r] and (
            not rest or ends(rest[0], left - onward, rest[1:], frozenset())
        ):
            return True
        return any(
            left - problem.cost[r, place, s] >= problem.reserve[r]
            and ends(s, full, rest, seen | {s})
            for s in range(problem.goals, problem.cost.shape[2])
            if s not in seen
        )

    return ends(problem.cost.shape[2], left, order, frozenset())


def shares(goals: int) -> Iterator[tuple[tuple[int, ...], ...]]:
    """Yield every division of goals among two robots in every order."""
    for mask in range(1 << goals):
        one = [g for g in range(goals) if mask >> g & 1]
        other = [g for g in range(goals) if not mask >> g & 1]
        yield from itertools.product(
            itertools.permutations(one), itertools.permutations(other)
        )


@pytest.mark.parametrize("closed", [False, True], ids=["open", "closed"])
@pytest.mark.parametrize("metric", [False, True], ids=["any legs", "metric"])
def test_tours_exist_where_one_of_all_can_be_driven(closed: bool, metric: bool) -> None:
    """With legs that are no metric, fewer goals may be harder, which is left out."""
    verdicts = []
    for seed in range(60):
        problem = random_fleet(seed, closed=closed, metric=metric)
        visited = visits(problem, np.arange(4))
        some = any(
            all(
                drives(problem, r, order, float(problem.energy[r]))
                for r, order in enumerate(division)
            )
            for division in shares(4)
        )
        assert visited[-1] == some if metric else visited[-1] or not some
        verdicts.append(some)
    assert 5 < sum(verdicts) < 55


def test_larger_batteries_only_help_and_the_share_is_what_is_missing() -> None:
    checked = 0
    for seed in range(40):
        fleet, goals = random_fleet(seed), np.arange(4)
        if visits(fleet, goals)[-1]:
            continue
        proof = proof_of(fleet, goals)
        assert set(proof.left_out) <= set(proof.goals)
        if np.isfinite(proof.share):
            assert not visits(fleet, goals, 0.999 * proof.share)[-1]
            assert visits(fleet, goals, 1.06 * proof.share + 0.011)[-1]
            checked += 1
    assert checked > 5


# --- against plans --------------------------------------------------------------------


def edited(name: str, **changes: Any) -> Scene:
    document = load_scene(name).document
    return scene_from_document({**document, **changes}, source=name)


def with_capacity(name: str, capacity_m: float, **changes: Any) -> Scene:
    battery = {"capacity_m": capacity_m, "reserve": 0.05}
    return edited(name, battery=battery, **changes)


def home(scene: Scene) -> Scene:
    """Return the mission from which every robot comes back to where it starts."""
    document = scene.document
    robots = [
        {**robot, "finish": {"circle": {"center": robot["pose"][:2], "radius": 1.5}}}
        for robot in document["robots"]
    ]
    return scene_from_document({**document, "robots": robots}, source="home")


def smallest_solved(name: str, sizes_m: list[float], **more: Any) -> float:
    """Return the least battery with which a plan is found that the verifier accepts."""
    least_m = np.inf
    for capacity_m in sizes_m:
        scene = more["edit"](with_capacity(name, capacity_m))
        plan = mrmg.plan(scene, params=PlannerParams(improvements=0)).plan
        if plan is not None and mrmg.verify(scene, plan).ok:
            least_m = min(least_m, capacity_m)
            assert proof_of_no_tours(scene, 0.1) is None
    return least_m


@pytest.mark.parametrize(
    ("name", "edit", "solved_m", "tight"),
    [
        ("quickstart", lambda scene: scene, [30.0], 0.70),
        ("quickstart", home, [44.0, 52.0], 0.55),
        ("diffdrive", lambda scene: scene, [30.0], 0.5),
        pytest.param("hills", lambda s: s, [60.0], 0.5, marks=pytest.mark.slow),
        pytest.param("mixed", lambda s: s, [44.0], 0.6, marks=pytest.mark.slow),
        pytest.param("scene4", lambda s: s, [116.0], 0.8, marks=pytest.mark.ci),
    ],
)
def test_what_is_solved_is_never_proven_impossible_and_little_less_is(
    name: str, edit: Any, solved_m: list[float], tight: float
) -> None:
    least_m = smallest_solved(name, solved_m, edit=edit)
    assert np.isfinite(least_m)
    scene = edit(with_capacity(name, tight * least_m))
    proof = proof_of_no_tours(scene, 0.1)
    assert proof is not None
    assert proof.share > 0.0


@pytest.mark.parametrize("name", ["quickstart", "diffdrive", "hills"])
def test_an_infinite_bound_of_energy_is_proven_by_tours_too(name: str) -> None:
    proven = []
    for capacity_m in (12.0, 21.0):
        scene = with_capacity(name, capacity_m)
        infinite = np.isinf(lower_bound_J(scene, cells=2000))
        proven.append(proof_of_no_tours(scene, 0.1) is not None)
        assert proven[-1] or not infinite
    assert proven[0]


def test_a_way_home_counts() -> None:
    """16 m there and 16 m back: there is enough in 20 m, there and back in 40 m."""
    goal = {"id": "g", "circle": {"center": [26, 10], "radius": 1.0}}
    finish = {"circle": {"center": [5, 10], "radius": 1.0}}

    def proof(capacity_m: float, **robot: Any) -> NoTours | None:
        document = {
            "format": 1,
            "name": "there",
            "bounds": [0, 0, 40, 20],
            "goals": [goal],
            "battery": {"capacity_m": capacity_m, "reserve": 0.0},
            "robots": [{"id": "r", "model": "car", "pose": [5, 10, 0], **robot}],
        }
        return proof_of_no_tours(scene_from_document(document, source="there"), 0.1)

    assert proof(21.0) is None
    assert proof(19.0) is not None
    back = proof(37.0, finish=finish)  # 20 m there, 19 m back
    assert back is not None
    assert back.left_out == (0,)
    assert back.share == pytest.approx(39.0 / 37.0 - 1.0, abs=0.015)
    assert proof(40.0, finish=finish) is None
    far = proof(10.0, finish={"circle": {"center": [30, 10], "radius": 1.0}})
    assert far is not None
    assert far.homeless == (0,)


def test_a_share_that_nothing_tried_reaches_is_infinite() -> None:
    proof = proof_of_no_tours(with_capacity("quickstart", 0.1), 0.1)
    assert proof is not None
    assert proof.share == np.inf


@pytest.mark.slow
def test_of_many_goals_the_remote_ones_are_tried_together() -> None:
    proof = proof_of_no_tours(with_capacity("scene6", 24.0), 0.1)
    assert proof is not None
    assert len(proof.goals) == 14
    assert proof_of_no_tours(load_scene("scene6"), 0.1) is None


def test_of_large_fleets_fewer_goals_are_tried_together(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Where too many labels are needed nothing is proven, and nothing breaks."""
    scene = with_capacity("scene1", 24.0)
    for module in (exact_tours, tour_existence):
        monkeypatch.setattr(module, "MOST_LABELS", 4000)
    proof = proof_of_no_tours(scene, 0.1)
    assert proof is not None
    assert len(proof.goals) < 14
    monkeypatch.setattr(exact_tours, "MOST_LABELS", 1)
    assert proof_of_no_tours(scene, 0.1) is None


def test_nothing_is_known_of_what_custom_motion_is_charged() -> None:
    """Its steps need not lead as far as the speeds at their ends, which are charged."""
    scene = with_capacity("quickstart", 0.1)
    own = tuple(
        replace(one, model=replace(one.model, motion_model="motion.py"))
        for one in scene.robots
    )
    custom = replace(scene, robots=own)
    assert proof_of_no_tours(scene, 0.1) is not None
    assert proof_of_no_tours(custom, 0.1) is None
    assert proof_of_infeasibility(scene) is not None
    assert proof_of_infeasibility(custom) is None
    assert lower_bound_J(custom) == 0.0
