"""Energy accounts: joules by robot, leg and part."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, order=True)
class LedgerEntry:
    """Energy drawn from one battery on one leg of a tour, for one part of the model.

    Attributes:
        robot: id of the robot.
        leg: number of the leg, from 0; a leg ends where its target is visited.
        target: id of the goal or station the leg leads to; "" after the last one.
        part: one of `energy.PARTS`, or "drive" for the work of MuJoCo's actuators.
        energy_J: drawn from the battery; negative where it was fed back.
    """

    robot: str
    leg: int
    target: str
    part: str
    energy_J: float


@dataclass(frozen=True, slots=True)
class EnergyLedger:
    """The account of a whole mission."""

    entries: tuple[LedgerEntry, ...] = ()

    def total_J(self, *, robot: str | None = None, part: str | None = None) -> float:
        """Return the energy of all entries, or of one robot's, one part's, or both."""
        return sum(
            entry.energy_J
            for entry in self.entries
            if (robot is None or entry.robot == robot)
            and (part is None or entry.part == part)
        )

    def parts(self) -> tuple[str, ...]:
        """Return the parts that have an entry, in order of appearance."""
        return tuple(dict.fromkeys(entry.part for entry in self.entries))
