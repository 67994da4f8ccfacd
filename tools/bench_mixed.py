"""Plan missions that want many things at once, on maps that others drew.

Each is drawn by its number: map, model, 2 to 7 robots, 3 to 17 goals; and by turns a
fleet of several models, finishes at home or where another robot starts, most of them
with headings, goals with headings, stays, stations for one robot, and the makespan as
objective. Numbers whose map is too narrow for their robots are left out, and named.
Protocol: that of `tools/bench`, one row a mission.

Finished missions are kept in --output FILE: the same command goes on from there after
an interruption. Rows of --json are those of `tools/bench`.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from math import pi
from pathlib import Path
from typing import Any

import bench
import numpy as np
from protocol import run, seed_range

from mrmg.errors import UsageError
from mrmg.scene.importing.importing import import_files
from mrmg.scene.loading import scene_from_document
from mrmg.scene.populating.populate import populate
from mrmg.scene.types import Scene

FOLDER = Path(__file__).resolve().parents[2] / "shared" / "maps"

MODELS = "car", "diffdrive", "husky", "hauler"
"""Of the fleets, and of the robots in fleets of several models all but the last."""

FINISH_M = 0.5
"""Radius of finishes."""

TOLERANCES = 0.1, 0.2, 0.3
"""Of headings [rad]."""


def main() -> int:
    """Run the bench; return 1 if any mission failed, 2 if there are no maps."""
    options = parse_options()
    if not options.maps:
        print(f"no maps in {FOLDER}; name some", file=sys.stderr)
        return 2
    print(f"{__doc__}\n{bench.protocol(options)}")
    return bench.plan_each(scenes(options), options, "bench_mixed")


def parse_options() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__, prog="tools/bench_mixed")
    maps = sorted(path for kind in ("*.txt", "*.tri") for path in FOLDER.glob(kind))
    parser.add_argument("maps", nargs="*", type=Path, metavar="MAP", default=maps)
    parser.add_argument(
        "--missions", type=seed_range, default="0-60", help="first-last, default 0-60"
    )
    bench.add_mission_options(parser, seeds="0-0")
    return parser.parse_args()


def scenes(options: argparse.Namespace) -> Iterator[tuple[str, Scene]]:
    """Yield the missions, each with its name."""
    for number in options.missions:
        try:
            scene = mission(number, sorted(options.maps))
        except UsageError as error:
            print(f"mission {number} is left out: {error}", file=sys.stderr)
            continue
        yield scene.name, scene


def mission(number: int, maps: list[Path]) -> Scene:
    """Return a mission on one of some maps; the same number gives the same mission.

    Raises:
        UsageError: if the map is too narrow for its robots.
    """
    rng = np.random.default_rng(number + 10**6)
    path = maps[int(rng.integers(len(maps)))]
    scene = populate(
        scene_from_document(import_files([path]).document, source=path.name),
        model=MODELS[int(rng.integers(len(MODELS)))],
        robots=int(rng.integers(2, 8)),
        goals=int(rng.integers(3, 18)),
        seed=number,
    )
    document = scene.document
    add_wants(document, rng)
    document["name"] = f"mission{number}"
    return scene_from_document(document, source=f"mission {number} on {path.name}")


def add_wants(document: dict[str, Any], rng: np.random.Generator) -> None:
    """Draw what a mission of robots and goals wants besides."""
    robots, goals = document["robots"], document["goals"]

    def tolerance() -> float:
        return float(rng.choice(TOLERANCES))

    if rng.random() < 0.3:
        for robot in robots:
            if rng.random() < 0.5:
                robot["model"] = MODELS[int(rng.integers(len(MODELS) - 1))]
    if rng.random() < 0.6:
        for robot in robots:
            if rng.random() < 0.7:
                robot["finish"] = _finish(robot["pose"])
                if rng.random() < 0.7:
                    robot["finish"]["heading"] = robot["pose"][2]
                    robot["finish"]["heading_tolerance"] = tolerance()
    elif rng.random() < 0.5:
        for robot, other in zip(robots, robots[1:] + robots[:1], strict=True):
            robot["finish"] = _finish(other["pose"])
    if rng.random() < 0.5:
        for goal in goals:
            if rng.random() < 0.35:
                goal["heading"] = float(rng.uniform(-pi, pi))
                goal["heading_tolerance"] = tolerance()
    if rng.random() < 0.4:
        for goal in goals:
            if rng.random() < 0.3:
                goal["dwell"] = float(rng.uniform(2.0, 20.0))
    if rng.random() < 0.4:
        for station in document["stations"]:
            station["capacity"] = 1
    if rng.random() < 0.15:
        document["objective"] = "makespan"


def _finish(pose: list[float]) -> dict[str, Any]:
    return {"circle": {"center": pose[:2], "radius": FINISH_M}}


if __name__ == "__main__":
    run(main)
