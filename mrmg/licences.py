"""The packages that mrmg depends on, with their licences as their metadata states."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from importlib.metadata import PackageMetadata, PackageNotFoundError, metadata, requires

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

_PROJECT = "mrmg"
_FOR_DEVELOPERS = "test"
"""The extra whose packages nothing of mrmg imports."""


@dataclass(frozen=True, slots=True)
class Dependency:
    """A package that mrmg, or a package it depends on, requires.

    Attributes:
        package: its name.
        version: that is installed; "" where it is not.
        licence: as its metadata states; "" where it states none, or is not installed.
        extra: of mrmg that brings it; "" if it is always installed.
        required_by: names of the packages that require it.
    """

    package: str
    version: str
    licence: str
    extra: str
    required_by: tuple[str, ...]


def dependencies() -> list[Dependency]:
    """Return all packages, direct and indirect, those of mrmg's extras last."""
    extras = metadata(_PROJECT).get_all("Provides-Extra") or []
    found: dict[str, tuple[str, set[str]]] = {}
    seen: set[tuple[str, str]] = set()
    for extra in ["", *(name for name in sorted(extras) if name != _FOR_DEVELOPERS)]:
        open_ends = {(_PROJECT, extra)}
        while open_ends:
            requiring, its_extra = open_ends.pop()
            seen.add((requiring, its_extra))
            for requirement in _requirements(requiring, its_extra):
                name = canonicalize_name(requirement.name)
                if name != requiring:  # else an extra that names another
                    found.setdefault(name, (extra, set()))[1].add(requiring)
                ends = {(name, own) for own in ("", *requirement.extras)}
                open_ends |= ends - seen
    ordered = sorted(found.items(), key=lambda item: (item[1][0], item[0]))
    return [
        _dependency(name, extra, tuple(sorted(requiring)))
        for name, (extra, requiring) in ordered
    ]


def _requirements(package: str, extra: str) -> Iterator[Requirement]:
    """Yield what a package, or an extra of it, requires on this Python and platform."""
    try:
        lines = requires(package) or []
    except PackageNotFoundError:
        return
    for requirement in map(Requirement, lines):
        marker = requirement.marker
        if marker is None or marker.evaluate({"extra": extra}):
            yield requirement


def _dependency(name: str, extra: str, required_by: tuple[str, ...]) -> Dependency:
    try:
        about = metadata(name)
    except PackageNotFoundError:
        return Dependency(name, "", "", extra, required_by)
    return Dependency(name, about["Version"], _licence(about), extra, required_by)


def _licence(about: PackageMetadata) -> str:
    """Return the licence by the newest of the ways in which metadata may state it."""
    if "License-Expression" in about:
        return about["License-Expression"]
    classifiers = [
        line.rpartition(" :: ")[2]
        for line in about.get_all("Classifier") or []
        if line.startswith("License :: ") and not line.endswith(":: OSI Approved")
    ]
    text = about["License"].strip() if "License" in about else ""
    stated = "see its licence file" if "\n" in text else text
    return ", ".join(classifiers) or stated
