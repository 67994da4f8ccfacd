"""How energies are written for people."""

from __future__ import annotations

from math import floor, log10

SMALL_KJ, LEAST_KJ = 0.1, 1e-6
"""Energies in between are written with three significant digits: those of robots as
small as a hand must not all read 0.0."""


def energy_text(energy_J: float, digits: int = 2) -> str:
    """Return an energy in kJ, with so many decimals or, where it is small, more."""
    energy_kJ = energy_J / 1000.0
    if LEAST_KJ <= abs(energy_kJ) < SMALL_KJ:
        digits = 2 - floor(log10(abs(energy_kJ)))
    return f"{round(energy_kJ, digits) + 0.0:.{digits}f} kJ"  # never "-0.00"
