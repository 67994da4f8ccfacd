"""What users give in place of a run folder, and what they may mean."""

from __future__ import annotations

from pathlib import Path

from mrmg import shipped
from mrmg.errors import nearest

SHOWN_RUNS = 5
"""How many runs of a folder a message names."""


def why_no_run(path: Path) -> str:
    """Return why a path is no run folder, and what to give instead."""
    if (path.parent / "run.json").exists() and path.is_file():
        return f"not a run folder, but a file in one; give {path.parent}"
    if path.is_file() or str(path) in shipped.scene_names():
        return f"not a run folder; if it is a scene, 'mrmg run {path}' makes one"
    runs = sorted(item.parent.name for item in path.glob("*/run.json"))
    if runs:
        names = [*runs[:SHOWN_RUNS], *(["..."] if len(runs) > SHOWN_RUNS else [])]
        return f"not a run folder, but it holds some; give one: {', '.join(names)}"
    if path.is_dir():
        return "not a run folder: it has no run.json; make one with 'mrmg run'"
    others = [str(item.parent) for item in path.parent.glob("*/run.json")]
    near = nearest(str(path), others)
    text = f"not a run folder: there is no such folder{near}"
    return f"{text}; 'mrmg run SCENE --out {path}' makes one"
