"""Proofs never contradict a plan, however little the mission leaves to it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

import mrmg
from mrmg.energy.metering import battery_profile
from mrmg.planning import PlannerParams
from mrmg.planning.diagnosis import Proofs
from mrmg.plans import Plan
from mrmg.scene.loading import load_scene, scene_from_document
from mrmg.scene.types import Scene

SCENES = Path(__file__).parents[1] / "scenes"
UNSOLVABLE = ("goal_enclosed", "goal_out_of_energy")
SOLVED = [path for path in sorted(SCENES.glob("*.yaml")) if path.stem not in UNSOLVABLE]


def tightest(scene: Scene, plan: Plan) -> Scene:
    """Return the mission with the least start energies and time that a plan needs."""
    document = {**scene.document, "time_limit": plan.makespan_s}
    robots = []
    for entry, robot in zip(document["robots"], scene.robots, strict=True):
        if robot.battery.takes_time_to_fill:
            robots.append(entry)  # with less at the start it would not be full later
            continue
        trajectory = plan.trajectory(robot.id)
        own = [visit for visit in plan.visits if visit.robot == robot.id]
        content_J = battery_profile(scene, trajectory, own)
        stations = [visit for visit in own if visit.kind == "station"]
        until = stations[0].step if stations else len(content_J)
        arrivals_J = [visit.energy_J for visit in stations[:1]]
        least_J = min([*content_J[:until], *arrivals_J])
        start_J = robot.battery.start_J - (least_J - robot.battery.reserve_J)
        start = min(1.0, (start_J + 1e-3) / robot.battery.capacity_J)
        robots.append({**entry, "start_energy": start})
    return scene_from_document({**document, "robots": robots}, source="tightest")


@pytest.mark.parametrize(
    "source",
    [*SOLVED, *(pytest.param(n, marks=pytest.mark.slow) for n in ("mixed", "hills"))],
    ids=lambda source: getattr(source, "stem", source),
)
def test_no_proof_contradicts_a_plan(source: Path | str) -> None:
    scene = load_scene(source)
    plan = mrmg.plan(scene, params=PlannerParams(improvements=0)).plan
    assert plan is not None
    assert Proofs(scene, 0.1).reason(tours_missing=True) is None
    tight = tightest(scene, plan)
    moved = replace(plan, scene_digest=tight.digest)
    broken = [one for one in mrmg.verify(tight, moved).violations]
    # Visits are stated with what batteries held on arrival, which is less now.
    assert {one.kind.value for one in broken} <= {"visit"}, broken
    assert Proofs(tight, 0.1).reason(tours_missing=True) is None
