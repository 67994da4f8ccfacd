"""Plan missions of robots, obstacles and goals that are drawn at random.

One or two kinds of robots, cars and unicycles, are drawn for each mission: their size,
outline, speeds and limits; then a map in proportion to the larger kind, 1 to 5 robots,
2 to 11 goals, and by turns finishes, headings, stays, stations, terrain, scarce
batteries and the makespan as objective. All places lie in one part of the free space,
but nothing makes sure that there is a plan: rows without one count as failed. Robots
that are drawn have no MJCF, so that plans are verified but not driven. With `--mazes`
the walls of a maze take the place of polygons, so that robots, with goals or without,
can hardly pass each other. Protocol: that of `tools/bench`, one row a mission; the same
number gives the same mission.

Finished missions are kept in --output FILE: the same command goes on from there after
an interruption. Rows of --json are those of `tools/bench`.
"""

from __future__ import annotations

import argparse
import tempfile
from math import pi
from pathlib import Path
from typing import Any

import bench
import numpy as np
import shapely
import yaml
from maze import drawn_maze
from protocol import run, seed_range

from mrmg.scene.loading import scene_from_document
from mrmg.scene.types import Scene

PARAMETERS = {
    "format": 1,
    "height": 1.0,
    "planning_share": 0.85,
    "wheel": {"radius": 0.15, "inertia": 0.1, "count": 4, "mass": 2.0},
    "friction_coefficient": 1.0,
    "drive_efficiency": 0.8,
}
"""What all robots have in common."""

SIDE = 10.0, 25.0
"""Longer side of a map, least and most, as a multiple of the longest robot."""

OBSTACLE = 0.4, 3.0
"""Radius of obstacles, likewise."""

CORRIDOR = 2.2, 3.2
"""Side of a maze's cells, likewise."""

ROOM, GOAL_ROOM = 1.0, 0.6
"""Distance of robots and of goals from obstacles, likewise."""

APART = 2.0
"""Distance of robots, finishes, goals and stations from one another, likewise."""


def main() -> int:
    """Run the bench; return 1 if any mission failed."""
    options = parse_options()
    print(f"{__doc__}\n{bench.protocol(options)}")
    with tempfile.TemporaryDirectory() as folder:
        drawn = (
            mission(number, Path(folder), maze=options.mazes)
            for number in options.missions
        )
        scenes = ((scene.name, scene) for scene in drawn)
        return bench.plan_each(scenes, options, "bench_random")


def parse_options() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__, prog="tools/bench_random")
    parser.add_argument(
        "--missions", type=seed_range, default="0-99", help="first-last, default 0-99"
    )
    parser.add_argument("--mazes", action="store_true", help="mazes, not polygons")
    bench.add_mission_options(parser, seeds="0-0")
    return parser.parse_args()


def mission(number: int, folder: Path, *, maze: bool = False) -> Scene:
    """Return a drawn mission; models of its robots are written to a folder."""
    rng = np.random.default_rng(number)
    kinds = [robot_model(rng) for _ in range(rng.integers(1, 3))]
    for i, kind in enumerate(kinds):
        base = folder / f"{number}_{i}"
        base.mkdir(parents=True, exist_ok=True)
        (base / "robot.yaml").write_text(yaml.safe_dump(kind))
    longest_m = max(float(np.ptp(kind["footprint"], axis=0)[0]) for kind in kinds)
    places = _Places(rng, longest_m, maze)
    terrain, document = [], places.document
    robots = [
        {"id": f"r{i}", "model": str(folder / f"{number}_{rng.integers(len(kinds))}")}
        for i in range(rng.integers(1, 6))
    ]
    document["robots"] = [
        {**robot, "pose": [*at, _angle(rng)], **_finish(rng, places)}
        for robot in robots
        if (at := places.draw(ROOM)) is not None
    ]
    document["goals"] = places.regions("g", int(rng.integers(2, 12)), GOAL_ROOM)
    for goal in document["goals"]:
        if rng.random() < 0.15:
            goal["heading"] = _angle(rng)
        if rng.random() < 0.15:
            goal["dwell"] = 5.0
    document["stations"] = places.regions("s", int(rng.integers(3)), ROOM)
    for i in range(rng.integers(4)):
        center = rng.uniform(0.0, places.sides_m).tolist()
        circle = {"center": center, "radius": longest_m * rng.uniform(1.0, 4.0)}
        multiplier = float(rng.uniform(0.5, 4.0))
        terrain.append({"id": f"t{i}", "circle": circle, "multiplier": multiplier})
    ranges = float(rng.choice([2.0, 4.0, 10.0]))
    document |= {
        "format": 1,
        "name": f"mission{number}",
        "terrain": terrain,
        "battery": {"capacity_m": ranges * float(places.sides_m.sum())},
        "objective": "makespan" if rng.random() < 0.3 else "energy",
    }
    return scene_from_document(document, source=f"mission {number}")


