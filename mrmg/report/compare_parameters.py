"""What runs were made with, and in what of it they differ."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from mrmg.runs.arguments import RunArguments
from mrmg.runs.options import options_of, value_text
from mrmg.runs.record import RunRecord
from mrmg.scene.objective import ENERGY

MISSING = "–"


def problem_digest(record: RunRecord) -> str:
    """Return the fingerprint of a run's scene, whatever its plans were to minimise."""
    plain = replace(record.scene, objective=ENERGY, time_limit_s=math.inf)
    return plain.digest


def scene_names(records: Sequence[RunRecord]) -> tuple[str, ...]:
    """Return the scenes' names, with digests where scenes of one name differ."""
    scenes = [(record.scene.name, problem_digest(record)) for record in records]
    scenes_of_name = Counter(name for name, _ in {*scenes})
    return tuple(
        name if scenes_of_name[name] == 1 else f"{name} ({digest[:6]})"
        for name, digest in scenes
    )


def objective(record: RunRecord) -> str:
    """Return what a run's plans were to minimise."""
    wanted = record.scene.objective
    if wanted.name != "blend":
        return wanted.name
    return (
        f"{wanted.energy_weight:g} / J energy, {wanted.makespan_weight:g} / s makespan"
    )


def parameters(records: Sequence[RunRecord]) -> dict[str, tuple[str, ...]]:
    """Return everything that decides runs, by name: one text per run."""
    read: dict[str, Callable[[RunRecord], str]] = {
        "objective": objective,
        "time limit": lambda record: _seconds(record.scene.time_limit_s),
        "seed": lambda record: str(record.summary["seed"]),
    }
    for option in options_of(RunArguments):
        name = option.flag.removeprefix("--").replace("-", " ")
        if option.decides and name not in read:
            read[name] = _argument(option.name)
    read["version"] = lambda record: str(record.summary["versions"].get("mrmg", ""))
    return {
        "scene": scene_names(records),
        **{name: tuple(of(item) for item in records) for name, of in read.items()},
    }


def differences(records: Sequence[RunRecord]) -> dict[str, tuple[str, ...]]:
    """Return the parameters that are not the same for all runs."""
    return {
        name: texts for name, texts in parameters(records).items() if len({*texts}) > 1
    }


def _seconds(limit_s: float) -> str:
    return f"{limit_s:g} s" if math.isfinite(limit_s) else MISSING


def _argument(name: str) -> Callable[[RunRecord], str]:
    def text(record: RunRecord) -> str:
        idle = name == "disturb_seed" and record.arguments.disturb is None
        return MISSING if idle else _text(getattr(record.arguments, name))

    return text


def _text(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, (list, tuple)):
        return " ".join(map(str, value)) or MISSING
    if isinstance(value, (float, Mapping)):
        return value_text(value)
    if value == "":  # an option that was given without a value of its own
        return "yes"
    return MISSING if value is None else str(value)
