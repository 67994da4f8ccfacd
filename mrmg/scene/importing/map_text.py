"""Reading foreign polygon maps as bare shapes in the file's own units.

Two text formats are read:

- sectioned: `[BORDER]` and any number of `[OBSTACLE]`, with one `x y` per line; or
  `[MAP_POINTS]` (`id x y`) with `[MAP_BORDER]` and `[MAP_OBSTACLE]` that list point
  ids. Tags may carry blanks; other ones, as `[SCALE]`, are read over. Polygons are
  closed implicitly and may run either way.
- rows: 6 numbers are an obstacle triangle, 4 a segment, 2 a point. The border, if there
  is one, is drawn with thin triangles.

What follows a `#` in a line is a comment.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
import shapely
from shapely.geometry import LineString, Point, Polygon
from shapely.geometry.base import BaseGeometry

from mrmg.errors import Fault, SceneError
from mrmg.scene.loading.yaml_text import read_text

_POINTS_TAG = "MAP_POINTS"
_BORDER_TAGS = ("BORDER", "MAP_BORDER")
_OBSTACLE_TAGS = ("OBSTACLE", "MAP_OBSTACLE")

_Line = tuple[int, str]
"""Number of a line, from 1, and its text."""


@dataclass(frozen=True, kw_only=True)
class RawMap:
    """A map as drawn.

    Attributes:
        border: the ground inside it may be driven on; None where none is drawn.
        obstacles: polygons, segments and points.
    """

    border: Polygon | None
    obstacles: tuple[BaseGeometry, ...]


@dataclass(frozen=True)
class _Section:
    tag: str
    line: int
    rows: list[tuple[int, list[float]]]


def read_map(path: Path) -> RawMap:
    """Read a map file of either format.

    Raises:
        SceneError: naming every line that cannot be used.
    """
    text = read_text(path, source=str(path))
    uncommented = [line.partition("#")[0].strip() for line in text.splitlines()]
    lines = [(number, line) for number, line in enumerate(uncommented, start=1) if line]
    if not lines:
        message = "empty; expected a sectioned map or rows of 6, 4 or 2 numbers"
        raise SceneError(str(path), [Fault("", message)])
    reader = _Reader()
    if any(line.startswith("[") for _, line in lines):
        found = reader.sectioned(lines)
    else:
        found = reader.rows(lines)
    if reader.faults:
        raise SceneError(str(path), reader.faults)
    return found


class _Reader:
    """Turns lines into shapes and collects the faults of the lines."""

    def __init__(self) -> None:
        self.faults: list[Fault] = []

    def rows(self, lines: Sequence[_Line]) -> RawMap:
        shapes: list[BaseGeometry] = []
        in_space = False
        for number, values in self._numbers(lines):
            in_space |= len(values) == 9
            if len(values) in (2, 4, 6):
                points = np.reshape(values, (-1, 2))
                shapes.append((Point, LineString, Polygon)[len(points) - 1](points))
            else:
                self._fault(number, f"has {len(values)} numbers; expected 6, 4 or 2")
        if not shapes:
            # Not one usable row: some other kind of file.
            message = (
                f"no map, begins with '{lines[0][1][:30]}'; expected a sectioned map "
                "or rows of 6, 4 or 2 numbers"
            )
            if in_space:
                message += (
                    "; rows of 9 numbers are triangles in space: leave out the heights "
                    "for obstacles, or make a GeoTIFF or an ESRI ASCII grid of them "
                    "for an elevation"
                )
            self.faults = [Fault("", message)]
        border = None if self.faults else _drawn_border(shapes)
        return RawMap(border=border, obstacles=tuple(shapes))

    def sectioned(self, lines: Sequence[_Line]) -> RawMap:
        sections = list(self._sections(lines))
        points = self._points(sections)
        border: Polygon | None = None
        obstacles: list[BaseGeometry] = []
        for section in sections:
            if section.tag in _BORDER_TAGS:
                if border is not None:
                    message = f"a second [{section.tag}]; expected one border"
                    self._fault(section.line, message)
                border = self._polygon(section, points)
            elif section.tag in _OBSTACLE_TAGS:
                obstacles.append(self._polygon(section, points))
        if border is None and not self.faults:
            self.faults.append(Fault("", "has no [BORDER] section; expected one"))
        return RawMap(border=border, obstacles=tuple(obstacles))

    def _sections(self, lines: Sequence[_Line]) -> Iterator[_Section]:
        """Yield all sections; only those of known tags have rows."""
        known = (_POINTS_TAG, *_BORDER_TAGS, *_OBSTACLE_TAGS)
        starts = [at for at, (_, line) in enumerate(lines) if line.startswith("[")]
        for number, line in lines[: starts[0]]:
            self._fault(number, f"'{line[:30]}' stands before the first [TAG]")
        for start, end in pairwise([*starts, len(lines)]):
            number, title = lines[start]
            tag = title.strip("[] \t").upper()
            rows = self._numbers(lines[start + 1 : end]) if tag in known else ()
            yield _Section(tag, number, list(rows))

    def _points(self, sections: list[_Section]) -> dict[int, list[float]] | None:
        tables = [section for section in sections if section.tag == _POINTS_TAG]
        if not tables:
            return None
        points: dict[int, list[float]] = {}
        for number, values in (row for table in tables for row in table.rows):
            if len(values) == 3:
                points[int(values[0])] = values[1:]
            else:
                self._fault(number, f"has {len(values)} numbers; expected id x y")
        return points

    def _polygon(
        self, section: _Section, points: dict[int, list[float]] | None
    ) -> Polygon:
        corners: list[list[float]] = []
        for number, values in section.rows:
            if points is not None and section.tag.startswith("MAP_"):
                missing = [int(value) for value in values if int(value) not in points]
                if missing:
                    self._fault(number, f"names the unknown point {missing[0]}")
                corners += [points[int(v)] for v in values if int(v) in points]
            elif len(values) == 2:
                corners.append(values)
            else:
                self._fault(number, f"has {len(values)} numbers; expected x y")
        if len(corners) < 3:
            message = f"[{section.tag}] has {len(corners)} corners; expected 3 or more"
            self._fault(section.line, message)
            return Polygon()
        return Polygon(corners)

    def _numbers(self, lines: Sequence[_Line]) -> Iterator[tuple[int, list[float]]]:
        """Yield the numbers of each line that has nothing else."""
        for number, line in lines:
            try:
                values = [float(word) for word in line.split()]
            except ValueError:
                self._fault(number, f"got '{line[:30]}'; expected numbers")
                continue
            if np.isfinite(values).all():
                yield number, values
            else:
                self._fault(number, f"got '{line[:30]}'; expected finite numbers")

    def _fault(self, line: int, message: str) -> None:
        self.faults.append(Fault(f"line {line}", message))


def _drawn_border(shapes: list[BaseGeometry]) -> Polygon | None:
    """Return the hole of the frame that thin triangles draw around a map, if any."""
    solid = shapely.union_all([shape for shape in shapes if shape.area > 0.0])
    holes = [
        Polygon(ring)
        for part in shapely.get_parts(solid)
        for ring in getattr(part, "interiors", [])
    ]
    extent = shapely.box(*shapely.total_bounds(shapes))
    frame = max(holes, key=lambda hole: hole.area, default=None)
    return frame if frame is not None and frame.area > 0.5 * extent.area else None
