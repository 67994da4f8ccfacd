"""Plan missions in halls whose goals, docks and chargers lie beside walls.

Each hall is of 20 x 14 m with two racks and two robots that start, and must end, with
their backs to a wall; goals lie 0.15 to 0.45 m farther from a wall or a rack than half
a robot's width, so that few robots have room to turn round there. Protocol: that of
`tools/bench`, one row a hall; the same number gives the same hall.

Finished missions are kept in --output FILE: the same command goes on from there after
an interruption. Rows of --json are those of `tools/bench`.
"""

from __future__ import annotations

import argparse
from typing import Any

import bench
import numpy as np
from protocol import run, seed_range

from mrmg import shipped
from mrmg.scene.loading import scene_from_document
from mrmg.scene.loading.models import load_model
from mrmg.scene.robot_model import RobotModel
from mrmg.scene.types import Scene

SIDES_M = 20.0, 14.0
"""Sides of a hall."""

RACK_M = 1.0
"""Width of a rack."""

BESIDE_M = 0.15, 0.45
"""How much farther from walls than half a robot goals lie, least and most."""

BEHIND_M = 0.1, 0.25
"""Room behind a robot where it starts, least and most."""

DOCKS_M = 2.0, 4.5, 7.0, 9.5, 12.0
"""Places along a wall of which two are starts, and two others chargers."""

GOAL_M, FINISH_M = 0.3, 0.25
"""Radii of goals and chargers, and of finishes."""

RANGES = 2.4
"""Capacity of batteries, as a multiple of the sum of a hall's sides."""


def main() -> int:
    """Run the bench; return 1 if any mission failed."""
    options = parse_options()
    print(f"{__doc__}\n{bench.protocol(options)}")
    halls = (hall(options.model, number) for number in options.halls)
    scenes = ((scene.name, scene) for scene in halls)
    return bench.plan_each(scenes, options, "bench_docks")


def parse_options() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__, prog="tools/bench_docks")
    parser.add_argument("--model", default="diffdrive", help="default diffdrive")
    parser.add_argument(
        "--halls", type=seed_range, default="0-15", help="first-last, default 0-15"
    )
    bench.add_mission_options(parser, seeds="0-0")
    return parser.parse_args()


def hall(name: str, number: int) -> Scene:
    """Return a hall for robots of a shipped model."""
    model, _ = load_model(shipped.models_folder() / name)
    rng = np.random.default_rng(number)
    racks, goals = _racks(model, rng)
    docks = rng.permutation(DOCKS_M)[:4]
    back_m = float(-model.footprint_m[:, 0].min() + rng.uniform(*BEHIND_M))
    chargers = [(back_m + 0.1, y) for y in docks[2:]]
    document = {
        "format": 1,
        "name": f"hall{number}",
        "bounds": [0, 0, *SIDES_M],
        "obstacles": racks,
        "goals": [_place(f"g{i}", at) for i, at in enumerate(goals)],
        "stations": [
            {**_place(f"s{i}", at), "capacity": 1} for i, at in enumerate(chargers)
        ],
        "battery": {"capacity_m": RANGES * sum(SIDES_M), "reserve": 0.05},
        "robots": [
            {
                "id": f"r{i}",
                "model": name,
                "pose": [round(back_m, 2), float(y), 0],
                "finish": {**_circle((back_m, y), FINISH_M), "heading": 0},
            }
            for i, y in enumerate(docks[:2])
        ],
    }
    return scene_from_document(document, source=f"hall {number}")


def _racks(
    model: RobotModel, rng: np.random.Generator
) -> tuple[list[dict[str, Any]], list[tuple[float, float]]]:
    """Return racks, and places for goals beside them and beside walls."""
    (long_m, wide_m), goals = SIDES_M, list[tuple[float, float]]()

    def beside_m() -> float:
        return model.half_width_m + float(rng.uniform(*BESIDE_M))

    racks: list[dict[str, Any]] = []
    for i, middle in enumerate((0.3, 0.7)):
        y = middle * wide_m + float(rng.uniform(-0.5, 0.5))
        x, size_m = float(rng.uniform(7.0, 8.0)), float(rng.uniform(9.0, 11.0))
        box = {"center": [x + 0.5 * size_m, y], "size": [size_m, RACK_M]}
        racks.append({"id": f"rack{i}", "box": box, "height": 1.8})
        for side in (-1.0, 1.0):
            along = float(rng.uniform(x + 0.5, x + size_m - 0.5))
            goals.append((along, y + side * (0.5 * RACK_M + beside_m())))
    goals.append((float(rng.uniform(3.0, long_m - 1.0)), wide_m - beside_m()))
    goals.append((float(rng.uniform(3.0, long_m - 1.0)), beside_m()))
    goals.append((long_m - beside_m(), float(rng.uniform(2.0, wide_m - 2.0))))
    return racks, goals


def _circle(at: tuple[float, float], radius_m: float) -> dict[str, Any]:
    center = [round(float(one), 2) for one in at]
    return {"circle": {"center": center, "radius": radius_m}}


def _place(name: str, at: tuple[float, float]) -> dict[str, Any]:
    return {"id": name, **_circle(at, GOAL_M)}


if __name__ == "__main__":
    run(main)
