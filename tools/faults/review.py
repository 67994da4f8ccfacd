"""Bad input that a review of the code found, or suspected, to end in a traceback."""

from __future__ import annotations

import zipfile
from pathlib import Path

from faults.inputs import ALIASES, Write, capsule, claimed, model, scene
from faults.mutations import LONG_INTEGER
from faults.named import Case


def bomb(name: str) -> Write:
    """Return what writes a capsule one member of which unpacks to a gigabyte."""

    def write(place: Path) -> tuple[str, ...]:
        words = capsule({})(place)
        with zipfile.ZipFile(place / "c.zip") as archive:
            members = {each: archive.read(each) for each in archive.namelist()}
        kind = zipfile.ZIP_DEFLATED
        with zipfile.ZipFile(place / "c.zip", "w", kind, compresslevel=1) as archive:
            for each in {*members} - {name}:
                archive.writestr(each, members[each])
            with archive.open(name, "w", force_zip64=True) as member:
                for _ in range(1000):
                    member.write(b"\0" * 10**6)
        return words

    return write


REVIEW: dict[str, Case] = {
    "a tag without its value: !!int foo": Case(write=scene("20, 10", "!!int foo, 10")),
    "a tag without its value: !!float x": Case(write=scene("20, 10", "!!float x, 10")),
    "an integer of 5000 digits": Case(write=scene("20, 10", f"{LONG_INTEGER}, 10")),
    "an integer of 5000 hexadecimal digits": Case(
        write=scene("20, 10", f"0x{'f' * 5000}, 10")
    ),
    "a key of superscript digits": Case(
        write=scene("goals:", "goals: {\u00b2: 1}\nx:")
    ),
    "aliases in an unknown key": Case(write=scene("bounds:", f"{ALIASES}\nbounds:")),
    "aliases in place of goals": Case(
        write=scene("goals:", f"{ALIASES}\ngoals: *a11\nx:")
    ),
    "a list that contains itself": Case(write=scene("goals:", "goals: &g [*g]\nx:")),
    "motion_model climbs out": Case(write=model(motion_model="../evil.py")),
    "motion_model is absolute": Case(write=model(motion_model="/tmp/evil.py")),
    "mjcf climbs out": Case(write=model(mjcf="../evil.py")),
    "bounds of a million kilometres with elevation": Case(
        write=scene(
            "bounds: [0, 0, 20, 10]",
            "bounds: [0, 0, 1.0e9, 1.0e9]\n"
            "elevation: {origin: [0, 0], cell: 5, heights: [[0, 1], [1, 0]]}",
        )
    ),
    "elevation of cells of a micrometre": Case(
        write=scene(
            "robots:",
            "elevation: {origin: [0, 0], cell: 1.0e-6, heights: [[0, 1], [1, 0]]}"
            "\nrobots:",
        )
    ),
    "a capsule whose plan unpacks to a gigabyte": Case(write=bomb("plan.npz")),
    "a capsule whose model unpacks to a gigabyte": Case(write=bomb("models/a/a.xml")),
    "a capsule's array of 10^12 numbers": Case(
        write=capsule({"last.npz": claimed("(1000000000000,)")})
    ),
    "a capsule's array of long texts": Case(
        write=capsule({"last.npz": claimed("(1000,)", "<U99999999")})
    ),
}
