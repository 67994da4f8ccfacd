"""The run folder: names of its files, and which steps of a run are done.

`run.json` keeps a fingerprint for every finished step: a digest of all that decides
the step's outcome, the fingerprints of the steps it needs included. A step whose
outputs exist under the present fingerprint need not be done again; any difference makes
it, and all steps that need it, stale. The mark is written after the outputs, and every
file is put in place by renaming, so a killed run can be taken up at any moment.
"""

from __future__ import annotations

import shutil
from collections.abc import Collection, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field, replace
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import Any

from mrmg import storage
from mrmg.errors import Fault, RunFolderError, UsageError
from mrmg.interruption import cleaned_up_by
from mrmg.locking import locked
from mrmg.runs.paths import why_no_run
from mrmg.scene.model_files import MODELS_FOLDER

RUN_FORMAT = 1

TRIALS_FOLDER = "trials"
"""Where trials under disturbances lie, by plan and by what decides the drive."""

EXPORT_FOLDER = "export"
"""Where exports of the mission lie; they go with the drive that they show."""


class Step(StrEnum):
    """The steps of a run, in their order."""

    PLAN = "plan"
    VERIFY = "verify"
    EXECUTE = "execute"
    AUDIT = "audit"
    DRAW = "draw"
    RENDER = "render"
    REPORT = "report"


OUTPUTS: dict[Step, tuple[str, ...]] = {
    Step.PLAN: ("scene.yaml", "plan.npz", "plan.json", "planning.json"),
    Step.VERIFY: ("verdict.json",),
    Step.EXECUTE: ("log.npz", "timing.json", "log.json"),
    Step.AUDIT: ("audit.json",),
    Step.DRAW: ("overview.png", "energy.png"),
    Step.RENDER: ("mission.mp4",),
    Step.REPORT: ("summary.json", "report.html"),
}
"""Files each step leaves; the last one is written last."""

ON_REQUEST: dict[Step, tuple[str, ...]] = {
    Step.EXECUTE: (
        "driven_plan.npz",
        "driven_plan.json",
        "replans.json",
        "capsule.zip",
    ),
    Step.RENDER: ("mission.gif",),
}
"""Files a step leaves besides, when asked to or when there is reason to."""

NEEDS: dict[Step, tuple[Step, ...]] = {
    Step.PLAN: (),
    Step.VERIFY: (Step.PLAN,),
    Step.EXECUTE: (Step.PLAN,),
    Step.AUDIT: (Step.EXECUTE,),
    Step.DRAW: (Step.AUDIT,),
    Step.RENDER: (Step.EXECUTE,),
    Step.REPORT: (Step.VERIFY, Step.DRAW),
}
"""Steps whose outcome a step is made from."""


_READ_AGAIN = (".json", ".npz", ".yaml")
"""Endings of the outputs that other steps and commands read."""

CLOCK_FILES = ("timing.json",)
"""Outputs that differ between equal executions: they hold readings of the clock."""


def _files(step: Step) -> tuple[str, ...]:
    """Return the names of all files that a step may leave, in their order."""
    return (*ON_REQUEST.get(step, ()), *OUTPUTS[step])


def stale_after(step: Step) -> list[Step]:
    """Return `step` and every step that is made from it, in order."""
    stale = [step]
    for later in Step:
        if any(need in stale for need in NEEDS[later]):
            stale.append(later)
    return stale


@dataclass(frozen=True, kw_only=True)
class _Record:
    """Content of `run.json`.

    Attributes:
        arguments: that the files were last made with.
        finished: fingerprint of each step that is.
        files: digests of what each finished step left and is read again; versions
            before 0.2 kept none.
        format: of this record.
    """

    arguments: dict[str, Any] = field(default_factory=dict)
    finished: dict[str, str] = field(default_factory=dict)
    files: dict[str, dict[str, str]] = field(default_factory=dict)
    format: int = RUN_FORMAT


