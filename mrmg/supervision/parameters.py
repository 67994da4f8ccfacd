"""When the supervisor steps in, and how hard it tries to go on."""

from __future__ import annotations

from dataclasses import dataclass

from mrmg.errors import refuse_values


@dataclass(frozen=True, slots=True, kw_only=True)
class ControlParams:
    """The corridors a mission is kept in, and the effort of replanning.

    Attributes:
        energy_share: excess of measured over planned energy since the last plan that is
            tolerated, as a share of the planned.
        energy_floor: further excess tolerated, as a share of the capacity: what is
            measured over a few metres is uncertain.
        stall_s: how long the fleet's clock may stand still.
        off_m: how far a robot may be from its plan.
        tracked_m: offset up to which a robot counts as being where its plan has it.
        check_s: time between two looks at the energy.
        pause_s: how long the fleet stands for a new plan.
        most_replans: new plans after which only faults still stop the fleet.
        draws: seeds a new plan is tried with.
        reserves: shares of the reserve a new plan may be asked to keep, in order. What
            was measured is uncertain, so that a bit more is asked for at first.
    """

    energy_share: float = 0.10
    energy_floor: float = 0.01
    stall_s: float = 2.0
    off_m: float = 0.5
    tracked_m: float = 0.1
    check_s: float = 0.5
    pause_s: float = 2.0
    most_replans: int = 10
    draws: int = 2
    reserves: tuple[float, ...] = (1.25, 1.0, 0.5, 0.0)

    def __post_init__(self) -> None:
        allowed = {
            "energy_share": self.energy_share > 0.0,
            "energy_floor": self.energy_floor >= 0.0,
            "stall_s": self.stall_s > 0.0,
            "off_m": self.off_m > self.tracked_m,
            "tracked_m": self.tracked_m > 0.0,
            "check_s": self.check_s > 0.0,
            "pause_s": self.pause_s >= 0.0,
            "most_replans": self.most_replans >= 0,
            "draws": self.draws >= 1,
            "reserves": bool(self.reserves)
            and all(0.0 <= share <= 2.0 for share in self.reserves),
        }
        refuse_values(self, allowed, "supervision parameters")
