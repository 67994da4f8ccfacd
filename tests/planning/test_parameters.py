"""The planner's parameters: refused by name, and fingerprinted."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

import mrmg
from mrmg.errors import UsageError
from mrmg.planning.parameters import PROFILES, PlannerParams, profile_params
from mrmg.planning.routing.routing import RouterParams


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("profile", "fast"),
        ("samples", -1),
        ("neighbours", 0),
        ("dt_s", 0.0),
        ("dt_s", 0.5),
        ("trees", 0),
        ("improvements", -1),
        ("budget_s", 0.0),
        ("budget_s", -3.0),
        ("budget_s", float("inf")),
    ],
)
def test_values_out_of_range_are_refused_by_name(name: str, value: Any) -> None:
    with pytest.raises(UsageError, match=name):
        PlannerParams(**{name: value})


def test_every_wrong_value_is_named_at_once() -> None:
    with pytest.raises(UsageError, match=r"samples.*neighbours"):
        PlannerParams(samples=-1, neighbours=0)


@pytest.mark.parametrize("profile", PROFILES)
def test_profiles_carry_their_name_and_the_budget(profile: str) -> None:
    params = profile_params(profile, budget_s=7.0)
    assert (params.profile, params.budget_s) == (profile, 7.0)


def test_an_unknown_profile_is_refused() -> None:
    with pytest.raises(UsageError, match="profile"):
        profile_params("fast")


def test_the_digest_tells_apart_what_decides_the_plan() -> None:
    """A time limit does not: it only ends the search."""
    base = PlannerParams()
    assert replace(base, budget_s=5.0).digest == base.digest
    others = [
        replace(base, samples=base.samples + 1),
        replace(base, router=RouterParams(rounds=base.router.rounds + 1)),
        profile_params("paper"),
    ]
    assert len({base.digest, *(params.digest for params in others)}) == 4


def test_a_number_of_attempts_is_made_to_the_last() -> None:
    params = profile_params("default", trees=7)
    assert (params.trees, params.improvements, params.budget_s) == (7, 7, None)
    assert params.digest != profile_params("default").digest


def test_only_the_default_profile_refines_and_more_so_with_a_budget() -> None:
    assert profile_params("paper", budget_s=9.0).refinements == 0
    assert profile_params("paper", trees=9).refinements == 0
    plain = profile_params("default").refinements
    assert 0 < plain < profile_params("default", budget_s=9.0).refinements


def test_planner_and_router_are_named_together() -> None:
    scene, guided = mrmg.load_scene("quickstart"), "guided_tree"
    with pytest.raises(UsageError, match="name router nrpa, or plan with path_foll"):
        mrmg.plan(scene, params=PlannerParams(), planner=guided)
    named = {"planner": guided, "router": "nrpa"}
    with pytest.raises(UsageError, match="no margins"):  # the next that is looked at
        mrmg.plan(scene, params=PlannerParams(), margins="wide", **named)
