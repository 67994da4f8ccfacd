"""Bad or hostile inputs written out one by one, with the exit codes allowed."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from protocol import Row

from faults.commands import Commands, Outcome, left_over


def _nothing(place: Path, outcome: Outcome) -> str:
    return ""


@dataclass(frozen=True, kw_only=True)
class Case:
    """One input and the command that reads it.

    Attributes:
        write: writes the input into a folder; returns the words of the command.
        codes: exit codes that the command may end by.
        leaves: whether the command may leave files whatever its end.
        check: what else must hold in the folder; returns the fault, or "".
    """

    write: Callable[[Path], tuple[str, ...]]
    codes: tuple[int, ...] = (3,)
    leaves: bool = False
    check: Callable[[Path, Outcome], str] = _nothing


def run_cases(cases: Mapping[str, Case], folder: Path) -> Row:
    """Run cases by their names; return how many there were, and the failures."""
    commands = Commands()
    failures: list[dict[str, Any]] = []
    try:
        for number, (name, case) in enumerate(cases.items()):
            place = folder / f"{number}"
            place.mkdir(parents=True, exist_ok=True)
            words = case.write(place)
            before = {*place.rglob("*")}
            outcome = commands.run(place, words)
            left = "" if case.leaves else left_over(place, before, outcome)
            fault = outcome.fault() or left
            if not fault and outcome.code not in case.codes:
                fault = f"exit code {outcome.code}: {outcome.err or outcome.out}"
            fault = fault or case.check(place, outcome)
            if fault:
                failures.append({"case": name, "fault": fault[:400]})
    finally:
        commands.close()
    return {"cases": len(cases), "failures": failures}
