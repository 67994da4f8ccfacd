"""The panel beside the map of the video: clock, goals, batteries, legend."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from PIL import Image, ImageDraw, ImageFont

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
    """The panel beside the map: clock, goals, batteries, legend."""

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
        self._size = size
        self._speed = speed
        self._colors = style.scene_robot_colors(scene)
        self._labels = style.goal_labels(scene)
        self._widest_id_em = max(
            (text_width_em(robot.id, bold=True) for robot in scene.robots), default=0.0
        )
        self._unit = min(size[0] / 345.0, video_height / 640.0)
        self._base = Image.new("RGB", size, _BACKGROUND)
        self._cards_top = self._draw_head(ImageDraw.Draw(self._base))
        self._cards_bottom = float(size[1])
        room = size[1] - self._cards_top - len(scene.robots) * self._px(46)
        if room > self._px(52 + 22 * ((len(style.map_key(scene)) + 1) // 2)):
            self._cards_bottom = self._draw_legend(ImageDraw.Draw(self._base))

    def draw(self, reading: Reading) -> np.ndarray:
        """Return the panel at one time, shape (height, width, 3) of bytes."""
        image = self._base.copy()
        pen = ImageDraw.Draw(image)
        self._draw_clock(pen, reading)
        self._draw_goals(pen, reading)
        room = self._cards_bottom - self._cards_top
        pitch = min(self._px(66), room / max(len(reading.robots), 1))
        for row, robot in enumerate(reading.robots):
            top = self._cards_top + row * pitch
            self._draw_card(pen, self._scene.robots[row], robot, top, pitch)
        return np.asarray(image)

    def _px(self, length: float) -> float:
        return length * self._unit

    def _font(self, size: float, *, bold: bool = False) -> ImageFont.FreeTypeFont:
        return font(max(round(self._px(size)), 9), bold=bold)

    def _draw_head(self, pen: ImageDraw.ImageDraw) -> float:
        left, top = self._px(18), self._px(12)
        bold = self._font(17, bold=True)
        pen.text((left, top), self._scene.name, font=bold, fill=_FAINT)
        end = (self._size[0] - left, top)
        speed = f"×{self._speed:g} speed"
        pen.text(end, speed, font=self._font(15), fill=_FAINT, anchor="ra")
        per_row, _ = self._chips()
        rows = 1 + (len(self._scene.goals) - 1) // per_row
        return self._px(122) + rows * self._px(26)

    def _chips(self) -> tuple[int, float]:
        """Return how many goals stand in a row, and the width of each [pixels].

        Where names would take too many rows, goals are marks without names.
        """
        widest = max(
            (text_width_em(name, bold=True) for name in self._labels.values()),
            default=0.0,
        )
        for width in (max(34.0, 12.0 * widest + 10.0), _UNNAMED_CHIP):
            per_row = max(int((self._size[0] - self._px(36)) // self._px(width + 4)), 1)
            if len(self._labels) <= per_row * _MOST_CHIP_ROWS:
                break
        return per_row, self._px(width)

    def _draw_clock(self, pen: ImageDraw.ImageDraw, reading: Reading) -> None:
        left = self._px(18)
        large, bold = self._font(37, bold=True), self._font(16, bold=True)
        pen.text((left, self._px(37)), reading.clock, font=large, fill=TEXT)
        end = (self._size[0] - left, self._px(54))
        pen.text(end, f"{reading.used} used", font=bold, fill=TEXT, anchor="ra")
        goals = f"{reading.goals_of(self._scene)} visited"
        pen.text((left, self._px(90)), goals, font=self._font(16), fill=TEXT)

    def _draw_goals(self, pen: ImageDraw.ImageDraw, reading: Reading) -> None:
        small = self._font(12, bold=True)
        per_row, width = self._chips()
        for number, goal in enumerate(self._scene.goals):
            row, column = divmod(number, per_row)
            x = self._px(18) + column * (width + self._px(4))
            y = self._px(115) + row * self._px(26)
            robot = reading.visited.get(goal.id)
            color = TEXT if robot else _FAINT
            pen.rounded_rectangle(
                (x, y, x + width, y + self._px(21)),
                radius=self._px(5),
                fill=self._colors[robot] if robot else _BACKGROUND,
                outline=color,
            )
            if width > self._px(_UNNAMED_CHIP):
                middle = (x + 0.5 * width, y + self._px(10.5))
                name = self._labels[goal.id]
                pen.text(middle, name, font=small, fill=color, anchor="mm")

    def _draw_card(
        self,
        pen: ImageDraw.ImageDraw,
        robot: Robot,
        reading: RobotReading,
        top: float,
        pitch: float,
    ) -> None:
        left, right = self._px(14), self._size[0] - self._px(14)
        bottom = top + pitch - self._px(6)
        middle = top + 0.30 * (bottom - top)
        pen.rounded_rectangle((left, top, right, bottom), self._px(7), fill=CARD)
        edge = (left, top, left + self._px(9), bottom)
        pen.rounded_rectangle(edge, self._px(4), fill=self._colors[robot.id])
        way, speed = reading.way("→"), f"{reading.speed_m_s:.1f} m/s"
        way_em = max(_SHORTEST_ID_EM, self._widest_id_em) + 0.7
        needed_em = way_em + text_width_em(f"{way}  {speed}", bold=True)
        room = (right - left) / self._unit - 34.0
        size = min(16.0, 0.27 * pitch / self._unit, room / needed_em)
        text = self._font(size, bold=True)
        name = (left + self._px(20), middle)
        pen.text(name, robot.id, font=text, fill=TEXT, anchor="lm")
        start = (left + self._px(20.0 + way_em * size), middle)
        pen.text(start, way, font=text, fill=TEXT, anchor="lm")
        row = top + 0.73 * (bottom - top)
        end = right - self._px(14)
        pen.text((end, middle), speed, font=text, fill=_FAINT, anchor="rm")
        pen.text((end, row), reading.percent, font=text, fill=TEXT, anchor="rm")
        half = 0.13 * (bottom - top)
        bar = (left + self._px(20), row - half, right - self._px(74), row + half)
        draw_bar(pen, bar, reading.charge, robot.battery.reserve_fraction)

    def _draw_legend(self, pen: ImageDraw.ImageDraw) -> float:
        entries = style.map_key(self._scene)
        room = 0.5 * self._size[0] - self._px(18 + 26 + 18)
        widest = max(text_width_em(entry.label) for entry in entries)
        small = self._font(min(13.0, room / widest / self._unit))
        rows = (len(entries) + 1) // 2
        top = self._size[1] - self._px(40) - rows * self._px(22)
        for number, entry in enumerate(entries):
            row, column = divmod(number, 2)
            x = self._px(18) + column * 0.5 * self._size[0]
            y = top + row * self._px(22)
            middle = y + self._px(7)
            area = (x, y, x + self._px(18), y + self._px(14))
            line = entry.look == "line"
            fill = style.GROUND if line else entry.color
            pen.rectangle(area, fill=fill, outline=_FAINT)
            if line:
                across = (x, middle, x + self._px(18), middle)
                pen.line(across, fill=entry.color, width=max(round(self._px(2)), 1))
            spot = (x + self._px(26), middle)
            pen.text(spot, entry.label, font=small, fill=_FAINT, anchor="lm")
        lines = "wide, pale line: planned    thin line: driven"
        spot = (self._px(18), top + rows * self._px(22) + self._px(4))
        pen.text(spot, lines, font=self._font(13), fill=_FAINT)
        return top - self._px(12)
