"""Faults are read as written, and refused with what is allowed."""

from __future__ import annotations

from typing import Any

import pytest

from mrmg.errors import UsageError
from mrmg.scene.types import Scene
from mrmg.supervision.faults import StopFault, checked_faults, parse_fault


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("r2@40s", StopFault(40.0, "r2")),
        ("r2@40", StopFault(40.0, "r2")),
        (" my.robot-1@0.5s ", StopFault(0.5, "my.robot-1")),
        ("r1@1e1s", StopFault(10.0, "r1")),
        ("r1@0s", StopFault(0.0, "r1")),
        ("r2@1234.5678s", StopFault(1234.5678, "r2")),
    ],
)
def test_faults_are_read(text: str, expected: StopFault) -> None:
    assert parse_fault(text) == expected
    assert parse_fault(str(expected)) == expected


@pytest.mark.parametrize(
    "text",
    [
        "",
        "r2",
        "@40s",
        "r2@",
        "r2@s",
        "r2@-1s",
        "r2@nan",
        "r2@infs",
        "r2@4 0s",
        "r2@4m",
    ],
)
def test_others_are_refused_with_an_example(text: str) -> None:
    with pytest.raises(UsageError, match="such as r2@40s"):
        parse_fault(text)


def test_faults_come_in_order_of_time(yard: Scene) -> None:
    faults = checked_faults(yard, ("r2@9s", "r1@3s"))
    assert [fault.robot for fault in faults] == ["r1", "r2"]


def test_one_fault_may_be_a_text_and_others_are_refused(yard: Scene) -> None:
    assert checked_faults(yard, "r2@9s") == checked_faults(yard, ["r2@9s"])
    number: Any = 3
    with pytest.raises(UsageError, match="fault '3' is not understood"):
        checked_faults(yard, [number])


def test_unknown_robots_are_named_with_the_known_ones(yard: Scene) -> None:
    with pytest.raises(UsageError, match=r"'r7@3s': robot 'r7' .*allowed: r1, r2"):
        checked_faults(yard, ("r7@3s",))
