"""Small rasters that the tests of imports read, written where a test says."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Protocol

import numpy as np
import pytest
from PIL import Image

from mrmg.scene.loading.yaml_text import dump_yaml


def _write_map(folder: Path, grey: np.ndarray, name: str = "map", **keys: Any) -> Path:
    """Write a Nav2 map of grey values; return its YAML file."""
    suffix = keys.pop("suffix", "pgm")
    Image.fromarray(grey.astype(np.uint8)).save(folder / f"{name}.{suffix}")
    stated = {
        "image": f"{name}.{suffix}",
        "resolution": 0.1,
        "origin": [0.0, 0.0, 0.0],
        "negate": 0,
        "occupied_thresh": 0.65,
        "free_thresh": 0.196,
    }
    path = folder / f"{name}.yaml"
    path.write_text(dump_yaml(stated | keys))
    return path


def _write_tiff(path: Path, values: np.ndarray, **keys: Any) -> Path:
    """Write a GeoTIFF: north up, from (0, 0) on, cells of 1 m, unless stated."""
    import rasterio
    from rasterio.transform import from_origin

    rows, columns = values.shape
    corner, cell = keys.pop("corner", (0.0, float(rows))), keys.pop("cell", 1.0)
    stated = {
        "driver": "GTiff",
        "height": rows,
        "width": columns,
        "count": 1,
        "dtype": values.dtype,
        "transform": from_origin(*corner, cell, cell),
    }
    with rasterio.open(path, "w", **(stated | keys)) as file:
        file.write(values, 1)
    return path


class Write(Protocol):
    """Writes a raster; keys replace what its file states by default."""

    def __call__(
        self, place: Path, values: np.ndarray, name: str = ..., **keys: Any
    ) -> Path: ...


@pytest.fixture(scope="session")
def write_map() -> Write:
    return _write_map


@pytest.fixture(scope="session")
def write_tiff() -> Any:
    return _write_tiff
