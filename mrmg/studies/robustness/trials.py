"""One disturbed execution of a run's plan, from its folder to a file of its outcome.

Everything a trial needs can be sent to another process, and its file is written by
whoever made it: a trial that is done stays done, whatever becomes of the others.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

from mrmg import storage
from mrmg.plans import Plan
from mrmg.runs.arguments import RunArguments
from mrmg.runs.drive import drive
from mrmg.scene.loading import load_scene
from mrmg.scene.types import Scene
from mrmg.studies.outcomes import Trial, assess_trial


@dataclass(frozen=True, slots=True, kw_only=True)
class TrialJob:
    """What one trial is made from.

    Attributes:
        folder: run folder with scene and plan.
        arguments: how to drive, the seed of the disturbance included.
        path: file of the outcome.
    """

    folder: Path
    arguments: RunArguments
    path: Path

    @property
    def seed(self) -> int:
        """Seed of the disturbance."""
        return self.arguments.disturb_seed

    def outcome(self) -> Trial | None:
        """Return the outcome if the trial was made; None if not."""
        try:
            return Trial.from_json(storage.read_json(self.path))
        except (OSError, ValueError, TypeError, KeyError):
            return None


def jobs_of(
    folder: Path, arguments: RunArguments, trials_folder: Path, seeds: range
) -> list[TrialJob]:
    """Return one job a seed.

    Args:
        folder: run folder with scene and plan.
        arguments: how to drive.
        trials_folder: where the outcomes lie.
        seeds: of the disturbances.
    """
    return [
        TrialJob(
            folder=folder,
            arguments=replace(arguments, disturb_seed=seed),
            path=trials_folder / f"{seed:06d}.json",
        )
        for seed in seeds
    ]


def make_trial(job: TrialJob) -> Trial:
    """Drive, judge, and write the outcome."""
    scene, plan = _mission(job.folder)
    driven = drive(scene, plan, job.arguments)
    trial = assess_trial(scene, driven.plan, driven.log)
    storage.write_json(job.path, trial.to_json())
    return trial


@lru_cache(maxsize=1)
def _mission(folder: Path) -> tuple[Scene, Plan]:
    return load_scene(folder / "scene.yaml"), Plan.load(folder)
