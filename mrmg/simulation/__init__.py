"""From a plan to a log: the MuJoCo world, controllers, simulation.

`simulate` drives a plan, `build_world` compiles a scene, `ExecutionLog` is the record.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mrmg.simulation.log import Contact, ExecutionLog
    from mrmg.simulation.simulation import simulate
    from mrmg.simulation.world_model import MujocoWorld, build_world

__all__ = ["Contact", "ExecutionLog", "MujocoWorld", "build_world", "simulate"]

_HOMES = {
    "Contact": "log",
    "ExecutionLog": "log",
    "MujocoWorld": "world_model",
    "build_world": "world_model",
    "simulate": "simulation",
}


def __getattr__(name: str) -> Any:
    # MuJoCo and CasADi take half a second to import: only who uses them pays.
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
