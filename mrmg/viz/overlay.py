"""The panel beside the map of the video: clock, goals, batteries, legend."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from PIL import Image, ImageDraw
from PIL.ImageDraw import ImageDraw as Pen

from mrmg.counted import counted
from mrmg.energy.text import energy_text
from mrmg.scene.types import Robot, Scene
from mrmg.viz import style
from mrmg.viz.tags import CARD, TEXT, draw_bar, font, text_width_em

_BACKGROUND = "#14181E"
_FAINT = "#A4ADBA"
_MOST_CHIP_ROWS = 5
_UNNAMED_CHIP = 12.0
_SHORTEST_ID_EM = 3.3


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotReading:
    """What the panel shows of one robot at one time.

    Attributes:
        robot: id of the robot.
        charge: battery content over capacity.
        speed_m_s: signed speed.
        heading_for: label of the next target; "" after the last.
        standing: "broken down", "not used" or "", as of `activities.standing_of`.
    """

    robot: str
    charge: float
    speed_m_s: float
    heading_for: str
    standing: str = ""

    @property
    def broken_down(self) -> bool:
        """Whether it will not move any more."""
        return self.standing == "broken down"

    @property
    def percent(self) -> str:
        """The charge as text."""
        return f"{100.0 * self.charge:.0f} %"

    def way(self, towards: str) -> str:
        """Return where the robot is going, after the word for towards."""
        if self.standing:
            return self.standing
        return f"{towards} {self.heading_for}" if self.heading_for else "tour done"


@dataclass(frozen=True, slots=True, kw_only=True)
class Reading:
    """What the panel shows of the mission at one time.

    Attributes:
        time_s: mission time.
        used_J: energy the fleet has drawn so far.
        visited: id of the robot that visited a goal, by goal id; open goals are absent.
        robots: one reading per robot.
    """

    time_s: float
    used_J: float
    visited: dict[str, str]
    robots: tuple[RobotReading, ...]

    @property
    def clock(self) -> str:
        """The time as minutes and seconds."""
        minutes, seconds = divmod(round(self.time_s, 1), 60.0)
        return f"{int(minutes):02d}:{seconds:04.1f}"

    @property
    def used(self) -> str:
        """The energy drawn, with its unit."""
        return energy_text(self.used_J, 1)

    def goals_of(self, scene: Scene) -> str:
        """Return how many of a scene's goals are visited."""
        return f"{len(self.visited)} of {counted(len(scene.goals), 'goal')}"


