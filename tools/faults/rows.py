"""What the rows of the bench share: their options and what they found."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from protocol import Row, Trials


@dataclass(frozen=True, kw_only=True)
class Options:
    """How much a row tries, and where.

    Attributes:
        seed: of everything that is drawn.
        files, plans, kills, missions: how many of each are tried.
        work: folder for files under test.
        keep: folder for the input of what failed, or None.
        trials: those that are finished.
    """

    seed: int
    files: int
    plans: int
    kills: int
    missions: int
    work: Path
    keep: Path | None
    trials: Trials


def row_of(
    name: str, what: str, cases: int, failures: list[Row], **more: object
) -> Row:
    """Return the row of a table: it holds if nothing failed.

    Args:
        name: of the row, or of its group and it.
        what: must hold.
        cases: how many were tried.
        failures: `case` and `fault` of each that failed.
        more: figures of the row.
    """
    return {
        "row": name,
        "required": what,
        "cases": cases,
        "failed": len(failures),
        "holds": not failures,
        "failures": failures[:50],
        **more,
    }
