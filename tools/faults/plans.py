"""Damaged plans: the verifier catches all, each by the rule that should."""

from __future__ import annotations

from collections.abc import Iterator
from random import Random

from protocol import Row

import mrmg
from faults.changes import InapplicableError
from faults.damage import DAMAGES, Damage
from faults.rows import Options, row_of
from mrmg.plans import Plan
from mrmg.scene.types import Scene
from mrmg.verification.verify import verify

CHUNK = 20
TRIES = 60
"""Draws of a plan and a place until a damage can be done."""

SCENES = ("quickstart", "scene1", "scene4", "diffdrive", "mixed")

REQUIRED = "every damaged plan is caught, by the rule that should"


def rows(options: Options) -> Iterator[Row]:
    """Yield one row for each part of a plan, as `DAMAGES` name it first."""
    bases: list[tuple[Scene, Plan]] = []
    parts: dict[str, list[Row]] = {}
    counts: dict[str, int] = {}
    rules: dict[str, set[str]] = {}
    for first in range(0, options.plans, CHUNK):
        numbers = range(first, min(options.plans, first + CHUNK))
        known = {"part": "plans", "numbers": [numbers.start, numbers.stop]}
        found = options.trials.get(**known)
        if found is None:
            bases = bases or _bases()
            found = options.trials.add(_chunk(options.seed, bases, numbers), **known)
        for number in numbers:
            damage = DAMAGES[number % len(DAMAGES)]
            part = damage.what.partition(":")[0]
            counts[part] = counts.get(part, 0) + 1
            rules.setdefault(part, set()).add(damage.rule.value)
            parts.setdefault(part, [])
        for failure in found["failures"]:
            parts[failure["case"].partition(":")[0]].append(failure)
    for part, failures in parts.items():
        caught_by = sorted(rules[part])
        yield row_of(
            f"plans: {part}", REQUIRED, counts[part], failures, rules=caught_by
        )


def _bases() -> list[tuple[Scene, Plan]]:
    """Return scenes with valid plans."""
    bases = []
    for name in SCENES:
        scene = mrmg.load_scene(name)
        for seed in (0, 1):
            plan = mrmg.plan(scene, seed=seed).plan
            if plan is None or not verify(scene, plan).ok:
                raise RuntimeError(f"{name} has no valid plan to be damaged")
            bases.append((scene, plan))
    return bases


def _chunk(seed: int, bases: list[tuple[Scene, Plan]], numbers: range) -> Row:
    failures = []
    for number in numbers:
        damage = DAMAGES[number % len(DAMAGES)]
        fault = _fault(damage, bases, Random(f"{seed} plans {number}"))
        if fault:
            failures.append({"case": f"{damage.what} ({number})", "fault": fault})
    return {"failures": failures}


def _fault(damage: Damage, bases: list[tuple[Scene, Plan]], random: Random) -> str:
    """Damage a plan; return how the verifier failed, or ""."""
    for _ in range(TRIES):
        scene, plan = random.choice(bases)
        try:
            changed, damaged = damage.make(scene, plan, random)
        except InapplicableError:
            continue
        try:
            verdict = verify(changed, damaged)
        except Exception as error:  # a verifier that breaks down catches nothing
            return f"{scene.name}: {type(error).__name__}: {error}"
        found = sorted({violation.kind.value for violation in verdict.violations})
        if not found or verdict.ok:
            return f"{scene.name}: not caught"
        if damage.rule.value not in found:
            return (
                f"{scene.name}: caught by {', '.join(found)}, not {damage.rule.value}"
            )
        return ""
    return "no plan could be damaged so"
