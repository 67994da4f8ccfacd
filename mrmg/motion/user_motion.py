"""A motion model defined in a user's own Python file.

The file defines two functions of plain numbers, written with `math`:

    def step(state, control, length, dt):
        '''Return the state after `dt` under a held control.'''

    def steer(state, waypoint, share, limits, length, dt):
        '''Return the control towards a waypoint at `share` of the top speed.'''

State is (x, y, theta, v, w): position, heading, speed and one number that is the
model's own; control is (u1, u2); waypoint (x, y); limits (v_min, v_max, w_max, u1_max,
u2_max); length is the model's `wheelbase`. `share` 0 means to brake: under it the robot
must come to rest, v and w at 0, within a second or so from any state. Units are SI.

The planner compiles both with numba and calls them by address, so that they run as fast
as the shipped models; other functions of the file that they call need `numba.njit`. The
verifier runs `step` as it is.
"""

from __future__ import annotations

import hashlib
import inspect
import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

from mrmg.errors import Fault, SceneError
from mrmg.motion.dynamics import DERIVATIVES, Derivative, rk4_step
from mrmg.scene.content import content_digest
from mrmg.scene.robot_model import RobotModel

_PARAMETERS = {
    "step": ("state", "control", "length", "dt"),
    "steer": ("state", "waypoint", "share", "limits", "length", "dt"),
}


@dataclass(frozen=True)
class UserMotion:
    """A motion model of a user.

    Attributes:
        source: path of its file.
        step: (state, control, length, dt) -> state, five numbers.
        steer: (state, waypoint, share, limits, length, dt) -> control, two numbers.
    """

    source: str
    step: Callable[..., tuple[float, ...]]
    steer: Callable[..., tuple[float, ...]]

    def compiled(self, limits: tuple[float, ...]) -> tuple[int, int]:
        """Return the addresses of compiled step and steer, valid while the process is.

        Raises:
            SceneError: if numba cannot compile them.
        """
        return _addresses(self, limits)


def plain_step(model: RobotModel) -> Derivative:
    """Return step(state, control, L, dt) -> state of any model in plain Python.

    Raises:
        SceneError: as `motion_of` does.
    """
    if model.motion_model in DERIVATIVES:
        return rk4_step(DERIVATIVES[model.motion_model](math.sin, math.cos, math.tan))
    return motion_of(model).step


def motion_of(model: RobotModel) -> UserMotion:
    """Import the custom motion of a robot model.

    Raises:
        SceneError: naming what the file lacks, or that it has changed.
    """
    model.require_unchanged_files()
    return user_motion(model.motion_model, content_digest(model.files))


@cache
def user_motion(path: str, content: str = "") -> UserMotion:
    """Import a user's motion model.

    Args:
        path: of its file.
        content: digest of the file; it is imported once for each.

    Raises:
        SceneError: naming what the file lacks.
    """
    module = _imported(path)
    faults: list[Fault] = []
    found: dict[str, Any] = {}
    for name, parameters in _PARAMETERS.items():
        function = getattr(module, name, None)
        function = getattr(function, "py_func", function)  # where numba.njit made it
        found[name] = function
        wanted = f"{name}({', '.join(parameters)})"
        if not inspect.isfunction(function):
            faults.append(Fault(name, f"is not defined; expected a function {wanted}"))
        elif len(inspect.signature(function).parameters) != len(parameters):
            given = f"{name}{inspect.signature(function)}"
            faults.append(Fault(name, f"is {given}; expected {wanted}"))
    if faults:
        raise SceneError(path, faults)
    return UserMotion(source=path, **found)


def _imported(path: str) -> ModuleType:
    # Named after its place, so that files of the same name do not get mixed up.
    name = f"mrmg_user_motion_{hashlib.sha256(path.encode()).hexdigest()[:12]}"
    module = ModuleType(name)
    module.__file__ = path
    try:
        # Not through importlib: a __pycache__ that came along is other code than this.
        code = compile(Path(path).read_bytes(), path, "exec", dont_inherit=True)
        exec(code, module.__dict__)
    except (Exception, SystemExit) as error:  # a user's file may do anything
        reason = f"cannot be imported: {type(error).__name__}: {error}"
        raise SceneError(path, [Fault("", reason)]) from error
    return module


@cache
def _addresses(motion: UserMotion, limits: tuple[float, ...]) -> tuple[int, int]:
    import numba

    from mrmg.motion._pointer_kernels import STEER, STEP

    step, steer = numba.njit(motion.step), numba.njit(motion.steer)

    def call_step(state: Any, control: Any, length: float, dt: float) -> Any:
        x, y, theta, v, w = step(state, control, length, dt)
        return float(x), float(y), float(theta), float(v), float(w)

    def call_steer(
        state: Any, waypoint: Any, share: float, length: float, dt: float
    ) -> Any:
        u1, u2 = steer(state, waypoint, share, limits, length, dt)
        return float(u1), float(u2)

    addresses = []
    for name, function, signature in (
        ("step", call_step, STEP),
        ("steer", call_steer, STEER),
    ):
        try:
            compiled = numba.cfunc(signature)(function)
        except Exception as error:  # of numba, or of what it meets in a user's file
            reason = " ".join(str(error).split())
            message = f"cannot be compiled by numba: {reason[:400]}"
            raise SceneError(motion.source, [Fault(name, message)]) from error
        _kept_alive.append(compiled)
        addresses.append(int(compiled.address))
    return addresses[0], addresses[1]


_kept_alive: list[Any] = []
"""Compiled functions: their addresses are only good while they exist."""
