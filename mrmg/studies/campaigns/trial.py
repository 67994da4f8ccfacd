"""One trial of a campaign, on whatever machine: planned, verified, driven, audited."""

from __future__ import annotations

import math
import tempfile
import threading
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mrmg.energy.audit import audit
from mrmg.errors import MachineError, MrmgError
from mrmg.plans import Plan, PlanResult, PlanStatus
from mrmg.runs.arguments import RunArguments
from mrmg.runs.code_digest import code_digest
from mrmg.runs.drive import drive
from mrmg.runs.steps import planner_params
from mrmg.scene.types import Scene
from mrmg.studies.campaigns.scenes import SceneSource
from mrmg.studies.outcomes import assess_trial

if TYPE_CHECKING:
    from mrmg.energy.audit_record import EnergyAudit
    from mrmg.planning import PlannerParams
    from mrmg.simulation.log import ExecutionLog
    from mrmg.verification.verdict import Verdict

REFUSED, ERROR = "refused", "error"
"""Statuses of trials whose scene or combination of factors is not allowed, and of those
that something broke down in, which are made again by the next command."""

_one_at_a_time = threading.Lock()
"""A worker with several threads makes one trial after the other."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TrialOrder:
    """What one trial is made from, besides the source of its scene.

    Attributes:
        arguments: of the run, seeds included.
        changes: keys of the scene file with other values.
        code: `runs.code_digest` of whoever asks.
        with_run: whether the files of a run folder are wanted.
    """

    arguments: RunArguments
    changes: Mapping[str, Any]
    code: str
    with_run: bool


def make_trial(source: SceneSource, order: TrialOrder) -> dict[str, Any]:
    """Make one trial.

    Returns:
        `result`, which is the same on every machine, `time_s` by part, and where they
        are wanted `files` of a run folder.

    Raises:
        MachineError: if this worker has another version of mrmg, or no room.
    """
    if order.code != code_digest():
        raise MachineError(
            "a worker has another version of mrmg, MuJoCo or their sources than the "
            "command that asks; install the same one wherever workers run"
        )
    with _one_at_a_time:
        began = time.perf_counter()
        try:
            made = _made(source, order)
        except (OSError, MemoryError) as error:
            raise MachineError(f"a worker cannot go on: {error}") from error
        except MachineError as error:
            made = _failed(ERROR, str(error))
        except MrmgError as error:
            made = _failed(REFUSED, str(error))
        except Exception as error:  # one trial of thousands is no reason to stop
            made = _failed(ERROR, f"{type(error).__name__}: {error}")
        spent_s = time.perf_counter() - began
    # A plan that several trials share counts in each of them.
    parts_s = [part_s or 0.0 for part_s in made["time_s"].values()]
    made["time_s"]["total"] = max(spent_s, sum(parts_s))
    for name, value in made["result"].items():
        if isinstance(value, float) and not math.isfinite(value):
            made["result"][name] = None  # JSON has no such numbers
    return made


def _failed(status: str, reason: str) -> dict[str, Any]:
    result = {"status": status, "feasible": False, "reason": " ".join(reason.split())}
    return {"result": result, "time_s": {}}


def _made(source: SceneSource, order: TrialOrder) -> dict[str, Any]:
    from mrmg.planning.preparation import compile_kernels
    from mrmg.scene.driven_parts import require_drivable
    from mrmg.verification.verify import verify

    arguments = order.arguments
    scene = arguments.scene(source.scene(arguments.seed, order.changes))
    require_drivable(scene.robots)
    began = time.perf_counter()
    params = planner_params(arguments)
    compile_kernels(params.planner)
    compile_s = time.perf_counter() - began
    if order.with_run:
        return _made_by_run(scene, arguments)
    planned, plan_s = _planned(
        scene, arguments.seed, params, arguments.skip_unreachable
    )
    result = _of_planning(scene, planned.status.value, planned.reason)
    if planned.plan is None:
        return {"result": result, "time_s": {"compile": compile_s, "plan": plan_s}}
    began = time.perf_counter()
    verdict = verify(scene, planned.plan)
    verified = time.perf_counter()
    driven = drive(scene, planned.plan, arguments)
    account = audit(scene, driven.plan, driven.log, **arguments.deciding("audit"))
    result |= _of_drive(scene, planned.plan, verdict, driven.log, account)
    drive_s = time.perf_counter() - verified
    parts_s = {"compile": compile_s, "plan": plan_s, "verify": verified - began}
    return {"result": result, "time_s": {**parts_s, "drive": drive_s}}


def _made_by_run(scene: Scene, arguments: RunArguments) -> dict[str, Any]:
    """Make a trial by a whole run, whose folder is read into memory."""
    from mrmg.runs import pipeline
    from mrmg.runs.record import read_record

    given = {each.name: getattr(arguments, each.name) for each in fields(arguments)}
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place) / "run"
        pipeline.run(scene, out=folder, **{**given, "video": None})
        record = read_record(folder, trust_code=scene.has_custom_motion)
        found = sorted(path for path in folder.rglob("*") if path.is_file())
        files = {str(path.relative_to(folder)): path.read_bytes() for path in found}
        planning = record.planning
        result = _of_planning(scene, planning["status"], planning["reason"])
        if record.log and record.verdict and record.audit:
            plan = Plan.load(folder)
            result |= _of_drive(scene, plan, record.verdict, record.log, record.audit)
    times_s = {"plan": planning["statistics"]["time_s"].get("total")}
    return {"result": result, "time_s": times_s, "files": files}


def _of_planning(scene: Scene, status: str, reason: str) -> dict[str, Any]:
    return {
        "status": status,
        "feasible": False,
        "causes": [] if status == PlanStatus.SOLVED.value else [status],
        "reason": " ".join(reason.split()),
        "goals_total": len(scene.goals),
    }


def _of_drive(
    scene: Scene, plan: Plan, verdict: Verdict, log: ExecutionLog, account: EnergyAudit
) -> dict[str, Any]:
    """Return the figures of a mission that was driven.

    Args:
        scene: the mission.
        plan: the first one.
        verdict: on it.
        log: of the drive.
        account: the audit of it.
    """
    trial = asdict(assess_trial(scene, log, account))
    unused = ("seed", "reasons", "charge_J", "charge_robot")
    errors = [robot.measured_error_pct for robot in account.robots]
    broken = [violation.message for violation in verdict.violations[:1]]
    figures = {name: value for name, value in trial.items() if name not in unused}
    return figures | {
        "feasible": verdict.ok and account.mission_ok,
        "reason": "; ".join([*broken, *account.reasons]),
        "causes": [*(["not verified"] if broken else []), *account.causes],
        "goals_skipped": len(plan.skipped),
        "cost_J": plan.cost_J,
        "makespan_s": plan.makespan_s,
        "metered_J": account.metered.total_J(),
        "measured_J": account.measured.total_J(),
        "measured_error_pct": max(errors, key=abs),
        "contacts": len(log.contacts),
        "recharges": len(account.recharges),
        "replans": sum(event.action == "replan" for event in log.events),
        "plan_digest": plan.digest,
    }


@lru_cache(maxsize=8)
def _planned(
    scene: Scene, seed: int, params: PlannerParams, skip_unreachable: bool
) -> tuple[PlanResult, float]:
    """Return a plan, which trials that differ in the drive share, and its time [s]."""
    from mrmg.planning import plan_mission

    began = time.perf_counter()
    found = plan_mission(
        scene, seed=seed, params=params, skip_unreachable=skip_unreachable
    )
    return found, time.perf_counter() - began
