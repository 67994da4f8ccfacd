"""What an importer reads of one file, and how several become one scene."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np
import shapely
from shapely.geometry import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from mrmg.counted import counted
from mrmg.errors import Fault, SceneError
from mrmg.scene.document import PACKED_M, packed_heights, polygon_entry
from mrmg.scene.importing.frames import Frame

Entry = dict[str, Any]
Box = tuple[float, float, float, float]

PLACE_MARGIN_M = 2.0
"""Ground around goals, stations and robots where no file states bounds."""

_MARGINS_M = PLACE_MARGIN_M * np.array([-1.0, -1.0, 1.0, 1.0])

MAX_SIDE_M = 100_000.0
"""Side of the ground from which on a plane is no picture of the earth."""

_DECIMALS = 6
"""Coordinates are rounded to micrometres: obstacles lose nothing that counts."""

_SLIVER_M2 = 1e-6
_NOT_IN_IDS = re.compile(r"[^A-Za-z0-9_.\-]+")


@dataclass(frozen=True, kw_only=True)
class ImportOptions:
    """What the user requests of an import.

    Attributes:
        before: layers of the files before.
        unknown: what cells that were never seen become.
        tolerance: how far polygons may reach beyond the cells of a raster [cells].
        crs: coordinate reference system that replaces what files state; "local" for
            metres.
        crop: box to keep, in the coordinates of the first file.
        longest_side_m: what a polygon map's longer side is scaled to; positive.
        classes: table of land-cover classes.
        lane_width_m: width of the lanes that robots must keep to; None for none.
    """

    before: Sequence[Layer] = ()
    unknown: Literal["obstacle", "free"] = "obstacle"
    tolerance: float = 0.5
    crs: str | None = None
    crop: Box | None = None
    longest_side_m: float = 100.0
    classes: Path | None = None
    lane_width_m: float | None = None

    @property
    def frame(self) -> Frame | None:
        """Coordinates of the scene so far; None before the first file."""
        return self.before[0].frame if self.before else None


@dataclass(frozen=True)
class Area:
    """An obstacle or terrain area: its shape [m], and the other keys of its entry."""

    shape: BaseGeometry
    entry: Entry = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class Layer:
    """The content of one file in the coordinates of the scene.

    Attributes:
        frame: the coordinates, if this is the first file; others lie in those of it.
        crs: coordinate system of the file itself; None for local metres.
        bounds: extent of the ground that the file describes; None if it states none.
        obstacles: ground that robots must keep off.
        terrain: ground that costs more or less.
        heights: of nodes over `bounds` [m], rows from north to south, shape (ny, nx).
        goals, stations, robots: entries of a scene file.
        lanes: lines that robots may drive along.
        cells: placement and mask of the raster cells that obstacles cover.
        closes_unknown: whether obstacles are ground that was never seen, too.
        notes: what was dropped, changed or assumed.
    """

    frame: Frame = Frame()
    crs: str | None = None
    bounds: Box | None = None
    obstacles: Sequence[Area] = ()
    terrain: Sequence[Area] = ()
    heights: np.ndarray | None = None
    goals: Sequence[Entry] = ()
    stations: Sequence[Entry] = ()
    robots: Sequence[Entry] = ()
    lanes: Sequence[BaseGeometry] = ()
    cells: tuple[Any, np.ndarray] | None = None
    closes_unknown: bool = False
    notes: Sequence[str] = ()


def scene_of_layers(
    first: Path, layers: Sequence[Layer], options: ImportOptions
) -> tuple[Entry, list[str]]:
    """Return the scene document of some layers, and notes on what did not fit in.

    Args:
        first: file that names the scene.
        layers: of all files.
        options: of the import.

    Raises:
        SceneError: if no layer states bounds or holds anything.
    """
    source = str(first)
    bounds = _bounds(source, layers, options)
    if max(bounds[2] - bounds[0], bounds[3] - bounds[1]) > MAX_SIDE_M:
        message = (
            f"the ground spans more than {MAX_SIDE_M / 1000.0:g} km; take a part of it "
            "by --crop, or check that coordinates are longitude, latitude"
        )
        raise SceneError(source, [Fault("bounds", message)])
    notes: list[str]
    box, notes = shapely.box(*bounds), []
    obstacles = _all(layers, "obstacles")
    obstacles += _beside_lanes(_all(layers, "lanes"), box, options.lane_width_m)
    document: Entry = {
        "format": 1,
        "name": _NOT_IN_IDS.sub("_", first.stem),
        "bounds": [round(value, _DECIMALS) + 0.0 for value in bounds],
        "obstacles": list(_entries(obstacles, box)),
        "terrain": list(_entries(_all(layers, "terrain"), box)),
    }
    heights = next((one.heights for one in layers if one.heights is not None), None)
    if heights is not None:
        steps = np.round(heights / PACKED_M).astype("<i4")
        document["elevation"] = {**packed_heights(steps), "slope": "avoid"}
    areas = (*document["obstacles"], *document["terrain"])
    used = {str(entry["id"]): 1 for entry in areas if "id" in entry}
    solid = shapely.disjoint_subset_union_all(
        [area.shape for area in obstacles if "blocks" not in area.entry]
    )
    if box.difference(solid).area <= _SLIVER_M2:
        raise SceneError(source, [Fault("obstacles", _nothing_free(layers, bounds))])
    kept = {}
    for section in ("goals", "stations", "robots"):
        kept[section] = _fitting(_all(layers, section), section, box, solid, notes)
        document[section] = [_with_own_id(one, used, notes) for one in kept[section]]
    own_ids: dict[str, list[str]]
    own_ids = {str(entry["id"]): [] for entry in _all(layers, "robots")}
    for entry, own in zip(kept["robots"], document["robots"], strict=True):
        own_ids[str(entry["id"])].append(own["id"])
    document["obstacles"] = list(_blocking(document["obstacles"], own_ids))
    return {key: value for key, value in document.items() if value != []}, notes


def _fitting(
    entries: Sequence[Entry],
    section: str,
    box: Polygon,
    solid: BaseGeometry,
    notes: list[str],
) -> list[Entry]:
    """Return goals, stations or robots that are in bounds; note which are not."""
    fitting: list[Entry] = []
    lost: list[Entry] = []
    for entry in entries:
        fits = box.covers(_point(entry)) and not solid.covers(_region(entry))
        (fitting if fits else lost).append(entry)
    if lost:
        names = ", ".join(str(entry["id"]) for entry in lost)
        what = f"{section} that lie out of bounds or wholly on obstacles"
        notes.append(f"left out {what}: {names}")
    return fitting


def _blocking(
    obstacles: Iterable[Entry], own_ids: Mapping[str, Sequence[str]]
) -> Iterable[Entry]:
    """Yield obstacles; what blocks robots does so by their ids in the scene.

    Those that block only robots that were left out are left out, too.

    Args:
        obstacles: entries, which name robots as their files do.
        own_ids: ids in the scene, by those in the files; none of who was left out.
    """
    for entry in obstacles:
        named = entry.get("blocks")
        if not isinstance(named, list) or not named:
            yield entry
        elif found := [own for id in named for own in own_ids.get(str(id), [id])]:
            yield {**entry, "blocks": found}


def _nothing_free(layers: Sequence[Layer], bounds: Box) -> str:
    """Return why no free ground is left, and what to do."""
    width_m, depth_m = bounds[2] - bounds[0], bounds[3] - bounds[1]
    if width_m * depth_m <= _SLIVER_M2:
        reason = "check its unit, resolution, --crs and --longest-side"
        return f"the ground is only {width_m:.3g} x {depth_m:.3g} m; {reason}"
    if any(layer.closes_unknown for layer in layers):
        return "no free ground is left; --unknown free opens what was never seen"
    message = f"they cover all of the ground, {width_m:.6g} x {depth_m:.6g} m"
    if any(layer.bounds for layer in layers):
        return f"{message}; check what the files take as occupied, and --crop"
    return (
        f"{message}, which reaches as far as the features do; add goals, stations or "
        "robots beside them, or state more ground by --crop X_MIN Y_MIN X_MAX Y_MAX"
    )


def _all(layers: Sequence[Layer], section: str) -> list[Any]:
    """Return what all layers have of a kind, such as "obstacles"."""
    return [item for layer in layers for item in getattr(layer, section)]


def _bounds(source: str, layers: Sequence[Layer], options: ImportOptions) -> Box:
    for layer in layers:
        if layer.heights is not None and layer.bounds is not None:
            return layer.bounds
    shown = [shapely.box(*layer.bounds) for layer in layers if layer.bounds]
    states_bounds = bool(shown)
    if not states_bounds:
        shown = [
            area.shape
            for section in ("obstacles", "terrain")
            for area in _all(layers, section)
        ] + [
            shapely.box(*np.add(_point(entry).bounds, _MARGINS_M))
            for section in ("goals", "stations", "robots")
            for entry in _all(layers, section)
        ]
    if not shown:
        raise SceneError(source, [Fault("", "holds nothing that a scene could show")])
    whole = shapely.box(*shapely.total_bounds(shown))
    if options.crop is not None:
        crop, first = shapely.box(*options.crop), layers[0]
        cropped = first.frame.placed(crop, first.crs, source).envelope
        if not cropped.intersection(whole).area:
            extent = ", ".join(f"{value:g}" for value in whole.bounds)
            message = f"{options.crop} lies beside the map, which covers {extent}"
            raise SceneError(source, [Fault("--crop", f"{message} in metres")])
        whole = cropped.intersection(whole) if states_bounds else cropped
    bounds: Box = whole.bounds
    return bounds


def _beside_lanes(
    lanes: Sequence[BaseGeometry], box: Polygon, width_m: float | None
) -> list[Area]:
    if width_m is None or not lanes:
        return []
    allowed = shapely.union_all(lanes).buffer(0.5 * width_m)
    return [Area(box.difference(allowed), {"id": "off_lane"})]


def _entries(areas: Iterable[Area], box: Polygon) -> Iterable[Entry]:
    """Yield the entries of areas inside `box`, one a polygon."""
    used: dict[str, int] = {}
    for area in areas:
        inside = area.shape if box.covers(area.shape) else area.shape & box
        for part in shapely.get_parts(inside):
            if isinstance(part, Polygon) and part.area > _SLIVER_M2:
                shape = shapely.transform(shapely.orient_polygons(part), _rounded)
                entry = {**polygon_entry(shape), **area.entry}
                if "id" in entry:
                    entry["id"] = _unused(_as_id(entry["id"]), used)
                    entry = {"id": entry.pop("id"), **entry}
                yield entry


def _rounded(corners: np.ndarray) -> np.ndarray:
    return np.round(corners, _DECIMALS) + 0.0


def _point(entry: Entry) -> shapely.Point:
    if "polygon" in entry:
        return shapely.Polygon(entry["polygon"]).centroid
    return shapely.Point(entry.get("pose") or entry["circle"]["center"])


def _region(entry: Entry) -> BaseGeometry:
    if "polygon" in entry:
        return Polygon(entry["polygon"])
    return _point(entry).buffer(entry["circle"]["radius"] if "circle" in entry else 0.0)


def _with_own_id(entry: Entry, used: dict[str, int], notes: list[str]) -> Entry:
    given = str(entry["id"])
    own = _unused(_as_id(given), used)
    if own != given:
        notes.append(f"'{given}' is called '{own}': ids are unique, of A-Za-z0-9_.-")
    return {**entry, "id": own}


def _as_id(given: Any) -> str:
    text = _NOT_IN_IDS.sub("_", str(given))[:60]
    return text if re.match(r"[A-Za-z0-9_]", text) else f"_{text}"


def _unused(wanted: str, used: dict[str, int]) -> str:
    """Return a name that is not used yet; `used` counts the names tried for each."""
    name = wanted
    while name in used:
        used[wanted] += 1
        name = f"{wanted}_{used[wanted]}"
    used[name] = 1
    return name


def lanes_note(count: int) -> str:
    """Return what becomes of the edges of a graph or layout."""
    return (
        f"lanes of {counted(count, 'edge')}: robots keep to them with --lanes WIDTH, "
        "in either direction; otherwise they were left out"
    )


def solid(shape: BaseGeometry, half_width_m: float, **style: Any) -> BaseGeometry:
    """Return a valid shape with area: points, lines and what has none get a width.

    Empty for polygons of which their holes leave nothing.

    Args:
        shape: of any kind.
        half_width_m: half the width that thin things get.
        style: of their ends and corners, as of `shapely.buffer`.
    """
    # A polygon that crosses itself may count zero until it is repaired.
    valid = shapely.make_valid(shape, method="structure", keep_collapsed=True)
    return valid.buffer(half_width_m, **style) if valid.area == 0.0 else valid


def polygons(shape: BaseGeometry) -> MultiPolygon:
    """Return the valid polygons of a shape, without lines and points."""
    valid = shapely.make_valid(shape, method="structure", keep_collapsed=False)
    parts = [part for part in shapely.get_parts(valid) if isinstance(part, Polygon)]
    return MultiPolygon(parts)
