"""Writing a run folder's mission in a format of other tools."""

from __future__ import annotations

import contextlib
from pathlib import Path

from mrmg import storage
from mrmg.errors import UsageError
from mrmg.export.mission import read_mission
from mrmg.export.table import Format, load_format
from mrmg.runs.folder import EXPORT_FOLDER
from mrmg.runs.replacing import require_absent


def export_run(
    run_folder: str | Path,
    format_name: str,
    *,
    out: str | Path | None = None,
    version: str | None = None,
    overwrite: bool = False,
    trust_code: bool = False,
) -> list[Path]:
    """Write the drive of a run, or its plan where nothing was driven, in a format.

    Args:
        run_folder: the run; at least planned.
        format_name: one of `format_names()`.
        out: folder to write to, or the file where it has the format's suffix; None for
            the folder `export` of the run.
        version: of the format's standard; None for all that can be written.
        overwrite: whether to replace files that are there, and to remove those that
            an export of another mission has left beside them.
        trust_code: whether robot models may bring Python code (`loading.trust`).

    Returns:
        The files that were written.

    Raises:
        UsageError: if format or version is unknown, or a file exists.
        RunFolderError: if the run has no plan, or cannot be read.
        MachineError: if a package that the format needs is not installed.
    """
    chosen = load_format(format_name)
    versions = _versions(chosen, format_name, version)
    folder = Path(run_folder)
    place = folder / EXPORT_FOLDER if out is None else Path(out)
    mission = read_mission(folder, trust_code=trust_code)
    files = {
        _path(place, name, chosen.suffix): content
        for name, content in chosen.files(mission, versions).items()
    }
    # Robots of another mission would seem to be of this one.
    left = set(chosen.written_before(place, versions)) - set(files)
    for path in [*files, *sorted(left)]:
        require_absent(path, overwrite=overwrite)
    for path in left:
        path.unlink()
        with contextlib.suppress(OSError):  # holds files of others
            path.parent.rmdir()
    for path, content in files.items():
        storage.write_bytes(path, content)
    return list(files)


def _versions(chosen: Format, name: str, version: str | None) -> tuple[str, ...]:
    if version is None:
        return chosen.versions
    if version not in chosen.versions:
        allowed = ", ".join(chosen.versions) or "none, leave --version out"
        raise UsageError(
            f"version {version!r} of {name} is unknown; allowed: {allowed}"
        )
    return (version,)


def _path(place: Path, name: str, suffix: str) -> Path:
    """Return where a file of an export goes: a place may be the file itself."""
    return place if suffix and place.suffix == suffix else place / name
