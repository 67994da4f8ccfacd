"""What writes bad or hostile input into a folder, and gives the command to read it."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Mapping
from pathlib import Path

import yaml

from faults.mutations import claimed_array, zipped
from mrmg import shipped

Write = Callable[[Path], tuple[str, ...]]

SCENE = """format: 1
bounds: [0, 0, 20, 10]
robots: [{id: r1, model: car, pose: [3, 5, 0]}]
goals: [{id: g1, circle: {center: [16, 5], radius: 1}}]
"""

ALIASES = "\n".join(
    ["a0: &a0 [x, x, x, x, x, x, x, x, x]"]
    + [f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 9)}]" for n in range(1, 12)]
)
"""A few lines that stand for 9^12 values."""

EVIL = "open('ran', 'w').write('yes')\ndef plan(*a, **k): ...\n"
"""Code that leaves a file `ran` where it runs."""


def files(
    contents: Mapping[str, str | bytes], command: str, runs: Path | None = None
) -> Write:
    """Return what writes files and gives a command.

    Args:
        contents: of the files by their names.
        command: reads them.
        runs: folder that is copied before, or None.
    """

    def write(place: Path) -> tuple[str, ...]:
        if runs:
            shutil.copytree(runs, place, dirs_exist_ok=True)
        for name, content in contents.items():
            data = content.encode() if isinstance(content, str) else content
            (place / name).write_bytes(data)
        return tuple(command.split())

    return write


def scene(old: str, new: str) -> Write:
    """Return what writes the scene with a piece of it replaced, and checks it."""
    assert old in SCENE
    return files({"s.yaml": SCENE.replace(old, new)}, "scene check s.yaml")


def model(**changes: object) -> Write:
    """Return what writes a scene with a model of its own, some keys of it changed."""

    def write(place: Path) -> tuple[str, ...]:
        shutil.copytree(shipped.models_folder() / "car", place / "mine")
        file = place / "mine" / "robot.yaml"
        file.write_text(yaml.safe_dump(yaml.safe_load(file.read_text()) | changes))
        own = SCENE.replace("model: car", "model: ./mine")
        return files({"s.yaml": own, "evil.py": EVIL}, "scene check s.yaml")(place)

    return write


def capsule(members: Mapping[str, bytes]) -> Write:
    """Return what writes a capsule of small members and given ones, and replays it."""
    names = ("capsule.json", "scene.yaml", "planning.json", "plan.json", "plan.npz")
    content = dict.fromkeys((*names, "last.npz"), b"{}")
    return files({"c.zip": zipped({**content, **members})}, "replay c.zip")


def claimed(shape: str, kind: str = "<f8") -> bytes:
    """Return an .npz whose only array claims a shape."""
    return zipped({"time_s.npy": claimed_array(shape, kind)})
