"""Maps of others as documents, and places on the grid over a map."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from mrmg.scene.importing.importing import import_files
from mrmg.scene.importing.layers import ImportOptions
from mrmg.scene.populating.ground import Ground


def import_map(path: str | Path, longest_side_m: float = 100.0) -> dict[str, Any]:
    """Read one map as a scene document without robots or goals."""
    options = ImportOptions(longest_side_m=longest_side_m)
    return import_files([Path(path)], options).document


def nearest(ground: Ground, point: Sequence[float]) -> int:
    """Return the index of the free grid point that is nearest to a point."""
    offset = ground.points_m - np.asarray(point)
    distance = np.where(ground.free, np.hypot(offset[:, 0], offset[:, 1]), np.inf)
    return int(distance.argmin())
