"""Every error a user can meet, each with the exit code it ends a command with.

The command line prints the message alone; the Python API raises the exception.
"""

from __future__ import annotations

import difflib
import operator
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import SupportsIndex, TypeVar

from mrmg.counted import counted

_Kind = TypeVar("_Kind")


class ExitCode(IntEnum):
    """What a command's exit status means."""

    OK = 0
    USAGE = 2
    INVALID_FILE = 3
    INFEASIBLE = 4
    OUT_OF_BUDGET = 5
    MISSION_FAILED = 6
    MACHINE = 7


class MrmgError(Exception):
    """Root of all errors raised on purpose by this package."""

    exit_code = ExitCode.USAGE


class UsageError(MrmgError):
    """A command or function was called in a way it does not allow."""


@dataclass(frozen=True)
class Fault:
    """One fault of a file: where it is, what is wrong, and what is allowed.

    Attributes:
        path: keys and indices that lead to it, such as "goals.9.circle.radius".
        message: what is wrong, and what is allowed.
        id: of the entry it is in, where that has one.
        line: of the file, counted from 1; None for a document that is no file.
    """

    path: str
    message: str
    id: str | None = None
    line: int | None = None

    def __str__(self) -> str:
        place = f"{self.path} ({self.id})" if self.id else self.path
        lines = [] if self.line is None else [f"line {self.line}"]
        where = ", ".join([*filter(None, [place]), *lines])
        return f"{where}: {self.message}" if where else self.message


class FileError(MrmgError):
    """A file cannot be used; carries every fault found, not only the first."""

    exit_code = ExitCode.INVALID_FILE

    def __init__(self, source: str, faults: Sequence[Fault]) -> None:
        self.source = source
        self.faults = tuple(faults)
        count = counted(len(self.faults), "fault")
        lines = [f"{source}: {count}", *(f"  {fault}" for fault in self.faults)]
        super().__init__("\n".join(lines))

    def __reduce__(self) -> tuple[type[FileError], tuple[str, tuple[Fault, ...]]]:
        # Worker processes send errors; by default only the message would be sent.
        return type(self), (self.source, self.faults)


class SceneError(FileError):
    """A scene file is malformed or describes an impossible scene."""


class RunFolderError(FileError):
    """A run folder lacks or contradicts what a step needs."""


class IdentityError(RunFolderError, UsageError):
    """A plan or log is used with a scene or plan that it was not made for."""


class MachineError(MrmgError):
    """Something the command needs is missing on this machine; names the remedy."""

    exit_code = ExitCode.MACHINE


MADE_BY = {
    "Scene": "mrmg.load_scene(...) gives one",
    "Plan": "mrmg.plan(scene).plan is one, or None where `reason` says why",
    "PlannerParams": "mrmg.PlannerParams(samples=900) is one",
    "GuidedTreeParams": "GuidedTreeParams(k=10) of mrmg.planning.parameters is one",
    "RouterParams": "RouterParams(rounds=500) of mrmg.planning.routing.routing is one",
    "Disturbance": "parse_disturbance('lag=50ms').draw(seed, robots) of "
    "mrmg.simulation.disturbance_spec gives one, robots being their ids",
    "ExecutionLog": "mrmg.execute(scene, plan) gives one",
    "str or Path": "give the path of a scene file, or a shipped scene's name",
    "VideoArguments": "mrmg.runs.arguments.VideoArguments(view='chase') is one",
}
"""Where the values come from that functions take, by type."""


def require_types(*given: tuple[object, type | tuple[type, ...]]) -> None:
    """Refuse values that are of other types than they must be.

    Args:
        given: each value, and its type, or types.

    Raises:
        UsageError: naming the type, and where its values come from.
    """
    for value, kind in given:
        if not isinstance(value, kind):
            kinds = kind if isinstance(kind, tuple) else (kind,)
            name = " or ".join(each.__name__ for each in kinds)
            got = "None" if value is None else f"{value!r:.60} ({type(value).__name__})"
            raise UsageError(f"expected {name}, got {got}; {MADE_BY[name]}")


def whole(what: str, number: SupportsIndex) -> int:
    """Return a whole number of any type, NumPy's among them.

    Raises:
        UsageError: if it is none.
    """
    try:
        return operator.index(number)
    except TypeError:
        raise UsageError(f"{what} = {number!r}; expected a whole number") from None


def require_known(what: str, name: str, names: Iterable[str]) -> None:
    """Refuse a name that is none of some.

    Raises:
        UsageError: naming those there are, and the most similar one.
    """
    known = list(names)
    if name not in known:
        text = f"{what} '{name}' is not known{nearest(name, known)}"
        raise UsageError(f"{text}; allowed: {', '.join(known)}")


def of_robot(robot_id: str, by_id: Mapping[str, _Kind]) -> _Kind:
    """Return what belongs to a robot.

    Raises:
        UsageError: if there is no robot of that id; lists those there are.
    """
    require_known("robot", robot_id, by_id)
    return by_id[robot_id]


def nearest(name: str, names: Iterable[str], *, cutoff: float = 0.5) -> str:
    """Return " (did you mean '...'?)" for the most similar of `names`, or nothing."""
    match = difflib.get_close_matches(str(name), list(names), n=1, cutoff=cutoff)
    return f" (did you mean '{match[0]}'?)" if match else ""
