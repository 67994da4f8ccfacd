"""Plan missions whose robots must end, and visit goals, with headings.

Each yard is of 40 x 30 m with five boxes, three robots and seven goals; robots end
within 0.4 m of a place, 0.2 rad off a heading at most, and the first --aimed goals
want headings, too. The first --bays robots end in bays of 3 m that are 16 cm wider than
they are, whose middles lie up to 0.15 m and 0.1 rad off where they must end; yards with
bays have no boxes. Protocol: that of `tools/bench`, one row a yard; the same number
gives the same yard.

Finished missions are kept in --output FILE: the same command goes on from there after
an interruption. Rows of --json are those of `tools/bench`.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from math import atan2, cos, pi, sin
from typing import Any

import bench
import numpy as np
from protocol import run, seed_range

from mrmg import shipped
from mrmg.scene.loading import scene_from_document
from mrmg.scene.loading.models import load_model
from mrmg.scene.types import Scene

SIDES_M = 40.0, 30.0
"""Sides of a yard."""

BOXES, ROBOTS, GOALS = 5, 3, 7
"""Numbers of them."""

BOX_M = 1.0, 5.0
"""Sides of boxes, least and most."""

ROOM_M = 2.5
"""Room about a place to the next box or to the border ..."""

APART_M = 3.5
"""... and to the next place."""

GOAL_M, FINISH_M = 0.7, 0.4
"""Radii of goals and of finishes."""

BAY_M, WALL_M = 3.0, 0.3
"""Length of a bay, and thickness of its walls."""

BAY_ROOM_M = 0.08
"""Room beside a robot in the middle of a bay."""

BESIDE_M, ASKEW_RAD = 0.15, 0.1
"""How far off a bay's middle and its heading a finish lies at most."""

CAPACITY_M = 400.0
"""What batteries suffice for on plain ground."""


def main() -> int:
    """Run the bench; return 1 if any mission failed."""
    options = parse_options()
    print(f"{__doc__}\n{bench.protocol(options)}")
    yards = (
        yard(options.model, number, options.aimed, options.bays)
        for number in options.yards
    )
    scenes = ((scene.name, scene) for scene in yards)
    return bench.plan_each(scenes, options, "bench_headings")


def parse_options() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__, prog="tools/bench_headings")
    parser.add_argument("--model", default="car", help="default car")
    parser.add_argument(
        "--aimed", type=int, default=2, help="goals with headings, default 2"
    )
    parser.add_argument(
        "--bays", type=int, default=0, help="robots that end in bays, default 0"
    )
    parser.add_argument(
        "--yards", type=seed_range, default="0-15", help="first-last, default 0-15"
    )
    bench.add_mission_options(parser, seeds="0-0")
    return parser.parse_args()


def yard(model: str, number: int, aimed: int, bays: int = 0) -> Scene:
    """Return a yard for robots of a shipped model."""
    rng = np.random.default_rng(number)
    low, high = np.full(2, 4.0), np.array(SIDES_M) - 4.0
    count = 0 if bays else BOXES
    boxes = [(rng.uniform(low, high), rng.uniform(*BOX_M, 2)) for _ in range(count)]
    place = _places(boxes, rng)

    def heading() -> float:
        return round(float(rng.uniform(-pi, pi)), 2)

    goals: list[dict[str, Any]] = [
        {"id": f"g{i}", **_circle(next(place), GOAL_M)} for i in range(GOALS)
    ]
    for goal in goals[:aimed]:
        goal["heading"] = heading()
    robots = [
        {
            "id": f"r{i}",
            "model": model,
            "pose": [*next(place), heading()],
            "finish": {**_circle(next(place), FINISH_M), "heading": heading()},
        }
        for i in range(ROBOTS)
    ]
    half_m = load_model(shipped.models_folder() / model)[0].half_width_m + BAY_ROOM_M
    walls = [wall for robot in robots[:bays] for wall in _bay(robot, half_m, rng)]
    document = {
        "format": 1,
        "name": f"yard{number}",
        "bounds": [0, 0, *SIDES_M],
        "obstacles": [
            {"id": f"o{i}", "box": {"center": _rounded(at), "size": _rounded(size)}}
            for i, (at, size) in enumerate(boxes)
        ]
        + walls,
        "goals": goals,
        "battery": {"capacity_m": CAPACITY_M},
        "robots": robots,
    }
    return scene_from_document(document, source=f"yard {number}")


def _places(
    boxes: list[tuple[np.ndarray, np.ndarray]], rng: np.random.Generator
) -> Iterator[list[float]]:
    """Yield places with room about them, apart from each other."""
    kept: list[np.ndarray] = []
    while True:
        at = rng.uniform(ROOM_M, np.array(SIDES_M) - ROOM_M)
        clear = all(
            (np.abs(at - middle) > 0.5 * size + ROOM_M).any() for middle, size in boxes
        )
        if clear and all(np.hypot(*(at - other)) > APART_M for other in kept):
            kept.append(at)
            yield _rounded(at)


def _bay(
    robot: dict[str, Any], half_m: float, rng: np.random.Generator
) -> list[dict[str, Any]]:
    """Return the walls of a bay about a robot's finish, open to the yard's middle.

    The robot drives in forwards or backwards: its finish gets the heading for that.
    """
    finish = robot["finish"]
    center = np.array(finish["circle"]["center"])
    inwards = atan2(*(center - 0.5 * np.array(SIDES_M))[::-1])
    backwards = pi * int(rng.integers(2))
    finish["heading"] = inwards + backwards + rng.uniform(-ASKEW_RAD, ASKEW_RAD)
    along = np.array([cos(inwards), sin(inwards)])
    across = np.array([-along[1], along[0]])
    middle = center + rng.uniform(-BESIDE_M, BESIDE_M) * across
    corners = 0.5 * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) * [BAY_M, WALL_M]
    walls = []
    for side in (-1, 1):
        shift = corners + [0.0, side * (half_m + 0.5 * WALL_M)]
        polygon = middle + shift @ np.array([along, across])
        walls.append({"id": f"{robot['id']}wall{side}", "polygon": polygon.tolist()})
    return walls


def _circle(center: list[float], radius: float) -> dict[str, Any]:
    return {"circle": {"center": center, "radius": radius}}


def _rounded(point: np.ndarray) -> list[float]:
    return [round(float(x), 2) for x in point]


if __name__ == "__main__":
    run(main)
