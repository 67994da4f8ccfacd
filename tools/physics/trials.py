"""Trials of scenes 1 and 4 under disturbances, with and without replanning."""

from __future__ import annotations

import math
import statistics
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

from protocol import Row, state

import mrmg
from mrmg.runs.drive import drive as drive_as
from mrmg.runs.folder import RunFolder, Step
from mrmg.runs.steps import Run, RunArguments
from mrmg.studies.outcomes import Study, Trial, wilson_interval
from mrmg.studies.robustness.study import study_robustness
from physics.figures import Figure, verdict

SCENES = ("scene1", "scene4")


@dataclass(frozen=True, slots=True, kw_only=True)
class Kind:
    """A row of trials.

    Attributes:
        disturb: disturbances over the default ones.
        soc_margin: state-of-charge margin of the plans; None for the default.
        replan: whether the rest is planned anew where a mission leaves its plan.
        least: share of the trials that must be feasible; 0 for rows that are not judged
            by themselves.
    """

    disturb: str = ""
    soc_margin: float | None = None
    replan: bool = False
    least: float = 0.0

    @property
    def plans(self) -> str:
        """What kind of plans are driven."""
        return "default" if self.soc_margin is None else f"margin {self.soc_margin:g}"


DEFAULT = Kind(least=0.95)
ROLLING = Kind(disturb="rolling=+30%")
"""Not judged: what the default state-of-charge margin carries without replanning."""
REPLANNED = replace(ROLLING, replan=True, least=0.9)
TIGHT = replace(ROLLING, soc_margin=0.0)
"""Plans that use all they may show what replanning gains: those with the default margin
carry more resistance by themselves."""
SAVED = replace(TIGHT, replan=True, least=0.9)
KINDS = (DEFAULT, ROLLING, REPLANNED, TIGHT, SAVED)
VISIBLE_GAIN = 0.05
"""By how much replanning must raise that share."""

HEAD = (
    "scene", "plans", "disturbance", "replanning", "feasible", "95 % interval",
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


def disturbance_figures(options: TrialOptions) -> tuple[list[Figure], list[Row]]:
    """Print a row per scene and kind of disturbance; return what they came to."""
    print("\n" + " | ".join(HEAD))
    figures: list[Figure] = []
    rows: list[Row] = []
    studies: dict[Kind, list[Study]] = {kind: [] for kind in KINDS}
    for source in SCENES:
        for kind in KINDS:
            study = study_of(source, kind, options)
            studies[kind].append(study)
            figure = figure_of(source, kind, study)
            faults = [] if figure.holds else [f"{figure.found} not {figure.asked}"]
            output = verdict(faults) if kind.least else "not judged"
            rows.append(study_row(source, kind, study))
            print(" | ".join([*cells(rows[-1]), output]), flush=True)
            if kind.least:
                figures.append(figure)
    figures.append(gain_figure(studies[TIGHT], studies[SAVED]))
    return [*figures, repeated_figure(options)], rows


def figure_of(source: str, kind: Kind, study: Study) -> Figure:
    """Return how many trials of one row are feasible, and how many must be."""
    under = f"default and {kind.disturb}" if kind.disturb else "default disturbances"
    plans = "" if kind.soc_margin is None else f", plans with {kind.plans}"
    how = ", replanning" if kind.replan else ""
    total = len(study.trials)
    needed = math.ceil(kind.least * total - 1e-9)
    what = f"{source}, {under}{plans}{how}"
    return Figure.count(what, study.feasible, total, needed)


def gain_figure(alone: Sequence[Study], replanned: Sequence[Study]) -> Figure:
    """Return what replanning gains over all scenes.

    A scene whose plans carry more resistance anyway leaves nothing to be gained.
    """
    gain = share(replanned) - share(alone)
    asked = f">= {VISIBLE_GAIN:+.0%}"
    what = "gain by replanning over both scenes"
    holds = gain >= VISIBLE_GAIN
    return Figure(what, f"{gain:+.1%}", asked, holds, gain, VISIBLE_GAIN)


def share(studies: Sequence[Study]) -> float:
    """Return the share of feasible trials of all studies."""
    trials = sum(len(study.trials) for study in studies)
    return sum(study.feasible for study in studies) / trials


def study_row(source: str, kind: Kind, study: Study) -> Row:
    """Return the table's row of one study, as numbers."""
    low, high = wilson_interval(study.feasible, len(study.trials))
    charges = [trial.charge_fraction for trial in study.trials]
    return {
        "scene": source,
        "plans": kind.plans,
        "disturb": f"default, {kind.disturb}" if kind.disturb else "default",
        "replan": kind.replan,
        "feasible": study.feasible,
        "trials": len(study.trials),
        "interval_95": [low, high],
        "charge_worst": min(charges),
        "charge_median": statistics.median(charges),
        "failures": causes(study),
        "least": kind.least or None,
    }


def cells(row: Row) -> list[str]:
    """Return the table's row of one study, as it is printed."""
    low, high = row["interval_95"]
    return [
        row["scene"],
        row["plans"],
        row["disturb"],
        "yes" if row["replan"] else "no",
        f"{row['feasible']}/{row['trials']}",
        f"{low:.3f}-{high:.3f}",
        f"{row['charge_worst']:.2f}, {row['charge_median']:.2f}",
        ", ".join(f"{n} {cause}" for cause, n in row["failures"].items()),
    ]


def causes(study: Study) -> dict[str, int]:
    """Return how many trials failed by each cause; one may fail by several."""
    return Counter(cause for trial in study.trials for cause in trial.causes)


def study_of(source: str, kind: Kind, options: TrialOptions) -> Study:
    """Return all trials of one row, making those that are missing.

    They are spread evenly over the plans; no two have the same disturbance.
    """
    per_plan = options.trials // len(options.plan_seeds)
    trials: list[Trial] = []
    for number, seed in enumerate(options.plan_seeds):
        with planned_run(source, seed, kind.soc_margin, options) as run:
            arguments = replace(run.arguments, replan=kind.replan)
            driven = replace(run, arguments=arguments)
            study = study_robustness(
                driven,
                trials=per_plan,
                seed=number * per_plan,
                disturb=kind.disturb,
                workers=options.workers,
            )
        trials += study.trials
    return Study(options=study.options, trials=tuple(trials))


@contextmanager
def planned_run(
    source: str, seed: int, soc_margin: float | None, options: TrialOptions
) -> Iterator[Run]:
    """Open the run folder of one plan, made if it is missing."""
    scene = mrmg.load_scene(source)
    arguments = RunArguments(seed=seed, soc_margin=soc_margin)
    plans = "" if soc_margin is None else f"-margin{soc_margin:g}"
    folder = RunFolder(options.runs / state() / f"{source}-s{seed}{plans}")
    with folder.opened_for_writing():
        run = Run(scene=scene, arguments=arguments, folder=folder)
        run.ensure(Step.PLAN)
        yield run


def repeated_figure(options: TrialOptions) -> Figure:
    """Drive a worker's first trial in this process, to the last bit."""
    trial = study_of(SCENES[0], DEFAULT, options).trials[0]
    with planned_run(SCENES[0], options.plan_seeds[0], None, options) as run:
        arguments = replace(run.arguments, disturb="", disturb_seed=trial.seed)
        again = drive_as(run.scene, run.plan(), arguments)
    same = again.log.digest == trial.log_digest
    output = "same log" if same else "another log"
    return Figure("a trial by a worker and here", output, "same log", same)
