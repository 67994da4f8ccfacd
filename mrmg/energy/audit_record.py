"""What the audit finds in a simulated mission: three meters, visits, tracking."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path

from mrmg import storage
from mrmg.energy.ledger import EnergyLedger
from mrmg.errors import of_robot
from mrmg.plans import Visit

AUDIT_FORMAT = 1
AUDIT_FILE = "audit.json"

MODEL_MISMATCH = "model mismatch"
"""Cause of a mission that failed in nothing but the energy its models predict."""

ENERGY_IMBALANCE = "energy imbalance"
"""Cause of a mission whose measured energies cannot be trusted."""


@dataclass(frozen=True, slots=True, kw_only=True)
class EnergyBalance:
    """What became of the work of one robot's actuators in the simulation.

    work_J + steering_J = kinetic_J + potential_J + joints_J + contacts_J + residual_J.

    Attributes:
        work_J: of the drives, braking counted as negative: what measured is made from.
        steering_J: of the steering servos.
        kinetic_J, potential_J: change of both over the drive.
        joints_J: lost to joint friction and damping.
        contacts_J: lost in contacts: tyres that creep, collisions.
        residual_J: work that none of these account for.
        residual_pct: in percent of the drives' work (or of that for one metre of plain
            ground where it is less).
    """

    work_J: float
    steering_J: float
    kinetic_J: float
    potential_J: float
    joints_J: float
    contacts_J: float
    residual_J: float
    residual_pct: float


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotAudit:
    """The account of one robot.

    Attributes:
        robot: its id.
        planned_J: energy model over the plan.
        metered_J: energy model over the simulated motion.
        measured_J: from the work of the simulated drives.
        metered_error_pct, measured_error_pct: difference from planned, in percent of
            planned (or of one metre of plain ground where less was planned).
        min_charge_fraction: least measured battery content over the capacity.
        tracking_rms_m, tracking_max_m: distance of the reference point from the plan at
            the fleet's shared clock.
        balance: of its energy in the simulation; None where the log has none.
    """

    robot: str
    planned_J: float
    metered_J: float
    measured_J: float
    metered_error_pct: float
    measured_error_pct: float
    min_charge_fraction: float
    tracking_rms_m: float
    tracking_max_m: float
    balance: EnergyBalance | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class EnergyAudit:
    """The account of a simulated mission.

    Attributes:
        mission_ok: all goals visited, all robots in their finishes, no contact, no
            battery below its reserve, the simulation ran to the end, and robots took
            the energy planned.
        reasons: why not, one sentence each.
        causes: the kinds of these reasons: why the simulation was given up
            (`ExecutionLog.gave_up`, or "unfinished"), "ended" by supervision, "goal
            missed", "finish missed", "goal skipped", "contact", "station shared",
            "late", "below reserve", "battery empty", `MODEL_MISMATCH`,
            `ENERGY_IMBALANCE`.
        robots: one account per robot, in the scene's order.
        visits: of tours' targets in the simulation, in order of time.
        goals_visited: ids of the goals some robot visited, in the scene's order.
        planned, metered, measured: ledgers by robot, leg and part; the legs of the
            last two end where the simulation visits the target.
    """

    mission_ok: bool
    reasons: tuple[str, ...]
    robots: tuple[RobotAudit, ...]
    visits: tuple[Visit, ...]
    goals_visited: tuple[str, ...]
    planned: EnergyLedger
    metered: EnergyLedger
    measured: EnergyLedger
    causes: tuple[str, ...] = ()

    @property
    def recharges(self) -> tuple[Visit, ...]:
        """The visits of stations."""
        return tuple(visit for visit in self.visits if visit.kind == "station")

    def robot(self, robot_id: str) -> RobotAudit:
        """Return the account of one robot; raises UsageError if there is none."""
        return of_robot(robot_id, {item.robot: item for item in self.robots})

    def save(self, folder: Path) -> None:
        """Write `audit.json`."""
        ledgers = {name: getattr(self, name).entries for name in _LEDGERS}
        content = {"format": AUDIT_FORMAT, **asdict(self), **ledgers}
        storage.write_json(folder / AUDIT_FILE, content)

    @staticmethod
    def load(folder: Path) -> EnergyAudit:
        """Read an audit that `save` wrote.

        Raises:
            RunFolderError: if the file is missing or not an audit of this format.
        """
        path = folder / AUDIT_FILE
        with storage.damage_reported(path, "no readable audit", "run 'mrmg audit'"):
            content = storage.of_format(path.read_bytes(), AUDIT_FORMAT)
            for name in _LEDGERS:
                content[name] = {"entries": content[name]}
            for visit in content["visits"]:
                visit.setdefault("step", 0)  # 0.1.0 did not write it
            return storage.typed(EnergyAudit, content)


_LEDGERS = ("planned", "metered", "measured")
