"""The figures that the physics is held to, and what was found of each."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Figure:
    """One figure: what it is of, what was found, what is asked, whether that holds.

    Attributes:
        what, found, asked, holds: as they are printed.
        value, limit: found and asked as numbers, where they are.
    """

    what: str
    found: str
    asked: str
    holds: bool
    value: float | None = None
    limit: float | None = None

    @staticmethod
    def at_most(what: str, value: float, bound: float, unit: str = "") -> Figure:
        """Return a figure that must not exceed a bound."""
        found, asked = f"{value:.3g}{unit}", f"<= {bound:g}{unit}"
        return Figure(what, found, asked, value <= bound, value, bound)

    @staticmethod
    def at_least(what: str, value: float, bound: float, unit: str = "") -> Figure:
        """Return a figure that must reach a bound."""
        found, asked = f"{value:.3g}{unit}", f">= {bound:g}{unit}"
        return Figure(what, found, asked, value >= bound, value, bound)

    @staticmethod
    def count(what: str, found: int, of: int, least: int) -> Figure:
        """Return how many of a number hold, of which so many must."""
        asked = "all" if least == of else f">= {least}/{of}"
        return Figure(what, f"{found}/{of}", asked, found >= least, found, least)


def verdict(faults: Iterable[str]) -> str:
    """Return the last cell of a table's row."""
    output = ", ".join(faults)
    return f"MISSES: {output}" if output else "holds"


def print_figures(figures: list[Figure]) -> None:
    """Print all figures of the bench, one a row, PASS or FAIL."""
    print("\nfigure | found | asked |")
    for figure in figures:
        word = "PASS" if figure.holds else "FAIL"
        print(f"{figure.what} | {figure.found} | {figure.asked} | {word}")
    failed = sum(not figure.holds for figure in figures)
    print(f"\n{failed} figures FAIL" if failed else "\nall figures PASS")
