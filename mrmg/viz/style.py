"""One visual language for every picture: colours, hatches and names of what is shown.

The colours are those of the simulated world (`simulation.palette`), made darker where
they must carry lines and text on a light page and paler where they lie below others.
Terrain is hatched as well, and targets are labelled: nothing depends on colour alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from mrmg.scene.types import Goal, Obstacle, Scene, Station
from mrmg.simulation import palette

INK = "#1F2328"
MUTED = "#5F6773"
GROUND = "#F7F7F3"
OBSTACLE = "#5B6068"
OBSTACLE_EDGE = "#33373D"
ON_OBSTACLE = "#FFFFFF"
CONTOUR = "#7A6A50"
GOAL_OPEN = "#FFFFFF"
GOAL_EDGE = "#1F2328"
STATION = "#7FD6CF"
STATION_EDGE = "#06504C"
RESERVE = "#B00020"

PARTIAL_OBSTACLE = "#9E8CAD"
"""As `palette.PARTIAL_OBSTACLE`, which videos show."""

STEEP_GROUND = "#9E8CAD80"
"""Half transparent: contour lines are seen through it."""


@dataclass(frozen=True, slots=True)
class LineLook:
    """How a path or course is drawn: in its robot's colour, without dashes.

    Attributes:
        width_em: width, in sizes of the picture's letters.
        opacity: 0..1.
    """

    width_em: float
    opacity: float

    def stroke(self, points: float) -> dict[str, Any]:
        """Return what draws it with matplotlib, its letters of `points`."""
        return {"linewidth": self.width_em * points, "alpha": self.opacity}


PLANNED, DRIVEN = LineLook(0.45, 0.33), LineLook(0.16, 1.0)
"""What was planned is wide and pale, what was driven thin: on maps and in charts."""

_LONGEST_NAME = 10
_HATCHES = ("..", "//", "xx", "\\\\", "++")
_PALENESS = 0.25
_LUMINANCES = (0.26, 0.26, 0.26, 0.26, 0.10, 0.10, 0.06, 0.26)
"""How light the robots' colours may be, in the palette's order. Lines of 0.26 have a
contrast of 3.4 on white; those of hues that colour-blind eyes would take for another
are darker, so that lightness distinguishes them."""
_LIGHTEST_LUMINANCE = 0.22
"""Lines of it have a contrast of 4.3 on the dark page's cards."""


@dataclass(frozen=True, slots=True)
class KeyEntry:
    """A line of a map's legend.

    Attributes:
        label: what it explains.
        look: "goal", "station", "area" or "line".
        color: fill, or colour of the line.
        edge: colour of the rim.
        hatch: matplotlib hatch pattern.
        dashed: whether the rim is.
    """

    label: str
    look: str
    color: str
    edge: str = MUTED
    hatch: str = ""
    dashed: bool = False


def terrain_classes(scene: Scene) -> dict[float, KeyEntry]:
    """Return how terrain of each multiplier is drawn, from easy to hard."""
    multipliers = sorted({area.multiplier for area in scene.terrain} - {1.0})
    looks = {
        value: (
            _hex(_paler(palette.terrain_colour(value), _PALENESS)),
            _HATCHES[rank % len(_HATCHES)],
        )
        for rank, value in enumerate(multipliers)
    }
    if any(area.multiplier == 1.0 for area in scene.terrain):
        looks[1.0] = (GROUND, "")
    return {
        value: KeyEntry(f"terrain ×{value:g}", "area", color, hatch=hatch)
        for value, (color, hatch) in looks.items()
    }


def obstacle_color(obstacle: Obstacle) -> str:
    """Return the colour of an obstacle, or of ground too steep for some robots."""
    if obstacle.is_steep_ground:
        return STEEP_GROUND
    return OBSTACLE if obstacle.blocks is None else PARTIAL_OBSTACLE


def target_colors(target: Goal | Station) -> tuple[str, str]:
    """Return fill and rim of a target; goals are filled so until they are visited."""
    if isinstance(target, Station):
        return STATION, STATION_EDGE
    return GOAL_OPEN, GOAL_EDGE


