"""Trials of scenes 1 and 4 under disturbances, with and without replanning."""

from __future__ import annotations

import math
import statistics
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import mrmg
from mrmg.results.robustness import Study, Trial, wilson_interval
from mrmg.robustness import study_robustness
from mrmg.run_folder import RunFolder, Step
from mrmg.steps import Run, RunArguments
from mrmg.steps import drive as drive_as
from physics.figures import Figure, verdict
from physics.protocol import state

SCENES = ("scene1", "scene4")
KINDS = (("", False, 0.95), ("rolling=+30%", False, 0.0), ("rolling=+30%", True, 0.9))
"""Disturbances over the default ones, replanning, least share of feasible trials."""
VISIBLE_GAIN = 0.05
"""By how much replanning must raise that share."""

HEAD = (
    "scene", "disturbance", "replanning", "feasible", "95 % interval",
    "least charge: worst, median", "failures", "",
)  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class TrialOptions:
    """How many trials are made, of which plans, and where they are kept.

    Attributes:
        trials: of each scene and kind of disturbance.
        plan_seeds: of the plans over which they are spread.
        workers: processes that make them.
        runs: folder of run folders.
    """

    trials: int
    plan_seeds: range
    workers: int
    runs: Path


def disturbance_figures(options: TrialOptions) -> list[Figure]:
    """Print a row per scene and kind of disturbance; return what they came to."""
    print("\n" + " | ".join(HEAD))
    figures: list[Figure] = []
    stressed: dict[bool, list[Study]] = {False: [], True: []}
    for source in SCENES:
        for disturb, replan, least in KINDS:
            study = study_of(source, disturb, replan, options)
            if disturb:
                stressed[replan].append(study)
            figure = figure_of(source, disturb, replan, study, least)
            faults = [] if figure.holds else [f"{figure.found} not {figure.asked}"]
            print(" | ".join([*cells(source, disturb, replan, study), verdict(faults)]))
            if least:
                figures.append(figure)
    return [
        *figures,
        gain_figure(stressed[False], stressed[True]),
        repeated_figure(options),
    ]


def figure_of(
    source: str, disturb: str, replan: bool, study: Study, least: float
) -> Figure:
    """Return how many trials of one row are feasible, and how many must be."""
    under = f"default and {disturb}" if disturb else "default disturbances"
    how = ", replanning" if replan else ""
    total = len(study.trials)
    needed = math.ceil(least * total - 1e-9)
    return Figure.count(f"{source}, {under}{how}", study.feasible, total, needed)


def gain_figure(alone: Sequence[Study], replanned: Sequence[Study]) -> Figure:
    """Return what replanning gains over all scenes.

    A scene whose plans carry more resistance anyway leaves nothing to be gained.
    """
    gain = share(replanned) - share(alone)
    asked = f">= {VISIBLE_GAIN:+.0%}"
    what = "gain by replanning over both scenes"
    return Figure(what, f"{gain:+.1%}", asked, gain >= VISIBLE_GAIN)


def share(studies: Sequence[Study]) -> float:
    """Return the share of feasible trials of all studies."""
    trials = sum(len(study.trials) for study in studies)
    return sum(study.feasible for study in studies) / trials


def cells(source: str, disturb: str, replan: bool, study: Study) -> list[str]:
    """Return the table's row of one study."""
    low, high = wilson_interval(study.feasible, len(study.trials))
    charges = [trial.charge_fraction for trial in study.trials]
    return [
        source,
        f"default, {disturb}" if disturb else "default",
        "yes" if replan else "no",
        f"{study.feasible}/{len(study.trials)}",
        f"{low:.3f}-{high:.3f}",
        f"{min(charges):.2f}, {statistics.median(charges):.2f}",
        ", ".join(f"{n} {cause}" for cause, n in causes(study).items()),
    ]


def causes(study: Study) -> dict[str, int]:
    """Return how many trials failed by each cause; one may fail by several."""
    return Counter(cause for trial in study.trials for cause in trial.causes)


def study_of(source: str, disturb: str, replan: bool, options: TrialOptions) -> Study:
    """Return all trials of one row, making those that are missing.

    They are spread evenly over the plans; no two have the same disturbance.
    """
    per_plan = options.trials // len(options.plan_seeds)
    trials: list[Trial] = []
    for number, seed in enumerate(options.plan_seeds):
        with planned_run(source, seed, options) as run:
            driven = replace(run, arguments=replace(run.arguments, replan=replan))
            study = study_robustness(
                driven,
                trials=per_plan,
                seed=number * per_plan,
                disturb=disturb,
                workers=options.workers,
            )
        trials += study.trials
    return Study(options=study.options, trials=tuple(trials))


@contextmanager
def planned_run(source: str, seed: int, options: TrialOptions) -> Iterator[Run]:
    """Open the run folder of one plan, made if it is missing."""
    scene = mrmg.load_scene(source)
    folder = RunFolder(options.runs / state() / f"{source}-s{seed}")
    with folder.opened_for_writing():
        run = Run(scene=scene, arguments=RunArguments(seed=seed), folder=folder)
        run.ensure(Step.PLAN)
        yield run


def repeated_figure(options: TrialOptions) -> Figure:
    """Drive a worker's first trial in this process, to the last bit."""
    trial = study_of(SCENES[0], "", False, options).trials[0]
    with planned_run(SCENES[0], options.plan_seeds[0], options) as run:
        arguments = replace(run.arguments, disturb="", disturb_seed=trial.seed)
        again = drive_as(run.scene, run.plan(), arguments)
    same = again.log.digest == trial.log_digest
    told = "same log" if same else "another log"
    return Figure("a trial by a worker and here", told, "same log", same)
