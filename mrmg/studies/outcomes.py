"""What many disturbed executions of one plan say about it.

A trial is feasible when its audit finds so: all goals visited, no contact, no battery
below its reserve, driven to the end. Out of n trials of which k were feasible, the
probability of a feasible mission is k / n, with the interval of Wilson (1927),

    (p + z^2/2n -+ z sqrt(p (1 - p)/n + z^2/4n^2)) / (1 + z^2/n),    p = k/n,

which is good for small n and for p near 1.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from mrmg import storage
from mrmg.energy.audit_record import EnergyAudit
from mrmg.plans import Plan
from mrmg.scene.types import Scene
from mrmg.simulation.log import ExecutionLog
from mrmg.verification.distances import obstacle_distance, robot_distance

ROBUSTNESS_FORMAT = 1
ROBUSTNESS_FILE = "robustness.json"

CONFIDENCE = 0.95

_QUANTILES = {"p05": 0.05, "median": 0.5, "p95": 0.95}


@dataclass(frozen=True, slots=True, kw_only=True)
class Trial:
    """The outcome of one disturbed execution.

    Attributes:
        seed: of its disturbance.
        feasible: whether the mission was done.
        causes: kinds of failure, as in `EnergyAudit`.
        reasons: the audit's sentences.
        goals_visited: number of goals.
        charge_fraction: least content of any battery over its actual capacity;
            negative where it ran empty.
        charge_J: the same battery's content.
        charge_robot: id of its robot.
        obstacle_clearance_m: least distance to an obstacle or the bounds at any tick.
        robot_distance_m: least distance of two robots at any tick; None for one robot.
        tracking_max_m: largest distance from the plan.
        duration_s: simulated time.
        log_digest: `ExecutionLog.digest`.
    """

    seed: int
    feasible: bool
    causes: tuple[str, ...]
    reasons: tuple[str, ...]
    goals_visited: int
    charge_fraction: float
    charge_J: float
    charge_robot: str
    obstacle_clearance_m: float
    robot_distance_m: float | None
    tracking_max_m: float
    duration_s: float
    log_digest: str


def assess_trial(scene: Scene, log: ExecutionLog, account: EnergyAudit) -> Trial:
    """Return what one execution came to; the seed of one without disturbance is 0.

    Args:
        scene: what was to be done.
        log: of the simulation.
        account: the audit of the plan and this log.
    """
    actual = log.disturbance.actual_scene(scene) if log.disturbance else scene
    weakest = min(account.robots, key=lambda robot: robot.min_charge_fraction)
    capacity_J = actual.robot(weakest.robot).battery.capacity_J
    return Trial(
        seed=log.disturbance.seed if log.disturbance else 0,
        feasible=account.mission_ok,
        causes=account.causes,
        reasons=account.reasons,
        goals_visited=len(account.goals_visited),
        charge_fraction=weakest.min_charge_fraction,
        charge_J=weakest.min_charge_fraction * capacity_J,
        charge_robot=weakest.robot,
        obstacle_clearance_m=min(
            float(obstacle_distance(scene, robot, poses).min())
            for robot, poses in zip(scene.robots, log.state, strict=True)
        ),
        robot_distance_m=(
            float(robot_distance(scene.robots, list(log.state)).min())
            if len(scene.robots) > 1
            else None
        ),
        tracking_max_m=max(robot.tracking_max_m for robot in account.robots),
        duration_s=float(log.time_s[-1]),
        log_digest=log.digest,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Study:
    """All trials of one plan under one kind of disturbance.

    Attributes:
        options: the options of `mrmg execute` that all trials share, by name without
            dashes; those that need not be named are left out.
        trials: in order of their seeds; at least one.
    """

    options: Mapping[str, str | bool]
    trials: tuple[Trial, ...]

    @property
    def feasible(self) -> int:
        """Number of feasible trials."""
        return sum(trial.feasible for trial in self.trials)

    @property
    def worst(self) -> Trial:
        """The trial that failed most, or else came closest to failing."""
        return min(
            self.trials,
            key=lambda trial: (
                trial.feasible,
                trial.goals_visited,
                trial.charge_fraction,
                trial.seed,
            ),
        )

    def replay_options(self, trial: Trial) -> list[str]:
        """Return the options with which `mrmg execute` repeats a trial."""
        words = []
        for name, value in self.options.items():
            words.append(f"--{name}")
            words += [value] if isinstance(value, str) and value else []
        return [*words, "--disturb-seed", str(trial.seed)]

    def to_json(self) -> dict[str, Any]:
        """Return options, figures and trials as JSON data."""
        low, high = wilson_interval(self.feasible, len(self.trials))
        return {
            "options": dict(self.options),
            "trials": len(self.trials),
            "feasible": self.feasible,
            "probability": self.feasible / len(self.trials),
            "confidence": CONFIDENCE,
            "interval": [low, high],
            # A trial may fail by several causes.
            "failures": Counter(cause for each in self.trials for cause in each.causes),
            "margins": self._margins(),
            "worst": {
                "seed": self.worst.seed,
                "execute": self.replay_options(self.worst),
            },
            "outcomes": [asdict(trial) for trial in self.trials],
        }

    def _margins(self) -> dict[str, dict[str, float]]:
        """Return worst and quantiles of what kept the trials from failing."""
        margins = {}
        for name, worst in _MARGINS.items():
            values = [getattr(trial, name) for trial in self.trials]
            if None not in values:
                margins[name] = {
                    "worst": float(worst(values)),
                    **{
                        key: float(np.quantile(values, share))
                        for key, share in _QUANTILES.items()
                    },
                }
        return margins


_MARGINS = {
    "charge_fraction": min,
    "charge_J": min,
    "obstacle_clearance_m": min,
    "robot_distance_m": min,
    "tracking_max_m": max,
}
"""What is reported of the trials, and which end of it is the bad one."""


def wilson_interval(successes: int, trials: int) -> tuple[float, float]:
    """Return the interval that holds the probability with `CONFIDENCE`.

    Args:
        successes: between 0 and `trials`.
        trials: at least 1.
    """
    from scipy.stats import binomtest  # which takes long to import

    found = binomtest(successes, trials).proportion_ci(CONFIDENCE, method="wilson")
    return float(found.low), float(found.high)


def save_study(folder: Path, scene: Scene, plan: Plan, study: Study) -> None:
    """Write `robustness.json`; studies of the same plan under other options stay."""
    others = [
        item
        for item in load_studies(folder, plan)
        if dict(item.options) != dict(study.options)
    ]
    studies = [item.to_json() for item in (*others, study)]
    studies.sort(key=lambda item: storage.canonical_json(item["options"]))
    storage.write_json(
        folder / ROBUSTNESS_FILE,
        {
            "format": ROBUSTNESS_FORMAT,
            "scene": scene.name,
            "plan_digest": plan.digest,
            "studies": studies,
        },
    )


def load_studies(folder: Path, plan: Plan) -> tuple[Study, ...]:
    """Return the studies of `plan` that lie in a run folder; those of others do not.

    Raises:
        RunFolderError: if the file cannot be read.
    """
    path = folder / ROBUSTNESS_FILE
    if not path.exists():
        return ()
    remedy = "delete it and run it again"
    with storage.damage_reported(path, "not readable", remedy):
        content = storage.of_format(path.read_bytes(), ROBUSTNESS_FORMAT)
        rows = content["studies"] if content["plan_digest"] == plan.digest else ()
        return tuple(
            storage.typed(Study, {"options": row["options"], "trials": row["outcomes"]})
            for row in rows
        )
