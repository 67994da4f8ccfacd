"""What there is one of has a singular noun in every message."""

from __future__ import annotations

import re

import pytest

from mrmg.cli import terminal
from mrmg.counted import counted

NOUNS = ("goal", "violation", "contact", "recharge")


def test_numbers_have_their_nouns() -> None:
    assert [counted(n, "tree") for n in range(3)] == ["0 trees", "1 tree", "2 trees"]
    assert counted(1, "vertex", "vertices") == "1 vertex"
    assert counted(2, "vertex", "vertices") == "2 vertices"


@pytest.mark.parametrize("number", [1, 2])
def test_the_terminals_summary_has_them(
    number: int, capsys: pytest.CaptureFixture[str]
) -> None:
    summary = {
        "scene": "yard",
        "seed": 0,
        "status": "solved",
        "mission_ok": True,
        "goals": number,
        "plan": None,
        "verdict": {
            "violations": number,
            "min_obstacle_clearance_m": 1.0,
            "min_robot_distance_m": None,
        },
        "execution": {
            "goals_visited": number,
            "contacts": number,
            "tracking": {"rms_m": 0.0, "max_m": 0.0},
            "realtime_factor": 10.0,
            "events": [],
        },
        "energy": {
            "metered_error_pct": 0.0,
            "measured_error_pct": 0.0,
            "min_charge_fraction": 0.5,
            "recharges": number,
            "balance_residual_pct": None,
        },
    }
    print("\n".join(terminal.summary_lines(summary, "")))
    printed = capsys.readouterr().out
    for noun in NOUNS:
        assert re.search(rf"\b{number} {noun}{'s' * (number > 1)}\b", printed), noun