def robot_model(rng: np.random.Generator) -> dict[str, Any]:
    """Return the document of a drawn robot."""
    car = bool(rng.random() < 0.5)
    length, slender = float(rng.uniform(0.6, 7.0)), float(rng.uniform(0.3, 0.8))
    width, back = slender * length, float(rng.uniform(0.1, 0.3) if car else 0.5)
    wheelbase = float(rng.uniform(0.5, 0.7)) * length
    ahead, aside = (1.0 - back) * length, 0.5 * width
    outline = [[-back * length, aside], [-back * length, -aside], [ahead, -aside]]
    if rng.random() < 0.3:  # a snout
        outline[2:] = [[0.8 * ahead, -aside], [ahead, -0.5 * aside]]
        outline += [[ahead, 0.5 * aside], [0.8 * ahead, aside]]
    else:
        outline.append([ahead, aside])
    speed, mass = float(rng.uniform(0.3, 4.0)), 100.0 * length * width
    backwards = float(rng.choice([0.3, 0.5, 1.0] if car else [0.0, 0.5, 1.0]))
    return {
        **PARAMETERS,
        "motion_model": "car" if car else "unicycle",
        "footprint": outline,
        "wheelbase": wheelbase,
        "track": 0.8 * width,
        "mass": mass,
        "limits": {
            "v_min": -backwards * speed,
            "v_max": speed,
            "w_max": float(rng.uniform(0.4, 0.9) if car else rng.uniform(0.5, 2.0)),
            "u1_max": float(rng.uniform(0.3, 2.0)),
            "u2_max": float(rng.uniform(0.3, 3.0)),
        },
        "rolling_coefficient": float(rng.uniform(0.02, 0.1)),
        "turning_coefficient": float(rng.uniform(0.0, 0.05)),
        "regeneration_efficiency": float(rng.choice([0.0, 0.5])),
        "idle_power": float(rng.choice([0.0, 5.0])),
        "battery_capacity": 1e4 * mass,
    }


class _Places:
    """Draws obstacles, then places in one part of the free space.

    Attributes:
        document: with the bounds and the obstacles.
        sides_m: of the map.
    """

    def __init__(self, rng: np.random.Generator, longest_m: float, maze: bool) -> None:
        self._rng, self._longest_m = rng, longest_m
        self._taken = shapely.MultiPoint()
        obstacles = self._walls() if maze else self._polygons()
        bounds = shapely.box(0.0, 0.0, *self.sides_m)
        land = bounds.buffer(-GOAL_ROOM * longest_m) - shapely.union_all(
            obstacles
        ).buffer(GOAL_ROOM * longest_m)
        self._free = max(shapely.get_parts(land), key=shapely.area)
        self.document: dict[str, Any] = {
            "bounds": [0.0, 0.0, *self.sides_m.tolist()],
            "obstacles": [
                {"polygon": shapely.get_coordinates(part)[:-1].round(4).tolist()}
                for part in obstacles
            ],
        }

    def draw(self, room: float) -> list[float] | None:
        """Return a place with room around it, None where none is left."""
        free = self._free.buffer((GOAL_ROOM - room) * self._longest_m)
        free -= self._taken.buffer(APART * self._longest_m)
        for at in self._rng.uniform(0.0, self.sides_m, (500, 2)).round(3):
            if free.contains(place := shapely.Point(at)):
                self._taken |= place
                return [float(x) for x in at]
        return None

    def regions(self, name: str, most: int, room: float) -> list[dict[str, Any]]:
        """Return goals or stations, at most so many."""
        places = filter(None, (self.draw(room) for _ in range(most)))
        return [{"id": f"{name}{i}", **self.circle(at)} for i, at in enumerate(places)]

    def circle(self, at: list[float]) -> dict[str, Any]:
        """Return the region of a goal, a station or a finish."""
        radius_m = self._longest_m * self._rng.uniform(0.1, 0.4)
        return {"circle": {"center": at, "radius": round(float(radius_m), 3)}}

    def _walls(self) -> list[shapely.Polygon]:
        """Draw a maze."""
        drawn = drawn_maze(self._rng, self._longest_m * self._rng.uniform(*CORRIDOR))
        self.sides_m = np.full(2, drawn.side_m)
        at, half = drawn.wall[:, :2], 0.5 * drawn.wall[:, 2:]
        corners = np.hstack([at - half, at + half])
        return [shapely.box(*corner) for corner in corners.clip(0.0, drawn.side_m)]

    def _polygons(self) -> list[shapely.Polygon]:
        """Draw a map with polygons."""
        wide_m = self._longest_m * self._rng.uniform(*SIDE)
        self.sides_m = np.array([wide_m, wide_m * self._rng.uniform(0.5, 1.0)])
        bounds = shapely.box(0.0, 0.0, *self.sides_m)
        return [
            part
            for _ in range(self._rng.integers(2, 14))
            for part in shapely.get_parts(self._obstacle() & bounds)
            if part.area > 0.01
        ]

    def _obstacle(self) -> shapely.Polygon:
        rng, corners = self._rng, int(self._rng.integers(3, 9))
        angle = np.sort(rng.uniform(0.0, 2.0 * pi, corners))
        radius = self._longest_m * rng.uniform(*OBSTACLE) * rng.uniform(0.4, 1, corners)
        around = radius[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
        return shapely.Polygon(rng.uniform(0.0, self.sides_m) + around).buffer(0.0)


def _finish(rng: np.random.Generator, places: _Places) -> dict[str, Any]:
    """Return what a robot's finish adds to it, for 4 of 10."""
    if rng.random() > 0.4 or (at := places.draw(ROOM)) is None:
        return {}
    heading = {"heading": _angle(rng)} if rng.random() < 0.6 else {}
    return {"finish": {**places.circle(at), **heading}}


def _angle(rng: np.random.Generator) -> float:
    return round(float(rng.uniform(-pi, pi)), 3)


if __name__ == "__main__":
    run(main)