def map_key(scene: Scene) -> list[KeyEntry]:
    """Return the legend of a scene's map: all kinds of things that it holds."""
    barriers = {obstacle_color(barrier) for barrier in scene.barriers}
    classes = terrain_classes(scene)
    entries: dict[KeyEntry, object] = {
        KeyEntry("goal", "goal", GOAL_OPEN, GOAL_EDGE): scene.goals,
        KeyEntry("recharging station ⚡", "station", STATION, STATION_EDGE): (
            scene.stations
        ),
        KeyEntry("obstacle", "area", OBSTACLE, OBSTACLE_EDGE): OBSTACLE in barriers,
        _for_some_robots("obstacle", PARTIAL_OBSTACLE): PARTIAL_OBSTACLE in barriers,
        _for_some_robots("too steep", STEEP_GROUND): STEEP_GROUND in barriers,
        KeyEntry("plain ground ×1", "area", GROUND): classes and 1.0 not in classes,
        KeyEntry("contour line", "line", CONTOUR): scene.elevation is not None,
    }
    return [*(entry for entry, shown in entries.items() if shown), *classes.values()]


def _for_some_robots(what: str, color: str) -> KeyEntry:
    """Return the entry of what keeps some robots out and lets others through."""
    label = f"{what} for some robots"
    return KeyEntry(label, "area", color, OBSTACLE_EDGE, dashed=True)


def robot_colors(robots: Sequence[str]) -> dict[str, str]:
    """Return a colour by robot id (scene's order) that is dark enough for lines."""
    return {
        robot: _ink(palette.robot_colour(at), _LUMINANCES[at % len(_LUMINANCES)])
        for at, robot in enumerate(robots)
    }


def robot_colors_on_dark(robots: Sequence[str]) -> dict[str, str]:
    """Return a colour by robot id (scene's order) that is light enough on dark."""
    return {robot: _glow(palette.robot_colour(at)) for at, robot in enumerate(robots)}


def scene_robot_colors(scene: Scene) -> dict[str, str]:
    """Return the colour of each robot of a scene."""
    return robot_colors([robot.id for robot in scene.robots])


def goal_labels(scene: Scene) -> dict[str, str]:
    """Return a text for each goal: its id if no id is long, else a number."""
    return _labels([goal.id for goal in scene.goals], "")


def target_labels(scene: Scene) -> dict[str, str]:
    """Return a text for each goal and station, those of stations with their sign."""
    stations = _labels([station.id for station in scene.stations], "S")
    signs = {name: f"⚡{text}" for name, text in stations.items()}
    return {**goal_labels(scene), **signs}


def _labels(ids: Sequence[str], prefix: str) -> dict[str, str]:
    if all(len(name) <= _LONGEST_NAME for name in ids):
        return {name: name for name in ids}
    return {name: f"{prefix}{number}" for number, name in enumerate(ids, start=1)}


def rgb(color: str) -> tuple[int, int, int]:
    """Return a `#RRGGBB` colour as three integers of 0..255."""
    return int(color[1:3], 16), int(color[3:5], 16), int(color[5:7], 16)


def _ink(color: palette.Rgb, luminance: float) -> str:
    red, green, blue = color
    scale = min(1.0, (luminance / _luminance(color)) ** (1 / 2.2))
    return _hex((red * scale, green * scale, blue * scale))


def _glow(color: palette.Rgb) -> str:
    share = 0.0
    while _luminance(_paler(color, share)) < _LIGHTEST_LUMINANCE:
        share += 0.05
    return _hex(_paler(color, share))


def _luminance(color: palette.Rgb) -> float:
    """Return the relative luminance after WCAG 2.2, its curve simplified."""
    red, green, blue = color
    return float(0.2126 * red**2.2 + 0.7152 * green**2.2 + 0.0722 * blue**2.2)


def _paler(color: palette.Rgb, share: float) -> palette.Rgb:
    """Return a colour mixed with a share of white."""
    red, green, blue = ((1.0 - share) * part + share for part in color)
    return red, green, blue


def _hex(color: palette.Rgb) -> str:
    return "#" + "".join(f"{round(255 * part):02X}" for part in color)
