"""Valid maps of all formats that `scene import` reads, and layouts of lanes."""

from __future__ import annotations

import json
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import numpy as np
from PIL import Image

from faults.sources import Source, sources_of
from mrmg.scene.loading.yaml_text import dump_yaml


def map_sources(folder: Path) -> Iterator[Source]:
    """Write maps into a folder; yield them with the commands that import them."""
    folder.mkdir()
    _write_occupancy(folder)
    square = "[SCALE]\n1\n[BORDER]\n0 0\n200 0\n200 150\n0 150\n"
    (folder / "a.txt").write_text(f"{square}[OBSTACLE]\n20 20\n40 20\n40 45\n")
    (folder / "b.txt").write_text(
        "[SCALE]\n0.5\n[MAP_POINTS]\n1 0 0\n2 900 0\n3 900 500\n4 0 500\n5 100 100\n"
        "6 200 100\n7 200 200\n[MAP_BORDER]\n1 2 3 4\n[MAP_OBSTACLE]\n5 6 7\n"
    )
    (folder / "a.tri").write_text(
        "0 0 9 0 9 1\n0 0 0 9 1 9\n3 3 5 3 4 6\n2 2 3 3\n7 7\n"
    )
    (folder / "a.geojson").write_text(json.dumps(_features()))
    (folder / "lif.json").write_text(json.dumps(_LIF))
    (folder / "classes.yaml").write_text("10: {multiplier: 1.5}\n20: obstacle\n")
    _write_tiffs(folder)
    sources, into = partial(sources_of, "maps", folder), "-o new.yaml"
    vector = ["a.txt", "b.txt", "a.tri", "a.geojson", "lif.json", "a.yaml"]
    yield from sources(vector, f"scene import FILE {into}")
    yield from sources(["lif.json", "a.geojson"], f"scene import FILE --lanes 2 {into}")
    yield from sources(["a.pgm"], f"scene import a.yaml --keepout k.yaml {into}")
    yield from sources(["a.png"], f"scene import k.yaml {into}")
    yield from sources(["k.yaml"], f"scene import a.yaml --terrain-mask FILE {into}")
    land = f"scene import e.tif --land-cover c.tif --classes classes.yaml {into}"
    yield from sources(["e.tif", "c.tif", "classes.yaml"], land)


def _write_occupancy(folder: Path) -> None:
    grey = np.full((20, 30), 254, dtype=np.uint8)
    grey[:, 12:14], grey[:4] = 0, 205
    stated = {
        "resolution": 0.5,
        "origin": [0.0, 0.0, 0.0],
        "negate": 0,
        "occupied_thresh": 0.65,
        "free_thresh": 0.196,
    }
    for name, picture in (("a", "a.pgm"), ("k", "a.png")):
        Image.fromarray(grey).save(folder / picture)
        (folder / f"{name}.yaml").write_text(dump_yaml({"image": picture, **stated}))


def _write_tiffs(folder: Path) -> None:
    import rasterio
    from rasterio.transform import from_origin

    heights = np.add.outer(np.arange(12.0), np.zeros(16)).astype("float32")
    classes = np.full((12, 16), 10, dtype="uint8")
    classes[3:6, 4:8] = 20
    for name, values in (("e.tif", heights), ("c.tif", classes)):
        rows, columns = values.shape
        shape = {"height": rows, "width": columns, "count": 1, "dtype": values.dtype}
        place = from_origin(0.0, float(rows), 1.0, 1.0)
        path = folder / name
        with rasterio.open(path, "w", driver="GTiff", transform=place, **shape) as file:
            file.write(values, 1)


def _features() -> dict[str, object]:
    shapes = {
        "goal": ("Point", [5.0, 5.0]),
        "obstacle": ("Polygon", [[[10, 10], [14, 10], [14, 14], [10, 10]]]),
        "terrain": ("Polygon", [[[0, 0], [5, 0], [5, 5], [0, 0]]]),
        "station": ("Point", [18.0, 3.0]),
        "lane": ("LineString", [[0, 0], [5, 5], [18, 3]]),
    }
    features = [
        {
            "type": "Feature",
            "properties": {"kind": kind, "id": kind},
            "geometry": {"type": shape, "coordinates": coordinates},
        }
        for kind, (shape, coordinates) in shapes.items()
    ]
    crs = {"type": "name", "properties": {"name": "EPSG:32632"}}
    return {"type": "FeatureCollection", "crs": crs, "features": features}


_LIF = {
    "layouts": [
        {
            "layoutId": "hall",
            "nodes": [
                {"nodeId": "a", "nodePosition": {"x": 1, "y": 2}},
                {"nodeId": "b", "nodePosition": {"x": 11, "y": 2}},
            ],
            "edges": [{"edgeId": "e1", "startNodeId": "a", "endNodeId": "b"}],
            "stations": [{"stationId": "s", "interactionNodeIds": ["b"]}],
        }
    ]
}
