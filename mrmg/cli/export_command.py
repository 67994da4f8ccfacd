"""The verb that writes a run in the formats of other tools."""

from __future__ import annotations

import argparse
from typing import Any

from mrmg.cli import terminal
from mrmg.export.table import format_names


def add_export(verbs: Any) -> None:
    """Add the verb `export`."""
    verb = verbs.add_parser(
        "export",
        help="write the drive or the plan for other tools",
        description="Write the drive of a run, or its plan where nothing was driven: "
        "as ROS 2 messages (mcap), orders and states of VDA 5050, GeoJSON or a table. "
        "All are in metres of the scene, GeoJSON too (it states the crs 'local'), as "
        "scenes have no longitude and latitude.",
        command=export,
    )
    verb.add_run()
    verb.add_argument(
        "--format", required=True, choices=format_names(), help="what to write"
    )
    verb.add_out("PATH", "folder, or the file by its suffix; default RUN/export")
    standard = "of the format's standard: 2.1.0 or 3.0.0 of vda5050; default all"
    verb.add_value("--version", "X.Y.Z", standard)
    verb.add_overwrite("an export")
    verb.add_trust()
    verb.add_json("the names of the files as JSON")


def export(options: argparse.Namespace) -> None:
    """Write a run in a format of other tools."""
    from mrmg.export.exporting import export_run

    files = export_run(
        options.run,
        options.format,
        out=options.out,
        version=options.version,
        overwrite=options.overwrite,
        trust_code=options.trust_code,
    )
    names = [str(path) for path in files]
    terminal.print_result(options, names, names)