@dataclass(frozen=True)
class RunFolder:
    """One folder on disk that holds one run."""

    path: Path

    def file(self, name: str) -> Path:
        """Return the path of one of the folder's files."""
        return self.path / name

    def unfinished(self, name: str) -> Path:
        """Return where a large file may grow before it is put in its place."""
        return self.path / f"{storage.UNFINISHED}{name}"

    @contextmanager
    def opened_for_writing(self) -> Iterator[RunFolder]:
        """Open the folder as `opened_folder` does."""
        places = (f"{TRIALS_FOLDER}/*/*",)
        with opened_folder(self.path, "run.json", kind="run", places=places):
            yield self

    def arguments(self) -> dict[str, Any]:
        """Return the arguments its files were last made with; empty if none."""
        return self._record().arguments

    def marks(self) -> dict[str, str]:
        """Return the fingerprints of the finished steps."""
        return self._record().finished

    def is_done(self, step: Step, fingerprint: str) -> bool:
        """Return whether the outcome of `step` under `fingerprint` is there."""
        done = self.marks().get(step) == fingerprint
        return done and self.file(OUTPUTS[step][-1]).exists()

    def holds(self, step: Step) -> bool:
        """Return whether an outcome of `step` is there, whatever it was made with."""
        return step in self.marks() and self.file(OUTPUTS[step][-1]).exists()

    def content(self, step: Step) -> dict[str, str]:
        """Return a digest of each file that `step` left, those of the clock apart."""
        return self._digests(name for name in _files(step) if name not in CLOCK_FILES)

    def _digests(self, names: Iterable[str]) -> dict[str, str]:
        """Return a digest of each of the named files that is there."""
        return {
            name: storage.bytes_digest(self.file(name).read_bytes())
            for name in names
            if self.file(name).exists()
        }

    def begin(
        self, step: Step, arguments: dict[str, Any], *, keep: Collection[Step] = ()
    ) -> None:
        """Make room for a new outcome of `step`, made with `arguments`.

        Removes the marks and files of `step` and of all steps made from it, except
        those in `keep`.
        """
        stale = [each for each in stale_after(step) if each not in keep]
        self._remove(stale, arguments)

    def drop(self, steps: Collection[Step]) -> None:
        """Remove the marks and files of `steps`."""
        self._remove([step for step in Step if step in steps], self.arguments())

    def _remove(self, steps: list[Step], arguments: dict[str, Any]) -> None:
        record = self._record()
        for step in steps:
            record.finished.pop(step, None)
            record.files.pop(step, None)
        self._write(replace(record, arguments=arguments))
        for step in reversed(steps):
            for name in reversed(_files(step)):
                self.file(name).unlink(missing_ok=True)
        if Step.PLAN in steps:
            shutil.rmtree(self.file(MODELS_FOLDER), ignore_errors=True)
        if Step.EXECUTE in steps:
            shutil.rmtree(self.file(EXPORT_FOLDER), ignore_errors=True)

    def finish(self, step: Step, fingerprint: str) -> None:
        """Mark `step` as finished under `fingerprint`."""
        made = self._digests(
            name for name in _files(step) if name.endswith(_READ_AGAIN)
        )
        record = self._record()
        finished = {**record.finished, str(step): fingerprint}
        files = {**record.files, str(step): made}
        self._write(replace(record, finished=finished, files=files))

    def altered(self) -> list[str]:
        """Return the files that are not as the steps left them.

        Of a run of an older version, which kept no digests, that is `run.json`.
        """
        left = self._record().files
        if not left:
            return ["run.json"]
        return [
            name
            for files in left.values()
            for name, digest in files.items()
            if self._digests([name]) != {name: digest}
        ]

    def read_json(self, name: str, *, remedy: str) -> dict[str, Any]:
        """Read one of the folder's JSON files.

        Raises:
            RunFolderError: if it is missing or unreadable; names `remedy`.
        """
        path = self.file(name)
        with storage.damage_reported(path, "not readable", f"run '{remedy}'"):
            return dict(storage.read_json(path))

    def _record(self) -> _Record:
        if not self.file("run.json").exists():
            return _Record()
        path, remedy = self.file("run.json"), "'mrmg run' makes it in a new folder"
        with storage.damage_reported(path, "not readable", remedy):
            content = storage.of_format(path.read_bytes(), RUN_FORMAT)
            return storage.typed(_Record, content)

    def _write(self, record: _Record) -> None:
        storage.write_json(self.file("run.json"), asdict(record))


def existing(path: Path) -> RunFolder:
    """Return the run folder at `path`.

    Raises:
        RunFolderError: if there is none.
    """
    folder = RunFolder(path)
    if not folder.file("run.json").exists():
        raise RunFolderError(str(path), [Fault("", why_no_run(path))])
    return folder


@contextmanager
def opened_folder(
    path: Path, marker: str, *, kind: str, places: Collection[str] = ()
) -> Iterator[None]:
    """Create a folder, keep other commands out of it, and clear what a kill left.

    A folder that was created for nothing is removed.

    Args:
        path: of the folder.
        marker: file that a folder of this kind has.
        kind: what errors call it: "run" for a run folder.
        places: patterns of folders in it where unfinished files may lie, too.

    Raises:
        UsageError: if the folder holds something else.
        RunFolderError: if another process is working in it.
    """
    created = not path.exists()
    try:
        path.mkdir(parents=True, exist_ok=True)
    except (FileExistsError, NotADirectoryError) as error:
        raise UsageError(f"{error.filename} is a file; choose a folder") from error
    remove = partial(_remove_unfinished, path, places)
    try:
        with exclusive(path):
            _refuse_foreign_files(path, marker, kind)
            remove()
            try:
                with cleaned_up_by(remove):
                    yield
            finally:
                remove()
    finally:
        if created and not any(path.iterdir()):
            path.rmdir()


def _remove_unfinished(path: Path, places: Collection[str]) -> None:
    storage.remove_unfinished(path)
    for place in places:
        for folder in path.glob(place):
            storage.remove_unfinished(folder)


def _refuse_foreign_files(path: Path, marker: str, kind: str) -> None:
    names = sorted(item.name for item in path.iterdir())
    foreign = [name for name in names if not name.startswith(storage.UNFINISHED)]
    if foreign and marker not in names:
        raise UsageError(
            f"{path} is not a {kind} folder (it holds {foreign[0]!r} and no {marker}); "
            "choose an empty or a new folder with --out"
        )


@contextmanager
def exclusive(path: Path) -> Iterator[None]:
    """Keep other commands out of a folder that is there.

    Raises:
        RunFolderError: if another process is working in it.
    """
    with locked(path) as is_free:
        if not is_free:
            fault = Fault("", "another mrmg process is working in this folder")
            raise RunFolderError(str(path), [fault])
        yield
