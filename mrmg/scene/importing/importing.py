"""Files of other tools as one scene document, and what was changed on the way."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from mrmg.errors import Fault, SceneError, UsageError
from mrmg.scene.importing.formats import nav2_map
from mrmg.scene.importing.layers import ImportOptions, Layer, scene_of_layers
from mrmg.scene.importing.registry import Reader, format_of


@dataclass(frozen=True)
class Imported:
    """A scene document, and notes on what was dropped, changed or assumed."""

    document: dict[str, Any]
    notes: tuple[str, ...]


def import_files(
    files: Sequence[Path],
    options: ImportOptions | None = None,
    *,
    kind: str | None = None,
    keepout: Path | None = None,
    terrain_mask: Path | None = None,
    land_cover: Path | None = None,
) -> Imported:
    """Read files as one scene; the first one decides its name and coordinates.

    Args:
        files: maps, layouts and features, of any kinds.
        options: how to read them.
        kind: what the files are; None to find it by their content.
        keepout: mask of a Nav2 map, or another file, whose obstacles close ground.
        terrain_mask: speed or cost mask of a Nav2 map.
        land_cover: raster or GeoJSON of classes that the table in `options` explains.

    Raises:
        SceneError: naming every fault of a file.
        UsageError: if there is no file, or no format is called `kind`.
    """
    if not files:
        raise UsageError("nothing to import; name a file at least")
    asked = options or ImportOptions()
    plain = replace(asked, classes=None) if land_cover else asked
    layers: list[Layer] = []
    notes: list[str] = []

    def add(path: Path, read: Reader, options: ImportOptions = plain) -> None:
        layer = read(path, replace(options, before=tuple(layers)))
        _require_fit(layer, layers, str(path))
        layers.append(layer)
        if layer.crs is not None and layers[0].frame.crs is None:
            text = f"coordinates of {layer.crs} taken as metres of the map before it"
            notes.append(f"{path.name}: {text}")
        notes.extend(f"{path.name}: {note}" for note in layer.notes)

    for path in files:
        add(path, format_of(path, kind).read)
    if keepout is not None:
        read = format_of(keepout).read
        add(keepout, nav2_map.read_keepout if read is nav2_map.read_map else read)
    if terrain_mask is not None:
        add(terrain_mask, nav2_map.read_mask)
    if land_cover is not None:
        add(land_cover, format_of(land_cover, "land-cover").read, asked)
    document, left = scene_of_layers(files[0], layers, asked)
    return Imported(document, (layers[0].frame.note(), *notes, *left))


def _require_fit(layer: Layer, before: Sequence[Layer], source: str) -> None:
    """Refuse a layer that cannot be of the scene of those before.

    Raises:
        SceneError: saying why.
    """
    frame = before[0].frame if before else layer.frame
    if layer.crs is None and frame.crs is not None:
        message = (
            "is in metres of its own, and the map it goes with has coordinates of "
            f"{frame.crs}; import it alone, or state --crs local if both are in the "
            "same metres"
        )
        raise SceneError(source, [Fault("", message)])
    if layer.heights is not None and any(one.heights is not None for one in before):
        message = (
            "is a second elevation model, and scenes have one; merge them first "
            "(gdal_merge.py -o ALL.tif FILE FILE), and import that"
        )
        raise SceneError(source, [Fault("", message)])
