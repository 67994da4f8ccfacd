"""What the verifier finds in a plan: a list of violations and two clearances."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from enum import Enum
from pathlib import Path
from typing import Any

from mrmg import storage
from mrmg.errors import Fault, RunFolderError

VERDICT_FORMAT = 1


class ViolationKind(Enum):
    """Every rule of a plan; `unit` is that of a violation's amount."""

    SCENE_MISMATCH = "scene_mismatch"
    MALFORMED = "malformed"
    START = "start"
    FINAL_REST = "final_rest"
    FINISH = "finish"
    DYNAMICS = "dynamics"
    STATE_LIMIT = "state_limit"
    CONTROL_LIMIT = "control_limit"
    OBSTACLE = "obstacle"
    BOUNDS = "bounds"
    ROBOT = "robot"
    MARGIN = "margin"
    OCCUPIED = "occupied"
    GOAL_MISSED = "goal_missed"
    HEADING = "heading"
    DWELL = "dwell"
    TOUR = "tour"
    VISIT = "visit"
    RECHARGE = "recharge"
    ENERGY = "energy"
    LATE = "late"
    LEDGER = "ledger"

    @property
    def unit(self) -> str:
        """Unit of `Violation.amount`; "SI" where it depends on the component."""
        return {
            ViolationKind.SCENE_MISMATCH: "1",
            ViolationKind.MALFORMED: "1",
            ViolationKind.START: "SI",
            ViolationKind.FINAL_REST: "SI",
            ViolationKind.FINISH: "SI",
            ViolationKind.DYNAMICS: "SI",
            ViolationKind.STATE_LIMIT: "SI",
            ViolationKind.CONTROL_LIMIT: "SI",
            ViolationKind.OBSTACLE: "m^2",
            ViolationKind.BOUNDS: "m",
            ViolationKind.ROBOT: "m^2",
            ViolationKind.MARGIN: "m",
            ViolationKind.OCCUPIED: "s",
            ViolationKind.GOAL_MISSED: "m",
            ViolationKind.HEADING: "rad",
            ViolationKind.DWELL: "s",
            ViolationKind.TOUR: "m",
            ViolationKind.VISIT: "s",
            ViolationKind.RECHARGE: "m",
            ViolationKind.ENERGY: "J",
            ViolationKind.LATE: "s",
            ViolationKind.LEDGER: "J",
        }[self]


@dataclass(frozen=True, slots=True, kw_only=True)
class Violation:
    """One broken rule: who, when, where and by how much.

    Attributes:
        kind: the rule.
        robot: id of the robot, or "" for the whole plan.
        other: the obstacle, robot, goal or station concerned, or "".
        time_s: when it is worst.
        x_m, y_m: the robot's reference point at that time.
        amount: by how much, in `kind.unit`; overlaps are areas.
        message: one sentence for people.
    """

    kind: ViolationKind
    robot: str = ""
    other: str = ""
    time_s: float = 0.0
    x_m: float = 0.0
    y_m: float = 0.0
    amount: float = 0.0
    message: str

    def to_row(self) -> dict[str, Any]:
        """Return the violation as a JSON row."""
        return {**asdict(self), "kind": self.kind.value, "unit": self.kind.unit}

    @staticmethod
    def from_row(row: Mapping[str, Any]) -> Violation:
        """Rebuild a violation from `to_row`."""
        values = {name: value for name, value in row.items() if name != "unit"}
        return Violation(**{**values, "kind": ViolationKind(row["kind"])})


@dataclass(frozen=True, slots=True, kw_only=True)
class Verdict:
    """The verifier's judgement of a plan.

    Attributes:
        ok: no violation.
        violations: all that were found, consecutive ones merged into their worst.
        min_obstacle_clearance_m: at no time is a footprint closer to an obstacle that
            stops it, or to the bounds; 0 where they touch. None if it was not
            measured because the plan is malformed.
        min_robot_distance_m: at no time are two footprints closer; None also where
            there is one robot only.
        skipped: goals that the plan leaves out, as proven out of reach.
    """

    ok: bool
    violations: tuple[Violation, ...]
    min_obstacle_clearance_m: float | None
    min_robot_distance_m: float | None
    skipped: tuple[str, ...] = ()

    def save(self, folder: Path) -> None:
        """Write `verdict.json`."""
        storage.write_json(
            folder / "verdict.json",
            {
                "format": VERDICT_FORMAT,
                "ok": self.ok,
                "violations": [violation.to_row() for violation in self.violations],
                "min_obstacle_clearance_m": self.min_obstacle_clearance_m,
                "min_robot_distance_m": self.min_robot_distance_m,
                "skipped": list(self.skipped),
            },
        )

    @staticmethod
    def load(folder: Path) -> Verdict:
        """Read a verdict that `save` wrote.

        Raises:
            RunFolderError: if the file is missing or not a verdict of this format.
        """
        try:
            content = storage.read_json(folder / "verdict.json")
            if content.pop("format") != VERDICT_FORMAT:
                raise ValueError(f"this version reads format {VERDICT_FORMAT} only")
            rows = content.pop("violations")
            violations = tuple(Violation.from_row(row) for row in rows)
            skipped = tuple(content.pop("skipped", ()))
            return Verdict(violations=violations, skipped=skipped, **content)
        except storage.UNREADABLE as error:
            fault = Fault(
                "verdict.json", f"no readable verdict ({error}); run 'mrmg verify'"
            )
            raise RunFolderError(str(folder), [fault]) from error