class Panel:
    """The panel beside the map: clock, goals, batteries, legend.

    It is laid out in units that are pixels of a panel 345 wide beside a picture 640
    high.
    """

    def __init__(
        self, scene: Scene, size: tuple[int, int], speed: float, video_height: int
    ) -> None:
        """Lay out the panel and draw what never changes.

        Args:
            scene: names and colours.
            size: width and height [pixels].
            speed: mission seconds per second of video.
            video_height: of the whole picture [pixels]; decides the size of the text.
        """
        self._scene = scene
        self._speed = speed
        self._colors = style.scene_robot_colors(scene)
        self._labels = style.goal_labels(scene)
        self._widest_id_em = max(
            (text_width_em(robot.id, bold=True) for robot in scene.robots), default=0.0
        )
        self._unit = min(size[0] / 345.0, video_height / 640.0)
        self._width, self._height = size[0] / self._unit, size[1] / self._unit
        self._base = Image.new("RGB", size, _BACKGROUND)
        self._cards_top = self._draw_head(ImageDraw.Draw(self._base))
        self._cards_bottom = self._height
        room = self._height - self._cards_top - 46.0 * len(scene.robots)
        if room > 52 + 22 * ((len(style.map_key(scene)) + 1) // 2):
            self._cards_bottom = self._draw_legend(ImageDraw.Draw(self._base))

    def draw(self, reading: Reading) -> np.ndarray:
        """Return the panel at one time, shape (height, width, 3) of bytes."""
        image = self._base.copy()
        pen = ImageDraw.Draw(image)
        self._draw_clock(pen, reading)
        self._draw_goals(pen, reading)
        room = self._cards_bottom - self._cards_top
        pitch = min(66.0, room / max(len(reading.robots), 1))
        for row, robot in enumerate(reading.robots):
            top = self._cards_top + row * pitch
            self._draw_card(pen, self._scene.robots[row], robot, top, pitch)
        return np.asarray(image)

    def _px(self, *place: float) -> Any:
        """Return a point or a box in pixels."""
        return tuple(length * self._unit for length in place)

    def _write(
        self, pen: Pen, x: float, y: float, text: str, size: float, **look: Any
    ) -> None:
        """Write a text; `look` as of `font` and of Pillow."""
        bold, fill = look.pop("bold", False), look.pop("fill", TEXT)
        face = font(max(round(size * self._unit), 9), bold=bold)
        pen.text(self._px(x, y), text, font=face, fill=fill, **look)

    def _draw_head(self, pen: Pen) -> float:
        end, speed = self._width - 18, f"×{self._speed:g} speed"
        self._write(pen, 18, 12, self._scene.name, 17, bold=True, fill=_FAINT)
        self._write(pen, end, 12, speed, 15, fill=_FAINT, anchor="ra")
        per_row, _ = self._chips()
        rows = 1 + (len(self._scene.goals) - 1) // per_row
        return 122.0 + 26.0 * rows

    def _chips(self) -> tuple[int, float]:
        """Return how many goals stand in a row, and the width of each.

        Where names would take too many rows, goals are marks without names.
        """
        widest = max(
            (text_width_em(name, bold=True) for name in self._labels.values()),
            default=0.0,
        )
        for width in (max(34.0, 12.0 * widest + 10.0), _UNNAMED_CHIP):
            per_row = max(int((self._width - 36) // (width + 4)), 1)
            if len(self._labels) <= per_row * _MOST_CHIP_ROWS:
                break
        return per_row, width

    def _draw_clock(self, pen: Pen, reading: Reading) -> None:
        used, end = f"{reading.used} used", self._width - 18
        self._write(pen, 18, 37, reading.clock, 37, bold=True)
        self._write(pen, end, 54, used, 16, bold=True, anchor="ra")
        if self._scene.goals:
            self._write(pen, 18, 90, f"{reading.goals_of(self._scene)} visited", 16)

    def _draw_goals(self, pen: Pen, reading: Reading) -> None:
        per_row, width = self._chips()
        for number, goal in enumerate(self._scene.goals):
            row, column = divmod(number, per_row)
            x, y = 18 + column * (width + 4), 115 + row * 26
            robot = reading.visited.get(goal.id)
            color = TEXT if robot else _FAINT
            pen.rounded_rectangle(
                self._px(x, y, x + width, y + 21),
                radius=5 * self._unit,
                fill=self._colors[robot] if robot else _BACKGROUND,
                outline=color,
            )
            if width > _UNNAMED_CHIP:
                look = {"bold": True, "fill": color, "anchor": "mm"}
                name = self._labels[goal.id]
                self._write(pen, x + 0.5 * width, y + 10.5, name, 12, **look)

    def _draw_card(
        self, pen: Pen, robot: Robot, reading: RobotReading, top: float, pitch: float
    ) -> None:
        left, right, bottom = 14.0, self._width - 14, top + pitch - 6
        middle = top + 0.30 * (bottom - top)
        card = self._px(left, top, right, bottom)
        pen.rounded_rectangle(card, 7 * self._unit, fill=CARD)
        edge = self._px(left, top, left + 9, bottom)
        pen.rounded_rectangle(edge, 4 * self._unit, fill=self._colors[robot.id])
        way, speed = reading.way("→"), f"{reading.speed_m_s:.1f} m/s"
        way_em = max(_SHORTEST_ID_EM, self._widest_id_em) + 0.7
        needed_em = way_em + text_width_em(f"{way}  {speed}", bold=True)
        size = min(16.0, 0.27 * pitch, (right - left - 34.0) / needed_em)
        row, end, half = top + 0.73 * (bottom - top), right - 14, 0.13 * (bottom - top)
        for x, y, text, fill, anchor in (
            (left + 20, middle, robot.id, TEXT, "lm"),
            (left + 20 + way_em * size, middle, way, TEXT, "lm"),
            (end, middle, speed, _FAINT, "rm"),
            (end, row, reading.percent, TEXT, "rm"),
        ):
            self._write(pen, x, y, text, size, bold=True, fill=fill, anchor=anchor)
        bar = self._px(left + 20, row - half, right - 74, row + half)
        draw_bar(pen, bar, reading.charge, robot.battery.reserve_fraction)

    def _draw_legend(self, pen: Pen) -> float:
        entries = style.map_key(self._scene)
        room = 0.5 * self._width - (18 + 26 + 18)
        size = min(13.0, room / max(text_width_em(entry.label) for entry in entries))
        rows = (len(entries) + 1) // 2
        top = self._height - 40 - rows * 22
        for number, entry in enumerate(entries):
            row, column = divmod(number, 2)
            x, y = 18 + column * 0.5 * self._width, top + row * 22
            line = entry.look == "line"
            fill = style.GROUND if line else entry.color
            pen.rectangle(self._px(x, y, x + 18, y + 14), fill=fill, outline=_FAINT)
            if line:
                across, width = self._px(x, y + 7, x + 18, y + 7), round(2 * self._unit)
                pen.line(across, fill=entry.color, width=max(width, 1))
            self._write(pen, x + 26, y + 7, entry.label, size, fill=_FAINT, anchor="lm")
        lines = "wide, pale line: planned    thin line: driven"
        self._write(pen, 18, top + rows * 22 + 4, lines, 13, fill=_FAINT)
        return top - 12
