"""The arguments of the verbs about scenes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from mrmg.cli import scene_commands as commands
from mrmg.runs import argument_values as values


def add_scene(verbs: Any) -> None:
    """Add the verb `scene` and its own verbs."""
    acts = verbs.add_group("scene", "make, check, draw or import scenes")
    new = acts.add_parser(
        "new", help="write a commented scene to begin with", command=commands.new
    )
    new.add_argument("name", metavar="NAME")
    new.add_out("FILE", "default NAME.yaml")
    acts.add_parser("list", help="list the shipped scenes", command=commands.list_)
    about = {
        "check": ("report every fault of a scene", commands.check),
        "draw": ("draw a scene", commands.draw),
        "roadmap": ("write the roadmap as GraphML", commands.roadmap),
    }
    for name, (what, command) in about.items():
        verb = acts.add_parser(name, help=what, command=command)
        verb.add_argument("scene", metavar="SCENE")
        verb.add_trust()
        if name == "check":
            verb.add_json("faults and warnings alone")
        elif name == "draw":
            verb.add_out("PICTURE.png", "default NAME.png")
        else:
            verb.add_value("--seed", "N", "default 0", values.seed, 0)
            verb.add_out("OUT.graphml", "default NAME.graphml")
    _add_schema(acts)
    _add_import(acts)
    _add_populate(acts)


def _add_schema(acts: Any) -> None:
    schema = acts.add_parser(
        "schema", help="print the JSON Schema of scene files", command=commands.schema
    )
    kinds = schema.add_mutually_exclusive_group()
    for kind, what in (
        ("robot", "robot.yaml"),
        ("campaign", "campaign files"),
        ("summary", "summary.json"),
    ):
        kinds.add_argument(
            f"--{kind}",
            action="store_const",
            dest="kind",
            const=kind,
            default="scene",
            help=f"print that of {what} instead",
        )


def _add_import(acts: Any) -> None:
    verb = acts.add_parser(
        "import",
        help="read maps and missions of other tools as a scene",
        description="Read occupancy maps of ROS and Nav2, elevation models, GeoJSON, "
        "route graphs, VDMA LIF layouts, and polygon maps as one scene. What was "
        "dropped, changed or assumed is reported, and kept as comments of the scene.",
        command=commands.import_,
    )
    verb.add_argument("files", type=Path, nargs="+", metavar="FILE")
    verb.add_argument("--kind", help="what the files are; default: by their content")
    verb.add_argument(
        "--unknown",
        choices=("obstacle", "free"),
        default="obstacle",
        help="what cells become that were never seen; default obstacle",
    )
    reach = "how far polygons may reach beyond occupied cells; default 0.5"
    verb.add_value("--tolerance", "CELLS", reach, values.time, 0.5)
    for flag, metavar, what in (
        ("--keepout", "FILE", "mask (or other file) of ground that robots keep off"),
        ("--terrain-mask", "FILE", "speed or cost mask: terrain multipliers"),
        ("--land-cover", "FILE", "raster or GeoJSON of land-cover classes"),
        ("--classes", "TABLE.yaml", "lines 'class: {multiplier: M, turning: T}'"),
    ):
        verb.add_argument(flag, type=Path, metavar=metavar, help=what)
    lanes = "let robots drive on the edges of graphs and layouts only, so wide [m]"
    verb.add_value("--lanes", "WIDTH", lanes, values.positive)
    verb.add_argument("--crs", help="coordinate system of the files, or local (metres)")
    verb.add_argument(
        "--crop",
        nargs="+",
        metavar="X_MIN Y_MIN X_MAX Y_MAX",
        help="part to read, in the coordinates of the first file",
    )
    verb.add_value(
        "--longest-side",
        "METRES",
        "scale polygon maps so that their longest side measures this; default 100",
        values.positive,
        100.0,
    )
    _add_out(verb)


def _add_populate(acts: Any) -> None:
    populate = acts.add_parser(
        "populate",
        help="place robots, goals and stations",
        command=commands.populate,
    )
    populate.add_argument("scene", metavar="SCENE")
    for name, count in (("robots", 2), ("goals", 14), ("stations", 5)):
        populate.add_value(f"--{name}", "N", f"default {count}", values.count, count)
    populate.add_value("--seed", "N", "default 3", values.seed, 3)
    populate.add_argument(
        "--model",
        default="car",
        help="of all robots: a shipped model, or a folder such as ./mine; default car",
    )
    _add_out(populate)
    populate.add_trust()


def _add_out(verb: Any) -> None:
    verb.add_overwrite("the file")
    verb.add_out("OUT.yaml", "file to write; without it the scene goes to stdout")
