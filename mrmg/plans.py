"""What the planner produces: trajectories, tours, visits and a status."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from mrmg import storage
from mrmg.columns import control_columns, data_frame, named, state_columns
from mrmg.energy.ledger import EnergyLedger
from mrmg.errors import ExitCode, of_robot
from mrmg.scene.content import ByContent
from mrmg.scene.margins import NarrowPassage

PLAN_FORMAT = 1

LONGEST_STEP_S = 0.2
"""Longest step of a plan: energy is charged by what is in the middle of each."""

DRIVEN_PLAN = "driven_plan"
"""Name of the files of a plan that was joined on the way."""

_DIGESTED = (
    *("scene_name", "scene_digest", "seed", "profile", "parameters_digest"),
    *("versions", "dt_s", "tours", "visits"),
)
"""Fields that the digest counts as they are."""

_BY_ROBOT = {"content_J": ".content", "rolling_factor": ".rolling_factor"}
"""Fields with an array for each robot, and what follows its id in the array's name."""


class PlanStatus(Enum):
    """How planning ended.

    INFEASIBLE is a proof, TIMEOUT a budget that was set and is over, NO_PLAN_FOUND a
    search that ended without a plan, a proof or a budget. Older versions wrote TIMEOUT
    for NO_PLAN_FOUND, too.
    """

    SOLVED = "solved"
    INFEASIBLE = "infeasible"
    TIMEOUT = "timeout"
    NO_PLAN_FOUND = "no_plan_found"
    INVALID_SCENE = "invalid_scene"
    CANCELLED = "cancelled"

    @property
    def exit_code(self) -> ExitCode:
        """The exit code of a command that ends with this status."""
        decided = {
            PlanStatus.SOLVED: ExitCode.OK,
            PlanStatus.INFEASIBLE: ExitCode.INFEASIBLE,
            PlanStatus.INVALID_SCENE: ExitCode.INVALID_FILE,
        }
        return decided.get(self, ExitCode.OUT_OF_BUDGET)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Trajectory(ByContent):
    """The motion of one robot under piecewise constant controls.

    Its arrays are read-only copies of those it is made of.

    Attributes:
        robot: id of the robot.
        dt_s: length of one step; state i holds at time i * dt_s.
        state: x, y, theta, v and a fifth number, shape (n + 1, 5); `columns` names it.
        control: u1, u2 held over each step, shape (n, 2).
        motion: motion model, which decides the columns; "" where it is not recorded.
    """

    __pydantic_config__ = storage.WITH_ARRAYS

    robot: str
    dt_s: float
    state: np.ndarray
    control: np.ndarray
    motion: str = ""

    def __post_init__(self) -> None:
        for name in ("state", "control"):
            own = np.array(getattr(self, name))
            own.setflags(write=False)
            object.__setattr__(self, name, own)

    @property
    def columns(self) -> dict[str, str]:
        """Unit of each column of `to_arrays` by its name."""
        names = {**state_columns(self.motion), **control_columns(self.motion)}
        return {"time_s": "s", **names}

    def to_arrays(self) -> dict[str, np.ndarray]:
        """Return time, states and controls by name, each of shape (n + 1,).

        A control stands in the row in which it begins; the last row has NaN.
        """
        rows = len(self.state)
        return {
            "time_s": self.time_s,
            **named(state_columns(self.motion), self.state, rows),
            **named(control_columns(self.motion), self.control, rows),
        }

    def to_dataframe(self) -> Any:
        """Return `to_arrays` as a pandas DataFrame; raises MachineError without it."""
        return data_frame(self.to_arrays())

    @property
    def time_s(self) -> np.ndarray:
        """Time of each state, shape (n + 1,)."""
        return np.arange(len(self.state)) * self.dt_s

    @property
    def duration_s(self) -> float:
        """Time of the last state."""
        return (len(self.state) - 1) * self.dt_s


