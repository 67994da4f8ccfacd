"""How pages write figures: energies, differences, distances."""

from __future__ import annotations

from mrmg.energy.text import energy_text

LEAST_BASE_J = 0.1
"""Differences of what is less are not written in percent."""


def fixed(value: float, digits: int) -> str:
    """Return a number with so many decimals."""
    return f"{value:.{digits}f}"


def kJ(energy_J: float | None, digits: int = 2) -> str:
    """Return an energy, as the page writes every energy; none is empty."""
    return "" if energy_J is None else energy_text(energy_J, digits)


def quantity(value: float, unit: str) -> str:
    """Return what plans are judged by, in J, s or of a weighted sum."""
    if unit == "J":
        return kJ(value)
    return f"{value:.1f} s" if unit == "s" else f"{value:.4g}"


def distance(distance_m: float | None) -> str:
    """Return a distance in m, or in cm where it is short."""
    if distance_m is None:
        return "–"
    return (
        f"{distance_m:.2f} m" if distance_m >= 1.0 else f"{100.0 * distance_m:.1f} cm"
    )


def percent(value: float | None, base: float) -> str:
    """Return by how much an energy is off another one [J]; not of next to nothing."""
    if value is None:
        return ""
    if abs(base) < LEAST_BASE_J:
        return "–"
    return f"{signed(100.0 * (value - base) / base, 2)} %"


def signed(value: float, digits: int) -> str:
    """Return a number with a sign, never "-0.00"."""
    return f"{round(value, digits) + 0.0:+.{digits}f}".replace("-", "−")
