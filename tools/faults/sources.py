"""Files to damage, each with the commands that read it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

Command = tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class Source:
    """A file to damage.

    Attributes:
        format: what is read.
        folder: holds the file and what belongs to it.
        name: of the file in the folder.
        commands: that read it, run in a copy of the folder.
    """

    format: str
    folder: Path
    name: str
    commands: tuple[Command, ...]


def sources_of(
    format: str, folder: Path, names: Sequence[str], *commands: str
) -> Iterator[Source]:
    """Yield a source for each name, which stands for FILE in the commands."""
    for name in names:
        yield Source(
            format=format,
            folder=folder,
            name=name,
            commands=tuple(
                tuple(name if word == "FILE" else word for word in command.split())
                for command in commands
            ),
        )
