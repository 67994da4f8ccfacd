"""What the verifier finds in a plan: a list of violations and two clearances."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from enum import Enum
from pathlib import Path
from typing import Any

from mrmg import storage

VERDICT_FORMAT = 1
VERDICT_FILE = "verdict.json"


class ViolationKind(Enum):
    """Every rule of a plan, with the unit of `Violation.amount`.

    The unit is "SI" where it depends on the component.
    """

    unit: str

    def __new__(cls, name: str, unit: str) -> ViolationKind:
        """Return a kind whose value is its name."""
        kind = object.__new__(cls)
        kind._value_, kind.unit = name, unit
        return kind

    SCENE_MISMATCH = "scene_mismatch", "1"
    MALFORMED = "malformed", "1"
    START = "start", "SI"
    FINAL_REST = "final_rest", "SI"
    FINISH = "finish", "SI"
    DYNAMICS = "dynamics", "SI"
    STATE_LIMIT = "state_limit", "SI"
    CONTROL_LIMIT = "control_limit", "SI"
    OBSTACLE = "obstacle", "m^2"
    BOUNDS = "bounds", "m"
    ROBOT = "robot", "m^2"
    MARGIN = "margin", "m"
    OCCUPIED = "occupied", "s"
    GOAL_MISSED = "goal_missed", "m"
    HEADING = "heading", "rad"
    DWELL = "dwell", "s"
    TOUR = "tour", "m"
    VISIT = "visit", "s"
    RECHARGE = "recharge", "m"
    ENERGY = "energy", "J"
    LATE = "late", "s"
    LEDGER = "ledger", "J"


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
        rows = [violation.to_row() for violation in self.violations]
        content = {"format": VERDICT_FORMAT, **asdict(self), "violations": rows}
        storage.write_json(folder / VERDICT_FILE, content)

    @staticmethod
    def load(folder: Path) -> Verdict:
        """Read a verdict that `save` wrote.

        Raises:
            RunFolderError: if the file is missing or not a verdict of this format.
        """
        path = folder / VERDICT_FILE
        with storage.damage_reported(path, "no readable verdict", "run 'mrmg verify'"):
            content = storage.of_format(path.read_bytes(), VERDICT_FORMAT)
            return storage.typed(Verdict, content)
