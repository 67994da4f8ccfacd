"""Many trials of one plan under disturbances, and what they add up to."""

from __future__ import annotations

import shutil
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from mrmg import storage
from mrmg.energy.audit import audit
from mrmg.errors import UsageError
from mrmg.plans import Plan, PlanStatus
from mrmg.runs.arguments import RunArguments, recorded
from mrmg.runs.drive import drive
from mrmg.runs.folder import TRIALS_FOLDER, Step
from mrmg.runs.steps import Run
from mrmg.scene.driven_parts import require_drivable
from mrmg.scene.types import Scene
from mrmg.simulation.disturbance_spec import written_out
from mrmg.studies.engine import Engine
from mrmg.studies.outcomes import Study, Trial, assess_trial, save_study
from mrmg.studies.trials import Job, OnTrial, completed_trials


def study_robustness(
    run: Run,
    *,
    trials: int = 100,
    seed: int = 0,
    disturb: str = "",
    workers: int = 1,
    on_trial: OnTrial | None = None,
) -> Study:
    """Drive the plan of a run under disturbances of the seeds seed, seed + 1, ...

    Trials that the run folder already holds are not made again, so that a study that
    was stopped is taken up, and a larger one grows from a smaller one. The outcome does
    not depend on the number of workers.

    Args:
        run: with a plan in its folder; its controller drives.
        trials: how many, at least 1.
        seed: of the first trial's disturbance.
        disturb: what to draw from, as `simulation.disturbance_spec` reads it.
        workers: processes that drive.
        on_trial: called after every trial, for those of earlier calls first.

    Raises:
        UsageError: if the run has no plan or a robot that can only be planned for, or
            `disturb` cannot be read.
        MachineError: if a worker was killed; what is done is kept.
    """
    if run.status() is not PlanStatus.SOLVED:
        raise UsageError(
            f"{run.folder.path} holds no plan (planning ended {run.status().value}); "
            "there is nothing to drive"
        )
    require_drivable(run.scene.robots)
    arguments = replace(run.arguments, disturb=written_out(disturb), disturb_seed=0)
    place = _trials_folder(run, arguments)
    mission = run.scene, run.plan()
    jobs = [
        Job(
            path=place / f"{number:06d}.json",
            shared=mission,
            item=replace(arguments, disturb_seed=number),
        )
        for number in range(seed, seed + trials)
    ]
    done: dict[int, Trial] = {}
    for number, content, _ in completed_trials(
        jobs, make_trial, Engine(workers=workers), check=_read
    ):
        done[number] = storage.typed(Trial, content)
        if on_trial is not None:
            feasible = sum(trial.feasible for trial in done.values())
            on_trial(len(done), trials, feasible)
    study = Study(
        options=_execute_options(arguments, recorded(run.folder)),
        trials=tuple(done[number] for number in sorted(done)),
    )
    save_study(run.folder.path, run.scene, run.plan(), study)
    return study


def _execute_options(
    arguments: RunArguments, of_run: RunArguments
) -> dict[str, str | bool]:
    """Return the options with which `mrmg execute` drives as `arguments` want it.

    Where it is not told controller and plant, it takes those of the run, which need not
    be the usual ones.
    """
    changed: dict[str, str | bool] = {"replan": True} if arguments.replan else {}
    for name in ("controller", "plant"):
        value, usual = getattr(arguments, name), getattr(RunArguments(), name)
        if not value == usual == getattr(of_run, name):
            changed[name] = value
    return {"disturb": arguments.disturb or "", **changed}


def _trials_folder(run: Run, arguments: RunArguments) -> Path:
    """Return where trials of this plan, driven so, lie; drop those of other plans."""
    plans = run.folder.file(TRIALS_FOLDER)
    own = plans / run.plan().digest
    for other in plans.glob("*"):
        if other != own:
            shutil.rmtree(other)
    # The mark of an execution is that of everything that decides its outcome.
    mark = replace(run, arguments=arguments).fingerprint(Step.EXECUTE)
    return own / mark


def make_trial(mission: tuple[Scene, Plan], arguments: RunArguments) -> dict[str, Any]:
    """Drive a plan as the arguments want it, and judge the drive."""
    scene, plan = mission
    driven = drive(scene, plan, arguments)
    account = audit(scene, driven.plan, driven.log)
    return asdict(assess_trial(scene, driven.log, account))


def _read(job: Job, content: Any) -> Trial:
    return storage.typed(Trial, content)
