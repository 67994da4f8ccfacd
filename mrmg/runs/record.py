"""What a run folder holds, read back for its report."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mrmg.energy.audit_record import EnergyAudit
from mrmg.errors import Fault, RunFolderError
from mrmg.plans import Plan, PlanStatus, plan_in_force
from mrmg.runs.arguments import RunArguments, recorded
from mrmg.runs.folder import RunFolder, existing
from mrmg.runs.summary import outcomes_in, summarize
from mrmg.scene.loading import load_scene
from mrmg.scene.types import Scene
from mrmg.simulation.log import ExecutionLog, require_same_mission
from mrmg.studies.outcomes import ROBUSTNESS_FILE, Study, load_studies
from mrmg.verification.verdict import Verdict


@dataclass(frozen=True, slots=True, kw_only=True)
class RunRecord:
    """Everything a run folder holds; what was not reached is None.

    Attributes:
        folder: where the run lies.
        scene: what was to be solved.
        summary: content of `summary.json`, worked out anew where it is missing.
        planning: content of `planning.json`.
        arguments: what the run was started with.
        plan: the first one, or the one in force where the mission was replanned.
        verdict, log, audit: outcomes of the other steps.
        studies: trials of the first plan under disturbances.
    """

    folder: Path
    scene: Scene
    summary: Mapping[str, Any]
    planning: Mapping[str, Any]
    arguments: RunArguments
    plan: Plan | None
    verdict: Verdict | None
    log: ExecutionLog | None
    audit: EnergyAudit | None
    studies: tuple[Study, ...] = ()


def read_record(run_folder: Path, *, trust_code: bool = False) -> RunRecord:
    """Read a run folder.

    Args:
        run_folder: the run; at least planned.
        trust_code: whether robot models may bring Python code (`loading.trust`).

    Raises:
        RunFolderError: if a file is missing, cannot be read, or is of another scene.
    """
    if not (run_folder / "planning.json").exists():
        existing(run_folder)
        remedy = f"'mrmg run SCENE --out {run_folder}' goes on with it"
        fault = Fault("planning.json", f"missing: the run was stopped early; {remedy}")
        raise RunFolderError(str(run_folder), [fault])
    run = RunFolder(run_folder)
    planning = run.read_json("planning.json", remedy="mrmg plan")
    scene = load_scene(run_folder / "scene.yaml", trust_code=trust_code)
    found: dict[str, Any] = dict.fromkeys(("plan", "verdict", "log", "audit"))
    solved = planning["status"] == PlanStatus.SOLVED.value
    if solved and (run_folder / "plan.json").exists():
        found["plan"] = plan_in_force(run_folder)
        require_same_mission(scene, found["plan"])
        found |= outcomes_in(run_folder, scene)
        if (run_folder / ROBUSTNESS_FILE).exists():
            found["studies"] = load_studies(run_folder, Plan.load(run_folder))
    if (run_folder / "summary.json").exists():
        summary = run.read_json("summary.json", remedy="mrmg report")
    else:
        summary = summarize(scene, run_folder)
    return RunRecord(
        folder=run_folder,
        scene=scene,
        summary=summary,
        planning=planning,
        arguments=recorded(run),
        **found,
    )
