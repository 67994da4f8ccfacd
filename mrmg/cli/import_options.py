"""The arguments of `mrmg scene import`."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from mrmg.cli.run_options import reader
from mrmg.runs import argument_values as values


def add_import(acts: Any) -> argparse.ArgumentParser:
    """Add the verb `import` of `mrmg scene`; return its parser."""
    verb: argparse.ArgumentParser = acts.add_parser(
        "import",
        help="read maps and missions of other tools as a scene",
        description="Read occupancy maps of ROS and Nav2, elevation models, GeoJSON, "
        "route graphs, VDMA LIF layouts, and polygon maps as one scene. What was "
        "dropped, changed or assumed is reported, and kept as comments of the scene.",
    )
    verb.add_argument("files", type=Path, nargs="+", metavar="FILE")
    verb.add_argument("--kind", help="what the files are; default: by their content")
    verb.add_argument(
        "--unknown",
        choices=("obstacle", "free"),
        default="obstacle",
        help="what cells become that were never seen; default obstacle",
    )
    verb.add_argument(
        "--tolerance",
        type=reader(values.time),
        default=0.5,
        metavar="CELLS",
        help="how far polygons may reach beyond occupied cells; default 0.5",
    )
    for flag, metavar, what in (
        ("--keepout", "FILE", "mask (or other file) of ground that robots keep off"),
        ("--terrain-mask", "FILE", "speed or cost mask: terrain multipliers"),
        ("--land-cover", "FILE", "raster or GeoJSON of land-cover classes"),
        ("--classes", "TABLE.yaml", "lines 'class: {multiplier: M, turning: T}'"),
    ):
        verb.add_argument(flag, type=Path, metavar=metavar, help=what)
    verb.add_argument(
        "--lanes",
        type=reader(values.positive),
        metavar="WIDTH",
        help="let robots drive on the edges of graphs and layouts only, so wide [m]",
    )
    verb.add_argument("--crs", help="coordinate system of the files, or local (metres)")
    verb.add_argument(
        "--crop",
        nargs="+",
        metavar="X_MIN Y_MIN X_MAX Y_MAX",
        help="part to read, in the coordinates of the first file",
    )
    verb.add_argument(
        "--longest-side",
        type=reader(values.positive),
        default=100.0,
        metavar="METRES",
        help="scale polygon maps so that their longest side measures this; default 100",
    )
    return verb