@dataclass(frozen=True, slots=True)
class Visit:
    """A robot's entering of a goal or station.

    Attributes:
        robot: id of the robot.
        target: id of the goal or station.
        kind: "goal" or "station".
        step: index of the first trajectory state inside the region.
        time_s: its time.
        energy_J: battery content on arrival, before any recharge.
    """

    robot: str
    target: str
    kind: str
    step: int
    time_s: float
    energy_J: float


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Plan(ByContent):
    """A solved mission; all trajectories have the same number of steps.

    Attributes:
        scene_name, scene_digest: the scene it was made for.
        seed, profile, parameters_digest, versions: how it was made; versions include
            those of packages that added planner or router.
        planner, router: names of what made it; "" in plans of older versions.
        margins: distances from obstacles and from other robots that each robot keeps at
            the time steps [m]; empty in plans of older versions.
        narrow: where only a smaller margin from obstacles opened a passage.
        skipped: goals that are proven out of reach and left out, with their proofs.
        dt_s: step length of all trajectories.
        trajectories: one per robot, in the scene's order.
        tours: targets of each robot in the order of its visits.
        visits: in order of time.
        ledger: predicted energy.
        content_J: planned battery content at each state by robot, shape (n + 1,), where
            it is not what the scene's energy models say: in plans that were joined on
            the way, after more was known.
        rolling_factor: by which the rolling resistance was believed to differ from the
            model's over each step, by robot, shape (n,), in such plans.
    """

    __pydantic_config__ = storage.WITH_ARRAYS

    scene_name: str
    scene_digest: str
    seed: int
    profile: str
    parameters_digest: str
    versions: Mapping[str, str]
    dt_s: float
    trajectories: tuple[Trajectory, ...]
    tours: Mapping[str, tuple[str, ...]]
    visits: tuple[Visit, ...]
    ledger: EnergyLedger
    content_J: Mapping[str, np.ndarray] = field(default_factory=dict)
    rolling_factor: Mapping[str, np.ndarray] = field(default_factory=dict)
    planner: str = ""
    router: str = ""
    margins: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    narrow: tuple[NarrowPassage, ...] = ()
    skipped: Mapping[str, str] = field(default_factory=dict)

    @property
    def cost_J(self) -> float:
        """Energy of the whole fleet."""
        return self.ledger.total_J()

    @property
    def makespan_s(self) -> float:
        """Time at which the last robot has come to rest."""
        return max(trajectory.duration_s for trajectory in self.trajectories)

    @property
    def digest(self) -> str:
        """Fingerprint of the header, all states and all controls."""
        arrays = [
            array.tobytes().hex()
            for trajectory in self.trajectories
            for array in (trajectory.state, trajectory.control)
        ]
        header = storage.canonical_json(self._header())
        return storage.digest("".join([header, *arrays]))

    def trajectory(self, robot_id: str) -> Trajectory:
        """Return one robot's trajectory; raises UsageError if there is none."""
        return of_robot(robot_id, {item.robot: item for item in self.trajectories})

    def save(self, folder: Path, name: str = "plan") -> None:
        """Write `<name>.npz`, then `<name>.json`; equal plans give equal bytes."""
        arrays = {
            f"{robot}{ending}": value
            for field_name, ending in _BY_ROBOT.items()
            for robot, value in getattr(self, field_name).items()
        }
        for trajectory in self.trajectories:
            arrays[f"{trajectory.robot}.state"] = trajectory.state
            arrays[f"{trajectory.robot}.control"] = trajectory.control
        storage.write_arrays(folder / f"{name}.npz", arrays)
        # The scene decides this, and older plans lack it.
        not_digested = {
            "motions": {each.robot: each.motion for each in self.trajectories},
            "margins": {
                robot: {"obstacle": obstacle_m, "robot": robot_m}
                for robot, (obstacle_m, robot_m) in self.margins.items()
            },
            "narrow": self.narrow,
            "skipped": self.skipped,
        }
        storage.write_json(folder / f"{name}.json", {**self._header(), **not_digested})

    def _header(self) -> dict[str, Any]:
        makers = {"planner": self.planner, "router": self.router}
        return {
            "format": PLAN_FORMAT,
            **{name: getattr(self, name) for name in _DIGESTED},
            **{name: made for name, made in makers.items() if made},
            "robots": [trajectory.robot for trajectory in self.trajectories],
            "ledger": self.ledger.entries,
        }

    @staticmethod
    def load(folder: Path, name: str = "plan") -> Plan:
        """Read a plan that `save` wrote.

        Raises:
            RunFolderError: if a file is missing or not a plan of this format.
        """
        path = folder / f"{name}.json"
        with storage.damage_reported(path, "no readable plan", "run 'mrmg plan'"):
            packed = path.with_suffix(".npz")
            return _plan_of(path.read_bytes(), packed.read_bytes(), packed.name)


def plan_in_force(folder: Path) -> Plan:
    """Return the plan that was driven: the first one, or what became of it on the way.

    Raises:
        RunFolderError: if a file is missing or not a plan of this format.
    """
    joined = (folder / f"{DRIVEN_PLAN}.json").exists()
    return Plan.load(folder, DRIVEN_PLAN if joined else "plan")


@lru_cache(maxsize=2)
def _plan_of(stated: bytes, packed: bytes, name: str) -> Plan:
    """Return the plan of the content of its files; steps of a run read the same one."""
    header = storage.of_format(stated, PLAN_FORMAT)
    arrays = storage.arrays_of(packed, name)
    motions = header.pop("motions", {})
    trajectories = [
        Trajectory(
            robot=robot,
            dt_s=header["dt_s"],
            state=arrays[f"{robot}.state"],
            control=arrays[f"{robot}.control"],
            motion=motions.get(robot, ""),
        )
        for robot in header.pop("robots")
    ]
    margins = {
        robot: (kept["obstacle"], kept["robot"])
        for robot, kept in header.get("margins", {}).items()
    }
    by_robot = {
        field_name: {
            key.removesuffix(ending): value
            for key, value in arrays.items()
            if key.endswith(ending)
        }
        for field_name, ending in _BY_ROBOT.items()
    }
    found = {
        "trajectories": trajectories,
        "ledger": {"entries": header["ledger"]},
        "margins": margins,
    }
    return storage.typed(Plan, header | found | by_robot)


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanResult:
    """The answer of the planner: a status, and a plan exactly when it is SOLVED.

    Attributes:
        status: how planning ended.
        plan: the plan, or None.
        reason: one sentence for a status other than SOLVED; names the proof.
        statistics: counts and times (`vertices`, `groups`, `router_calls`, `time_s`).
        hints: sentences on the plan, such as which robots it leaves unused.
    """

    status: PlanStatus
    plan: Plan | None
    reason: str
    statistics: Mapping[str, Any]
    hints: tuple[str, ...] = ()
