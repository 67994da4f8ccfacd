"""What was recorded while a plan was driven in MuJoCo."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, fields
from functools import lru_cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from mrmg import storage
from mrmg.columns import data_frame, named, state_columns
from mrmg.energy.metering import TimedStates
from mrmg.errors import Fault, IdentityError, of_robot, require_types
from mrmg.plan_form import require_form
from mrmg.plans import Plan, plan_in_force
from mrmg.scene.content import ByContent, contents
from mrmg.scene.driven_parts import require_drivable
from mrmg.scene.types import Scene
from mrmg.simulation.disturbance import Disturbance
from mrmg.simulation.supervision import Event

LOG_FORMAT = 1
LOG_FILE = "log.json"

_DECIDING = ("mujoco", "casadi", "numpy", "scipy", "shapely")


def package_versions() -> dict[str, str]:
    """Return the versions of the packages that decide what a simulation gives."""
    return {name: version(name) for name in _DECIDING}


@dataclass(frozen=True, slots=True)
class Contact:
    """The beginning of a touch that should not have happened.

    Attributes:
        time_s: when it began.
        robot: id of the robot.
        other: id of the robot or obstacle it touched, or "bounds".
        x_m, y_m: where.
    """

    time_s: float
    robot: str
    other: str
    x_m: float
    y_m: float


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ExecutionLog(ByContent):
    """Everything recorded at the control rate; n ticks, R robots.

    Attributes:
        scene_digest, plan_digest, model_digest: what was driven, in which MJCF world.
        controller: name of the tracking controller.
        control_period_s: time between ticks.
        completed: False where the simulation was ended early.
        gave_up: why it was: "lost", too far from the plan; "diverged", physics out of
            hand; "stalled", the fleet did not get on; "restless", it did not come to
            rest; "" where completed.
        disturbance: how the simulated robots differed from their models; None if not.
        robots: ids in the scene's order.
        versions: of the packages that decide the result.
        time_s: simulated time, shape (n,).
        clock_s: plan time the fleet's shared clock had reached, shape (n,).
        state: true x, y, theta, v and a fifth number, shape (R, n, 5); `columns` names
            it.
        reference: the plan at clock_s, shape (R, n, 5).
        command: set-points of v and of the fifth number of the state, given at each
            tick, shape (R, n, 2).
        multiplier: terrain under the rear axle, shape (R, n).
        force_N: drive force commanded over the tick, shape (R, n - 1).
        work_J: work of the drives over the tick, driving (>= 0) and braking (<= 0),
            shape (R, n - 1, 2).
        qpos: MuJoCo's positions, shape (n, nq); what a video is drawn from.
        contacts: every contact other than wheel and floor.
        events: what a supervisor saw and did, in order of time.
        plant: ground contact that it was driven on.
        bounded_solves: QP solves of the MPC with active bounds, by robot; empty where
            they were not counted.
        balance_J: what became of the drives' work over the whole drive, by the terms of
            `work.BALANCE_TERMS`, shape (R, 5); None where it was not recorded, or a
            state is no number.
        motions: motion models of the robots, which decide the columns; empty where they
            are not recorded.
        timing: wall_s and realtime_factor by the clock, controller_ms {median, p99} a
            robot and call by the processor, and the same with the number of calls for
            each branch of the MPC (`controller_calls.BRANCHES`). Kept apart: all else
            is equal between equal runs.
    """

    __pydantic_config__ = storage.WITH_ARRAYS

    scene_digest: str
    plan_digest: str
    model_digest: str
    controller: str
    control_period_s: float
    completed: bool
    robots: tuple[str, ...]
    versions: Mapping[str, str]
    time_s: np.ndarray
    clock_s: np.ndarray
    state: np.ndarray
    reference: np.ndarray
    command: np.ndarray
    multiplier: np.ndarray
    force_N: np.ndarray
    work_J: np.ndarray
    qpos: np.ndarray
    contacts: tuple[Contact, ...]
    timing: Mapping[str, Any]
    events: tuple[Event, ...] = ()
    gave_up: str = ""
    disturbance: Disturbance | None = None
    motions: tuple[str, ...] = ()
    balance_J: np.ndarray | None = None
    plant: str = "default"
    bounded_solves: tuple[int, ...] = ()

    def content(self) -> dict[str, Any]:
        """Return what counts for equality."""
        return contents(self, without=("timing",))

    def driven_motions(self) -> tuple[TimedStates, ...]:
        """Return the motion of each robot in the simulation."""
        return tuple(
            TimedStates(robot=robot, time_s=self.time_s, state=state)
            for robot, state in zip(self.robots, self.state, strict=True)
        )

    def tracking_error_m(self) -> np.ndarray:
        """Return each robot's distance from the plan at each tick [m], shape (R, n)."""
        offset_m = self.state[:, :, :2] - self.reference[:, :, :2]
        return np.asarray(np.hypot(offset_m[..., 0], offset_m[..., 1]))

    def columns(self, robot: str) -> dict[str, str]:
        """Return the unit of each column of `to_arrays(robot)` by its name."""
        return {name: unit for names, _ in self._tables(robot) for name, unit in names}

    def to_arrays(self, robot: str) -> dict[str, np.ndarray]:
        """Return what was recorded of a robot by name, each of shape (n,).

        What holds over a tick stands in the row in which the tick begins; the last row
        has NaN there.
        """
        rows = len(self.time_s)
        return {
            name: column
            for names, values in self._tables(robot)
            for name, column in named(dict(names), values, rows).items()
        }

    def to_dataframe(self, robot: str) -> Any:
        """Return `to_arrays` as a pandas DataFrame; raises MachineError without it."""
        return data_frame(self.to_arrays(robot))

    def _tables(
        self, robot: str
    ) -> Iterator[tuple[Iterable[tuple[str, str]], np.ndarray]]:
        """Yield names with units, and the values of their columns."""
        number = of_robot(robot, {each: k for k, each in enumerate(self.robots)})
        names = state_columns(self.motions[number] if self.motions else "")
        set_points = list(names.items())[3:]
        yield [("time_s", "s")], self.time_s
        yield [("clock_s", "s")], self.clock_s
        yield names.items(), self.state[number]
        yield _prefixed("reference", names.items()), self.reference[number]
        yield _prefixed("command", set_points), self.command[number]
        yield [("multiplier", "1")], self.multiplier[number]
        yield [("force_N", "N")], self.force_N[number]
        yield [("work_driving_J", "J"), ("work_braking_J", "J")], self.work_J[number]

    @property
    def digest(self) -> str:
        """Fingerprint of all arrays: equal for runs that are equal to the last bit."""
        digest = hashlib.sha256()
        for name, values in sorted(self._arrays().items()):
            digest.update(name.encode())
            digest.update(np.ascontiguousarray(values).tobytes())
        return digest.hexdigest()[:16]

    def save(self, folder: Path) -> None:
        """Write `log.npz`, `timing.json`, and last `log.json`, which marks the end."""
        storage.write_arrays(folder / "log.npz", self._arrays())
        storage.write_json(folder / "timing.json", dict(self.timing))
        header = {
            field.name: getattr(self, field.name)
            for field in fields(self)
            if field.name not in {*self._arrays(), "timing"}
        }
        if self.disturbance is None:
            del header["disturbance"]
        storage.write_json(folder / LOG_FILE, {"format": LOG_FORMAT, **header})

    def _arrays(self) -> dict[str, np.ndarray]:
        values = {field.name: getattr(self, field.name) for field in fields(self)}
        return {
            name: value
            for name, value in values.items()
            if isinstance(value, np.ndarray)
        }

    @staticmethod
    def load(folder: Path) -> ExecutionLog:
        """Read a log that `save` wrote.

        Raises:
            RunFolderError: if a file is missing or not a log of this format.
        """
        path = folder / LOG_FILE
        with storage.damage_reported(path, "no readable log", "run 'mrmg execute'"):
            names = (LOG_FILE, "log.npz", "timing.json")
            return _log_of(*((folder / name).read_bytes() for name in names))


