"""Custom motion models keep the contract that users are told to run on theirs."""

from __future__ import annotations

from pathlib import Path

from mrmg.testing import MotionContract

TOOLS = Path(__file__).parents[2] / "tools"


class TestFirstOrder(MotionContract):
    limits = (-1.0, 1.0, 0.5, 1.0, 0.5)  # its controls are speeds

    def motion_file(self) -> Path:
        return TOOLS / "first_order.py"
