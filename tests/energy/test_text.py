"""How energies are written for people."""

from __future__ import annotations

import pytest

from mrmg.energy.text import energy_text


@pytest.mark.parametrize(
    ("energy_J", "digits", "text"),
    [
        (45_678.0, 2, "45.68 kJ"),
        (45_678.0, 1, "45.7 kJ"),
        (-250.0, 1, "-0.2 kJ"),
        (99.94, 1, "0.0999 kJ"),
        (13.325, 2, "0.0133 kJ"),
        (-13.325, 1, "-0.0133 kJ"),
        (0.0021, 2, "0.00000210 kJ"),
        (1e-9, 2, "0.00 kJ"),
        (-1e-9, 2, "0.00 kJ"),
        (-0.0, 2, "0.00 kJ"),
    ],
)
def test_small_energies_keep_three_digits(
    energy_J: float, digits: int, text: str
) -> None:
    assert energy_text(energy_J, digits) == text
