"""Many trials of one plan: which are missing, who makes them, what they add up to."""

from __future__ import annotations

import multiprocessing
import shutil
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from dataclasses import replace
from pathlib import Path

from mrmg.errors import MachineError, UsageError
from mrmg.interruption import end_with_parent, sheltered_children
from mrmg.plans import PlanStatus
from mrmg.runs.arguments import RunArguments
from mrmg.runs.folder import TRIALS_FOLDER, Step
from mrmg.runs.steps import Run
from mrmg.scene.driven_parts import require_drivable
from mrmg.simulation.disturbance_spec import written_out
from mrmg.studies.outcomes import Study, Trial, save_study
from mrmg.studies.robustness.trials import TrialJob, jobs_of, make_trial

OnTrial = Callable[[int, int, int], None]
"""Called with (trials done, trials in all, feasible ones) after each trial."""


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
    jobs = jobs_of(run.folder.path, arguments, place, range(seed, seed + trials))
    done: list[Trial] = []
    for trial in _all_trials(jobs, workers):
        done.append(trial)
        if on_trial is not None:
            on_trial(len(done), trials, sum(item.feasible for item in done))
    done.sort(key=lambda trial: trial.seed)
    study = Study(options=execute_options(arguments), trials=tuple(done))
    save_study(run.folder.path, run.scene, run.plan(), study)
    return study


def execute_options(arguments: RunArguments) -> dict[str, str | bool]:
    """Return the options with which `mrmg execute` drives as `arguments` want it."""
    options: dict[str, str | bool] = {"disturb": arguments.disturb or ""}
    usual = RunArguments()
    for name in ("controller", "plant"):
        if getattr(arguments, name) != getattr(usual, name):
            options[name] = getattr(arguments, name)
    if arguments.replan:
        options["replan"] = True
    return options


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


def _all_trials(jobs: list[TrialJob], workers: int) -> Iterator[Trial]:
    """Yield every trial: what is there already, then the others as they are made."""
    missing = []
    for job in jobs:
        trial = job.outcome()
        if trial is None:
            missing.append(job)
        else:
            yield trial
    if workers == 1:
        yield from map(make_trial, missing)
    elif missing:
        yield from _made_by_workers(missing, workers)


def _made_by_workers(jobs: list[TrialJob], workers: int) -> Iterator[Trial]:
    context = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(
        min(workers, len(jobs)), mp_context=context, initializer=end_with_parent
    )
    try:
        with sheltered_children():
            waiting = [pool.submit(make_trial, job) for job in jobs]
        for future in as_completed(waiting):
            yield future.result()
    except BrokenProcessPool as error:
        raise MachineError(
            "a worker process was killed (out of memory?); the same command goes on "
            "from the trials that are done, fewer --workers need less memory"
        ) from error
    finally:
        pool.shutdown(wait=True, cancel_futures=True)
