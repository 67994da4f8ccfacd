"""Plan missions on maps that others drew; print a table, write JSONL.

Protocol: each map is scaled to a longest side of 100 m and populated once, with robots,
goals and five charging stations; what follows is that of `tools/bench`, one row a map.
The maps of the default are narrow ones.

Finished missions are kept in --output FILE: the same command goes on from there after
an interruption. Rows of --json are those of `tools/bench`, with the map's name as
`scene`.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace
from pathlib import Path

import bench
from protocol import run

from mrmg.errors import UsageError
from mrmg.scene.importing.importing import import_files
from mrmg.scene.loading import scene_from_document
from mrmg.scene.populating.populate import populate
from mrmg.scene.types import Robot, Scene

FOLDER = Path(__file__).resolve().parents[2] / "shared" / "maps"

NARROW = [
    FOLDER / name
    for name in ("complex3-big.txt", "warehouse.txt", "gaps.txt", "triangles.tri")
]


def main() -> int:
    """Run the bench; return 1 if any mission failed, 2 if a map is not there."""
    options = parse_options()
    missing = [str(path) for path in options.maps if not path.is_file()]
    if missing:
        print(f"no map {', '.join(missing)}; name others", file=sys.stderr)
        return 2
    mission = f"{options.robots} robots ({options.model}), {options.goals} goals"
    mission += f", placement {options.placement}, idle power {options.idle_power:g} W"
    mission += ", back to the start" if options.finish_at_start else ""
    print(f"{__doc__}\n{mission}\n\n{bench.protocol(options)}")
    scenes = ((str(path), populated(path, options)) for path in options.maps)
    return bench.plan_each(scenes, options, "bench_maps")


def parse_options() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__, prog="tools/bench_maps")
    parser.add_argument("maps", nargs="*", type=Path, metavar="MAP", default=NARROW)
    parser.add_argument("--robots", type=int, default=4, help="default 4")
    parser.add_argument("--goals", type=int, default=20, help="default 20")
    parser.add_argument("--model", default="car", help="of the robots, default car")
    parser.add_argument("--placement", type=int, default=3, help="its seed, default 3")
    power = {"type": float, "default": 0.0, "metavar": "W"}
    more = "of each robot, default 0; batteries hold what it takes on the way, too"
    parser.add_argument("--idle-power", **power, help=more)
    back = "have every robot end where it starts"
    parser.add_argument("--finish-at-start", action="store_true", help=back)
    bench.add_mission_options(parser, seeds="0-19")
    return parser.parse_args()


def populated(path: Path, options: argparse.Namespace) -> Scene:
    """Return the scene of a map."""
    try:
        scene = populate(
            scene_from_document(import_files([path]).document, source=str(path)),
            robots=options.robots,
            goals=options.goals,
            seed=options.placement,
            model=options.model,
        )
    except UsageError as error:
        raise UsageError(f"{path}: {error}") from error
    if options.finish_at_start:
        document = scene.document
        back = [{**robot, "finish": "start"} for robot in document["robots"]]
        scene = scene_from_document({**document, "robots": back}, source=str(path))
    robots = tuple(drawing(robot, options.idle_power) for robot in scene.robots)
    return replace(scene, robots=robots)


def drawing(robot: Robot, idle_power_W: float) -> Robot:
    """Return a robot whose own consumers draw so much."""
    model = replace(robot.model, idle_power_W=idle_power_W)
    more = 1.0 + model.consumed_per_m(model.planned_limits.v_max_m_s)
    full_J, start_J = more * robot.battery.capacity_J, more * robot.battery.start_J
    battery = replace(robot.battery, capacity_J=full_J, start_J=start_J)
    return replace(robot, model=model, battery=battery)


if __name__ == "__main__":
    run(main)
