"""Injected faults: a robot that stops on the way and stays where it is."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from mrmg.errors import UsageError, require_known
from mrmg.scene.types import Scene

_FORM = re.compile(r"(?P<robot>[^@\s]+)@(?P<time>[^@\s]+?)s?")


@dataclass(frozen=True, slots=True, order=True)
class StopFault:
    """A robot brakes as hard as its plan ever does, and never moves again.

    Attributes:
        time_s: simulated time at which it happens.
        robot: id of the robot.
    """

    time_s: float
    robot: str

    def __str__(self) -> str:
        return f"{self.robot}@{np.format_float_positional(self.time_s, trim='-')}s"


def parse_fault(text: str) -> StopFault:
    """Read a fault such as `r2@40s`.

    Raises:
        UsageError: if it is not of that form, or the time is not one.
    """
    match = _FORM.fullmatch(text.strip())
    try:
        time_s = float(match["time"]) if match else math.nan
    except ValueError:
        time_s = math.nan
    if match is None or not 0.0 <= time_s < math.inf:
        raise UsageError(
            f"fault {text!r} is not understood; expected ROBOT@TIME with a time in "
            "seconds that is not negative, such as r2@40s"
        )
    return StopFault(time_s=time_s, robot=match["robot"])


def checked_faults(scene: Scene, texts: str | Iterable[str]) -> tuple[StopFault, ...]:
    """Return the faults in order of time, of one text or several.

    Raises:
        UsageError: if one cannot be read, or names a robot the scene does not have.
    """
    texts = [texts] if isinstance(texts, str) else texts
    faults = sorted(parse_fault(str(text)) for text in texts)
    robots = [robot.id for robot in scene.robots]
    for fault in faults:
        require_known(f"fault '{fault}': robot", fault.robot, robots)
    return tuple(faults)
