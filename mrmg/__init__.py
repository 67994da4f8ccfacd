"""mrmg: mission planning for fleets of energy-limited robots, executed in MuJoCo.

The verbs of the command line are the functions of this package:

    scene = mrmg.load_scene("quickstart")
    result = mrmg.plan(scene, seed=0)
    verdict = mrmg.verify(scene, result.plan)
    log = mrmg.execute(scene, result.plan)
    account = mrmg.audit(scene, result.plan, log)
    mrmg.render(scene, result.plan, log, Path("mission.mp4"))

A mission that may go wrong is driven under supervision, which plans anew:

    driven = mrmg.drive(scene, result.plan, faults=["r2@40s"])
    account = mrmg.audit(scene, driven.plan, driven.log)

or all of it, with a run folder: `mrmg.run("quickstart", out=Path("runs/first"))`.
Everything is imported on first use, so that importing the package stays cheap.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mrmg.energy.audit import audit
    from mrmg.energy.audit_record import EnergyAudit
    from mrmg.planning import PlannerParams
    from mrmg.planning import plan_mission as plan
    from mrmg.plans import Plan
    from mrmg.runs.pipeline import run
    from mrmg.scene.loading import load_scene
    from mrmg.scene.types import Scene
    from mrmg.simulation.log import ExecutionLog
    from mrmg.simulation.simulation import simulate as execute
    from mrmg.supervision.driving import drive_mission as drive
    from mrmg.verification.verdict import Verdict
    from mrmg.verification.verify import verify
    from mrmg.viz.video import render_video as render

__version__ = "0.1.0"

__all__ = [
    "EnergyAudit",
    "ExecutionLog",
    "Plan",
    "PlannerParams",
    "Scene",
    "Verdict",
    "__version__",
    "audit",
    "drive",
    "execute",
    "load_scene",
    "plan",
    "render",
    "run",
    "verify",
]

_HOME = {
    "EnergyAudit": ("mrmg.energy.audit_record", "EnergyAudit"),
    "ExecutionLog": ("mrmg.simulation.log", "ExecutionLog"),
    "Plan": ("mrmg.plans", "Plan"),
    "PlannerParams": ("mrmg.planning", "PlannerParams"),
    "Scene": ("mrmg.scene.types", "Scene"),
    "Verdict": ("mrmg.verification.verdict", "Verdict"),
    "audit": ("mrmg.energy.audit", "audit"),
    "drive": ("mrmg.supervision.driving", "drive_mission"),
    "execute": ("mrmg.simulation.simulation", "simulate"),
    "load_scene": ("mrmg.scene.loading", "load_scene"),
    "plan": ("mrmg.planning", "plan_mission"),
    "render": ("mrmg.viz.video", "render_video"),
    "run": ("mrmg.runs.pipeline", "run"),
    "verify": ("mrmg.verification.verify", "verify"),
}
"""Module and name of what is imported on first use."""


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'mrmg' has no attribute {name!r}")
    from importlib import import_module

    module, attribute = _HOME[name]
    return getattr(import_module(module), attribute)


def __dir__() -> list[str]:
    return sorted(__all__)
