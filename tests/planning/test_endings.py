"""Every way in which planning ends: one mission each, through the public doors."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

import mrmg
from mrmg.cli.main import main
from mrmg.errors import ExitCode, SceneError
from mrmg.planning import PlannerParams, endings
from mrmg.planning.assembly import Refusal
from mrmg.planning.attempt import Attempt, Request
from mrmg.planning.endings import listed
from mrmg.planning.problem.problem import Problem
from mrmg.plans import PlanStatus
from mrmg.scene.loading import dump_scene
from mrmg.scene.types import Scene

MakeScene = Callable[..., Scene]

RING = {
    "id": "ring",
    "polygon": [[12, 5], [20, 5], [20, 15], [12, 15]],
    "holes": [[[13, 6], [19, 6], [19, 14], [13, 14]]],
    "height": 1,
}
EXIT_CODES = {
    PlanStatus.SOLVED: ExitCode.OK,
    PlanStatus.INFEASIBLE: ExitCode.INFEASIBLE,
    PlanStatus.TIMEOUT: ExitCode.OUT_OF_BUDGET,
    PlanStatus.NO_PLAN_FOUND: ExitCode.OUT_OF_BUDGET,
}

STATUSES = {
    PlanStatus.SOLVED: {"SOLVED"},
    PlanStatus.INFEASIBLE: {
        "GOAL_CUT_OFF",
        "GOAL_OUT_OF_ENERGY",
        "FINISH_CUT_OFF",
        "NO_ROOM",
        "FINISH_OUT_OF_ENERGY",
        "FINISHES_CROWDED",
        "FINISHES_IN_STATION",
        "NO_TOURS",
        "TOO_LATE",
        "NO_TIMELY_TOURS",
    },
    PlanStatus.TIMEOUT: {"BUDGET_FOR_ROADMAP", "BUDGET_OVER"},
}
"""Sentences by status; the others belong to NO_PLAN_FOUND."""


def circle(name: str, x: float, y: float, radius: float = 1.5) -> dict[str, Any]:
    return {"id": name, "circle": {"center": [x, y], "radius": radius}}


def car(name: str, x: float, y: float, yaw: float = 0.0, **more: Any) -> dict[str, Any]:
    return {"id": name, "model": "car", "pose": [x, y, yaw], **more}


def ends_at(x: float, y: float, radius: float = 0.5) -> dict[str, Any]:
    return {"circle": {"center": [x, y], "radius": radius}}


def nose_first(x: float, y: float) -> dict[str, Any]:
    """Return a finish that a car comes to eastwards, 1.5 m behind its front."""
    return {**ends_at(x, y, 0.1), "heading": 0.0, "heading_tolerance": 0.1}


def wall_with_gap(gap_m: float) -> list[dict[str, Any]]:
    half_m = 0.25 * (20.0 - gap_m)
    return [
        {"id": name, "box": {"center": [15, y], "size": [0.4, 2 * half_m]}}
        for name, y in (("south", half_m), ("north", 20.0 - half_m))
    ]


SWAP = {
    "bounds": [0, 0, 24, 2.4],
    "goals": [circle("east", 21, 1.2, 1.0), circle("west", 3, 1.2, 1.0)],
    "robots": [
        car("r1", 8, 1.2, finish=ends_at(21, 1.2)),
        car("r2", 16, 1.2, 3.1416, finish=ends_at(3, 1.2)),
    ],
}
"""Two robots that must get past each other where there is no room for it."""

LANE = {
    "bounds": [0, 0, 30, 1.8],
    "goals": [circle("east", 20, 0.9, 0.5)],
    "robots": [car("r1", 8, 0.9, finish={**ends_at(27, 0.9), "heading": 3.1416})],
}
"""A car that must turn round where it is too narrow to."""

NARROW = PlannerParams(trees=1)


@dataclass(frozen=True)
class Row:
    """A mission that ends in one way.

    Attributes:
        ending: name of the sentence in `endings`.
        changes: of the yard.
        words: that the reason holds.
        params: that it takes; without any, the command line is tried, too.
        options: of the command line.
    """

    ending: str
    changes: dict[str, Any]
    words: tuple[str, ...] = ()
    params: PlannerParams | None = None
    options: tuple[str, ...] = field(default=())

    @property
    def status(self) -> PlanStatus:
        return next(
            (status for status, names in STATUSES.items() if self.ending in names),
            PlanStatus.NO_PLAN_FOUND,
        )


ROWS = (
    Row("SOLVED", {}),
    Row(
        "GOAL_CUT_OFF",
        {"obstacles": [RING], "goals": [circle("caged", 16, 10, 1.0)]},
        ("caged",),
    ),
    Row(
        "GOAL_OUT_OF_ENERGY",
        {"battery": {"capacity_m": 10, "reserve": 0.0}},
        ("goal g", "10.5 m of plain ground"),
    ),
    Row(
        "FINISH_CUT_OFF",
        {"obstacles": [RING], "robots": [car("r1", 4, 10, finish=ends_at(16, 10))]},
        ("r1",),
    ),
    Row(
        "NO_ROOM",
        {
            "obstacles": wall_with_gap(3.0),
            "robots": [car("r1", 4, 10, finish=nose_first(14.1, 4))],
        },
        ("the finish of r1", "with the heading wanted there", "heading_tolerance"),
    ),
    Row(
        "LITTLE_ROOM",
        {
            "obstacles": wall_with_gap(3.0),
            "robots": [car("r1", 4, 10, finish=nose_first(13.33, 4))],
        },
        ("the finish of r1", "0.02 m from obstacles", "at least 0.03 m"),
    ),
    Row(
        "FINISH_OUT_OF_ENERGY",
        {
            "goals": [circle("g", 8, 10)],
            "battery": {"capacity_m": 10, "reserve": 0.0},
            "robots": [car("r1", 4, 10, finish=ends_at(26, 10))],
        },
        ("r1", "m of plain ground"),
    ),
    Row(
        "FINISHES_CROWDED",
        {
            "robots": [
                car("r1", 4, 6, finish=ends_at(20, 10, 0.1)),
                car("r2", 4, 14, finish=ends_at(20, 10, 0.1)),
            ]
        },
        ("r1 and r2",),
    ),
    Row(
        "FINISHES_IN_STATION",
        {
            "stations": [circle("s", 20, 10, 4.0) | {"capacity": 1}],
            "robots": [
                car("r1", 4, 6, finish=ends_at(18, 10)),
                car("r2", 4, 14, finish=ends_at(22, 10)),
            ],
        },
        ("r1 and r2", "lie in s"),
    ),
    Row(
        "NO_TOURS",
        {
            "goals": [circle("east", 26, 10), circle("west", 3, 10, 1.0)],
            "robots": [car("r1", 14, 10)],
            "battery": {"capacity_m": 20, "reserve": 0.0},
        },
        ("at most 1 of 2 goals", "% more usable energy", "m of plain ground"),
    ),
    Row("TOO_LATE", {"time_limit": 8}, ("8 s",)),
    Row(
        "NO_TIMELY_TOURS",
        {
            "goals": [circle("east", 27, 10), circle("west", 3, 10)],
            "robots": [
                car("r1", 15, 10),
                car("r2", 15, 5, battery={"capacity_m": 5.0, "reserve": 0.0}),
            ],
            "time_limit": 13,
        },
        ("13 s",),
    ),
    Row(
        "NO_PATH",
        {"obstacles": wall_with_gap(1.2)},
        ("to g", "1.20 m wide near (15.0, 10.0)", "r1"),
    ),
    Row(
        "NO_TOURS_FOUND",
        {
            "goals": [circle("g", 25, 10, 4.5)],
            "battery": {"capacity_m": 16.8, "reserve": 0.0},
        },
        ("leave out g", "% more usable energy"),
    ),
    Row("NO_TOURS_FOUND", {"time_limit": 11.8}, ("limit of 11.8 s", "s longer")),
    Row("LATE", {"time_limit": 13.0}, ("the time limit is 13 s",)),
    Row(
        "NO_PROGRESS",
        SWAP,
        ("no motions", "keep the robots apart", "r1 and r2 meet near", "2.40 m wide"),
        NARROW,
    ),
    Row(
        "REFUSED",
        {
            "goals": [{**circle("g", 15, 10, 1.0), "heading": 3.1416}],
            "battery": {"capacity_m": 12, "reserve": 0.0},
        },
        ("r1 ends", "m of plain ground) short of what its battery must keep"),
    ),
    Row(
        "HEADINGS",
        LANE,
        ("the finish of r1 with the heading wanted", "heading_tolerance"),
        NARROW,
    ),
    Row("BUDGET_FOR_ROADMAP", {}, ("1e-06 s",), options=("--budget", "1e-6")),
    Row("BUDGET_OVER", SWAP, ("2 s",), options=("--budget", "2")),
)


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.ending)
def test_planning_ends_with_its_status_reason_and_exit_code(
    row: Row, yard: MakeScene, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    scene = yard(**row.changes)
    if row.params is not None:
        result = mrmg.plan(scene, params=row.params)
        status, reason = result.status, result.reason
    else:
        path = tmp_path / "scene.yaml"
        path.write_text(dump_scene(scene))
        run = tmp_path / "run"
        code = main(["plan", str(path), "--out", str(run), *row.options])
        planning = json.loads((run / "planning.json").read_text())
        status, reason = PlanStatus(planning["status"]), planning["reason"]
        assert code == EXIT_CODES[status]
        first = capsys.readouterr().out.splitlines()[0]
        assert first == f"yard: {status.value}" + (f"; {reason}" if reason else "")
    assert status is row.status, reason
    assert status.exit_code == EXIT_CODES[status]
    pattern = re.sub(r"\\{[^}]*\\}", ".*", re.escape(getattr(endings, row.ending, "")))
    assert re.fullmatch(pattern, reason)
    assert [word for word in row.words if word not in reason] == []


def test_a_battery_that_lacks_little_does_not_lack_nothing(yard: MakeScene) -> None:
    (row,) = (row for row in ROWS if row.ending == "NO_TOURS")
    least_m = 30.5  # 10 to the edge of one goal, 20.5 on to that of the other one
    battery = {"capacity_m": 0.997 * least_m, "reserve": 0.0}
    reason = mrmg.plan(yard(**{**row.changes, "battery": battery})).reason
    assert reason.endswith("would have to hold at least slightly more usable energy")


def test_the_motions_nearest_to_a_plan_are_told_and_what_stopped_others(
    yard: MakeScene,
) -> None:
    refused = [
        Refusal(missing_J, f"lacks {missing_J:.0f} J") for missing_J in (7, 3, 5)
    ]

    def planner(problem: Problem, request: Request) -> Attempt:
        earlier = Attempt(refused=refused[request.number])
        return Attempt(blocked="r1 is stuck", refused=Refusal(9, "no")).after(earlier)

    params = PlannerParams(trees=len(refused))
    reason = mrmg.plan(yard(), params=params, planner=planner).reason
    told = endings.REFUSED.format(
        refused="lacks 3 J", blocked="; with others, r1 is stuck"
    )
    assert reason == told


def test_every_sentence_has_its_row() -> None:
    sentences = [name for name, one in vars(endings).items() if isinstance(one, str)]
    rows = list(dict.fromkeys(row.ending for row in ROWS[1:]))
    assert rows == [name for name in sentences if name.isupper()]


def test_a_mission_without_robots_is_not_planned(yard: MakeScene) -> None:
    with pytest.raises(SceneError) as caught:
        mrmg.plan(yard(robots=[]))
    assert caught.value.exit_code == ExitCode.INVALID_FILE


def test_only_a_proof_is_called_infeasible_and_only_a_budget_a_timeout() -> None:
    for row in ROWS[1:]:
        proven = row.status is PlanStatus.INFEASIBLE
        assert proven == (row.status.exit_code == ExitCode.INFEASIBLE)
        in_time = "budget" not in getattr(endings, row.ending)
        assert in_time == (row.status is not PlanStatus.TIMEOUT)


def test_lists_in_words() -> None:
    assert listed(["a", "b"]) == "a, b"
    assert listed([str(n) for n in range(11)]).endswith("7 and 3 more")
