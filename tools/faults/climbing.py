"""Paths that climb out of a folder, or are links or devices."""

from __future__ import annotations

import zipfile
from collections.abc import Mapping
from functools import partial
from pathlib import Path

from faults.commands import Outcome
from faults.inputs import capsule, model
from faults.named import Case

SECRET = "the content of a file that is nobody's business"


def climbing() -> Mapping[str, Case]:
    """Return cases by name."""
    cases = {}
    for name in (
        "../climbed",
        "models/../../climbed",
        "/tmp/climbed",
        "models/a/../../../climbed",
        "models\\..\\climbed",
        "C:/climbed",
        "models/",
        "models/./climbed",
        "models//climbed",
        "run.json",
    ):
        cases[f"a capsule's member {name}"] = Case(
            write=capsule({name: SECRET.encode()}), check=_nothing_outside
        )
    cases["a capsule's member of a link"] = Case(write=_capsule_with_link)
    for key in ("mjcf", "motion_model"):
        for name in (
            "../../../etc/passwd",
            "/etc/passwd",
            "a/../../evil.py",
            "/dev/zero",
        ):
            cases[f"{key} of {name}"] = Case(write=model(**{key: name}))
    for name in ("/dev/zero", "/etc/passwd", "../../../../../../etc/passwd"):
        cases[f"a mesh of {name}"] = Case(write=partial(_mesh, name))
    return cases


def _nothing_outside(place: Path, outcome: Outcome) -> str:
    for path in place.parent.rglob("climbed"):
        if path.is_file():
            return f"wrote {path}"
    return ""


def _capsule_with_link(place: Path) -> tuple[str, ...]:
    words = capsule({})(place)
    info = zipfile.ZipInfo("models/a/link")
    info.external_attr = 0o120777 << 16
    with zipfile.ZipFile(place / "c.zip", "a") as archive:
        archive.writestr(info, "/etc/passwd")
    return words


def _mesh(name: str, place: Path) -> tuple[str, ...]:
    words = model()(place)
    file = place / "mine" / "car.xml"
    mesh = f'<asset><mesh name="m" file="{name}"/></asset><asset>'
    file.write_text(file.read_text().replace("<asset>", mesh, 1))
    return words
