"""How a scene was written down, kept so that it can be written down so again."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mrmg.scene.types import Scene


@dataclass(frozen=True, kw_only=True)
class WrittenScene:
    """How a scene was written down, for as much of it as is not changed since.

    Attributes:
        document: the scene file's content with defaults filled in, as plain data.
        loaded: the scene as it was loaded, without this.
        legacy_digest: what versions up to 0.1.0 made of the document and the values in
            the models' `robot.yaml`; plans and logs of theirs have it.
        base: folder that relative paths start from; None for the working directory.
    """

    document: Mapping[str, Any]
    loaded: Scene
    legacy_digest: str
    base: Path | None
