"""Which code of a model's folder may run, and which files a model may name.

A model that was downloaded may bring a Python file (`motion_model: FILE.py`). It is
imported only when the user asks for it, with `--trust-code` or `trust_code=True`, or
has listed the folder it lies in, or one above that, in `$MRMG_TRUSTED_MODELS`.
"""

from __future__ import annotations

import os
from pathlib import Path

TRUSTED_MODELS = "MRMG_TRUSTED_MODELS"
"""Environment variable: folders, as in PATH, whose models may bring code."""


def refusal_of_code(file: Path) -> str | None:
    """Return why the code of `file` does not run unasked; None if the user trusts it.

    Args:
        file: Python file of a model's folder.
    """
    folder = file.resolve().parent
    listed = os.environ.get(TRUSTED_MODELS, "").split(os.pathsep)
    # An empty entry would stand for the working directory.
    trusted = [Path(entry).expanduser().resolve() for entry in listed if entry.strip()]
    if any(folder.is_relative_to(place) for place in trusted):
        return None
    return (
        f"{file.resolve()} is Python code, which runs only when asked: read it, then "
        "give --trust-code (in Python trust_code=True), or list its folder in "
        f"${TRUSTED_MODELS}"
    )


def file_within(folder: Path, name: str) -> Path | str:
    """Return the file that a model names, or why it cannot be used.

    Args:
        folder: of the model.
        name: as `robot.yaml` has it, relative to the folder; the file must lie in the
            folder when all symbolic links are followed, too.
    """
    relative = Path(name)
    try:
        file = (folder / relative).resolve()
        outside = relative.is_absolute() or ".." in relative.parts
        if outside or not file.is_relative_to(folder.resolve()):
            return f"got '{name}'; must be a file inside the model's folder"
        if file.is_file():
            return folder / relative
    except (OSError, ValueError, RuntimeError):  # no name of a file, or a loop of links
        pass
    return f"got '{name}'; no such file in the folder"