@lru_cache(maxsize=1)
def _log_of(header: bytes, arrays: bytes, timing: bytes) -> ExecutionLog:
    """Return the log of the content of its files; steps of a run read the same one."""
    content = storage.of_format(header, LOG_FORMAT)
    content |= storage.arrays_of(arrays, "log.npz")
    content["timing"] = storage.json_of(timing)
    return storage.typed(ExecutionLog, content)


def log_in_force(folder: Path, scene: Scene) -> ExecutionLog | None:
    """Return the log of the drive of a run folder's plan; None if it was not driven.

    A log of a plan that the folder does not hold any more is none of its plan.

    Raises:
        RunFolderError: if a file cannot be read, or is of another scene.
    """
    if not (folder / LOG_FILE).exists():
        return None
    log = ExecutionLog.load(folder)
    require_same_mission(scene, None, log)
    return log if log.plan_digest == plan_in_force(folder).digest else None


def _prefixed(word: str, names: Iterable[tuple[str, str]]) -> list[tuple[str, str]]:
    return [(f"{word}_{name}", unit) for name, unit in names]


def require_executable(scene: Scene, plan: Plan) -> None:
    """Refuse what cannot be driven.

    Raises:
        UsageError: if one is no scene or plan, the plan is malformed, or a robot can
            only be planned for.
        IdentityError: if the plan is of another scene.
    """
    require_types((scene, Scene), (plan, Plan))
    require_same_mission(scene, plan)
    require_form(scene, plan)
    require_drivable(scene.robots)


def require_same_mission(
    scene: Scene, plan: Plan | None, log: ExecutionLog | None = None
) -> None:
    """Refuse a plan or log that was made for something else.

    Raises:
        IdentityError: naming what belongs to what.
    """
    faults = []
    this = f"this is {scene.name} ({scene.digest})"
    if plan is not None and not scene.is_named(plan.scene_digest):
        made_for = f"{plan.scene_name} ({plan.scene_digest})"
        message = f"plan of another scene, {made_for}; {this}; plan this scene anew"
        faults.append(Fault("plan.json", message))
    if log is not None and not scene.is_named(log.scene_digest):
        message = f"log of another scene ({log.scene_digest}); {this}; drive it anew"
        faults.append(Fault("log.json", message))
    if plan is not None and log is not None and log.plan_digest != plan.digest:
        message = f"log of another plan ({log.plan_digest}); this is {plan.digest}"
        faults.append(Fault("log.json", f"{message}; run 'mrmg execute'"))
    expected = [robot.id for robot in scene.robots]
    planned = expected if plan is None else [each.robot for each in plan.trajectories]
    if planned != expected:
        message = f"plan of robots {planned}, the scene has {expected}"
        faults.append(Fault("plan.json", f"{message}; plan this scene anew"))
    driven = expected if log is None else [*log.robots]
    if driven != expected:
        message = f"log of robots {driven}, the scene has {expected}"
        faults.append(Fault("log.json", f"{message}; run 'mrmg execute'"))
    if faults:
        raise IdentityError(scene.name, faults)
