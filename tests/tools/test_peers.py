"""The plain baseline, and how peers are compared with mrmg."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import peer_routing
import peers
import pytest
from peer_baseline import plain_plan
from peer_comparison import compared
from peer_legs import leg_of

import mrmg
from mrmg.planning import RoutingProblem, faults_of_tours
from mrmg.planning.routing.instance import RoutingInstance
from mrmg.scene.loading import scene_from_document


def trials(*values: tuple[bool, float, float]) -> list[dict[str, object]]:
    return [
        {"ok": ok, "time_s": time_s, "cost": cost, "why": [] if ok else ["obstacle"]}
        for ok, time_s, cost in values
    ]


def test_a_peer_that_wins_is_named() -> None:
    own = trials((True, 1.0, 10.0), (True, 1.0, 10.0), (False, 1.0, 0.0))
    peer = trials((True, 2.0, 9.0), (True, 2.0, 9.0), (True, 2.0, 9.0))
    row = compared(list(zip(peer, own, strict=True)))
    assert row["better"] == ["success", "cost"]
    assert (row["time_ratio"], row["cost_ratio"]) == (2.0, 0.9)


def test_a_peer_that_fails_is_counted_by_cause() -> None:
    own = trials((True, 1.0, 10.0), (True, 1.0, 10.0))
    row = compared(list(zip(trials((False, 0.1, 5.0)) * 2, own, strict=True)))
    assert row["ok"] == 0
    assert row["failures"] == {"obstacle": 2}
    assert row["better"] == []
    assert row["cost_ratio"] is None


def test_trials_of_another_version_of_a_peer_are_made_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made: list[str] = []

    def solve() -> dict[str, object]:
        made.append("solved")
        return trials((True, 1.0, 10.0))[0]

    case = peers.Case(peer="mrmg", problem="missions", instance="a", solve=solve)
    monkeypatch.setattr(peers, "chosen_cases", lambda options: [case])
    monkeypatch.setattr(sys, "argv", ["peers", "--output", str(tmp_path / "rows")])
    counts = []
    for found in ("1.0", "1.0", "1.1"):
        monkeypatch.setattr(peers, "version", lambda name, found=found: found)
        assert peers.main() == 0
        counts.append(len(made))
    assert counts == [1, 1, 2]


def test_the_baseline_does_missions_without_obstacles() -> None:
    scene = mrmg.load_scene("quickstart")
    document = {**scene.document, "terrain": []}
    robots = [document["robots"][0]]
    free = scene_from_document(
        {**document, "obstacles": [], "robots": robots}, source="free"
    )
    plan = plain_plan(free)
    assert mrmg.verify(free, plan).violations == ()
    assert "s1" in plan.tours["r1"]  # its battery is too small to do without


def test_the_baseline_does_not_see_obstacles() -> None:
    scene = mrmg.load_scene("quickstart")
    verdict = mrmg.verify(scene, plain_plan(scene))
    assert {found.kind.value for found in verdict.violations} == {"obstacle"}


def test_a_solvers_matrix_has_start_nodes_and_end() -> None:
    legs = np.array([[[0.0, 2.0], [2.0, 0.0]]])
    problem = RoutingProblem.of(
        RoutingInstance(
            goals=1,
            distance=legs,
            start_distance=np.array([[3.0, 5.0]]),
            plain=np.ones(1),
            energy=np.full(1, 9.0),
            capacity=np.full(1, 9.0),
            reserve=np.zeros(1),
            finish_distance=np.array([[1.0, 4.0, 7.0]]),
        ).arrays
    )
    found = peer_routing.matrix(problem, 0, [0, 1])
    assert found[0].tolist() == [0.0, 3.0, 5.0, 7.0]
    assert found[1].tolist() == [0.0, 0.0, 2.0, 1.0]
    routing = peer_routing.routing_of(problem, [[0]])
    assert routing.cost_J == pytest.approx(4.0)
    assert list(faults_of_tours(problem, routing)) == []


@pytest.mark.slow
def test_a_leg_ends_at_rest_where_the_verifier_has_it() -> None:
    scene, leg = leg_of("quickstart, 2 cars")
    states = leg.start()
    assert leg.clear(states)
    assert leg.miss_m(states) > leg.radius_m
    states[:, :2] = leg.centres
    assert leg.miss_m(states) == 0.0
    states[0, :2] = states[1, :2]
    assert not leg.clear(states)
    faster = np.tile([[0.5, 0.1]], (20, 2, 1))  # half a metre a second more, steering
    states = leg.start()
    for control in faster:
        leg.advance(states, control.ravel())
    controls = np.concatenate([faster, leg.braking(states)])
    verdict = mrmg.verify(scene, leg.plan(controls))
    assert {found.kind.value for found in verdict.violations} == {"finish"}
