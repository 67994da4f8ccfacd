"""Making a failed execution fail again, from its capsule."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from mrmg.errors import Fault, FileError, UsageError
from mrmg.plans import Plan
from mrmg.runs.arguments import RunArguments, recorded
from mrmg.runs.capsule import CAPSULE_FILE, Capsule, Failure
from mrmg.runs.drive import checked_drive
from mrmg.runs.folder import RunFolder, Step
from mrmg.runs.replacing import require_room
from mrmg.runs.steps import StepProgress, taken_up
from mrmg.scene.loading import load_scene
from mrmg.simulation.log import require_same_mission


@dataclass(frozen=True, slots=True, kw_only=True)
class Reproduction:
    """A failure, and what came of the same execution here and now.

    Attributes:
        before: the failure the capsule holds.
        after: that of the repeated execution; None if it did not fail.
    """

    before: Failure
    after: Failure | None

    @property
    def same_causes(self) -> bool:
        """Whether it failed again, by the same kinds of failure."""
        return self.after is not None and self.after.causes == self.before.causes

    @property
    def same_bits(self) -> bool:
        """Whether every state and force was the same to the last bit."""
        digest = self.before.log_digest
        return self.after is not None and bool(digest == self.after.log_digest != "")

    @property
    def drift_m(self) -> float | None:
        """How far the last positions differ at most; None if not comparable."""
        if self.after is None:
            return None
        before, after = self.before.last.get("state"), self.after.last.get("state")
        if before is None or after is None or before.shape != after.shape:
            return None
        return float(np.hypot(*(after - before)[..., :2].T).max())

    @property
    def changed_versions(self) -> dict[str, tuple[str, str]]:
        """Versions (then, now) of packages that differ."""
        if self.after is None:
            return {}
        then, now = self.before.versions, self.after.versions
        return {
            name: (then.get(name, "none"), now.get(name, "none"))
            for name in sorted({*then, *now})
            if then.get(name) != now.get(name)
        }

    def verdict(self) -> str:
        """Return in one sentence how both compare."""
        if self.after is None:
            return "does not fail any more"
        if not self.same_causes:
            return "fails in another way"
        if self.same_bits:
            return "fails in the same way, bit for bit"
        apart = "" if self.drift_m is None else f", ending {self.drift_m:.2g} m apart"
        exactly = "" if self.before.causes == ("crash",) else ", but not bit for bit"
        return f"fails in the same way{exactly}{apart}"

    def to_json(self) -> dict[str, Any]:
        """Return the comparison as JSON data."""
        return {
            "verdict": self.verdict(),
            "same_causes": self.same_causes,
            "same_bits": self.same_bits,
            "drift_m": self.drift_m,
            "before": _causes_and_reasons(self.before),
            "after": self.after and _causes_and_reasons(self.after),
            "changed_versions": {
                name: list(pair) for name, pair in self.changed_versions.items()
            },
        }


def _causes_and_reasons(failure: Failure) -> dict[str, list[str]]:
    return {"causes": list(failure.causes), "reasons": list(failure.reasons)}


def reproduce(
    path: Path,
    out: Path,
    on_progress: StepProgress | None = None,
    *,
    overwrite: bool = False,
    trust_code: bool = False,
) -> Reproduction:
    """Repeat the execution that a capsule holds, in a run folder of its own.

    Args:
        path: of the capsule.
        out: run folder to make, with log and audit.
        on_progress: called with (step, fraction, text).
        overwrite: replace another run, or a drive by another version, in `out`.
        trust_code: whether robot models may bring Python code (`loading.trust`).

    Raises:
        FileError: if the capsule cannot be used.
        UsageError: if `out` holds something else that is not to be replaced.
    """
    capsule = Capsule.load(path)
    arguments = _checked_arguments(capsule, path, trust_code)
    folder = RunFolder(out)
    with folder.opened_for_writing():
        repeated = capsule.lies_in(out) and recorded(folder) == arguments
        if not repeated:
            if folder.holds(Step.PLAN) and not overwrite:
                raise UsageError(
                    f"{out} holds another run; --overwrite replaces it, another --out "
                    "DIR keeps it"
                )
            folder.begin(Step.PLAN, arguments.to_json())
            capsule.unpack(out)
        run = taken_up(folder, on_progress, trust_code=trust_code)
        if repeated and not overwrite:
            require_room(run, Step.EXECUTE)
        folder.finish(Step.PLAN, run.fingerprint(Step.PLAN))
        left = folder.file(CAPSULE_FILE)
        try:
            run.make(Step.EXECUTE)
            run.make(Step.AUDIT)
        except Exception:
            # A crash that left a capsule is what was asked for.
            if not left.exists():
                raise
        after = Capsule.load(left).failure if left.exists() else None
    return Reproduction(before=capsule.failure, after=after)


def _checked_arguments(capsule: Capsule, path: Path, trust_code: bool) -> RunArguments:
    """Return the arguments of a capsule, of which all can be used.

    Raises:
        FileError: if not; there is no run folder yet.
    """
    with tempfile.TemporaryDirectory(prefix="mrmg-") as place:
        capsule.unpack(Path(place))
        try:
            arguments = RunArguments.from_json(capsule.arguments)
            scene = load_scene(Path(place) / "scene.yaml", trust_code=trust_code)
            require_same_mission(scene, Plan.load(Path(place)))
            checked_drive(scene, arguments)
        except FileError as error:
            raise FileError(str(path), error.faults) from error
        except UsageError as error:
            raise FileError(str(path), [Fault("capsule.json", str(error))]) from error
    return arguments
