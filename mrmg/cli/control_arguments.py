"""The arguments that say how a plan is driven: by whom, and what if it goes wrong."""

from __future__ import annotations

import argparse


def add_controller(verb: argparse.ArgumentParser, *, default: str) -> None:
    """Add the argument that names the tracking controller; `default` is told only."""
    verb.add_argument(
        "--controller", metavar="NAME", help=f"tracking controller; default {default}"
    )


def add_faults(verb: argparse.ArgumentParser) -> None:
    """Add the argument that lets robots break down."""
    verb.add_argument(
        "--fault",
        action="append",
        default=[],
        metavar="ROBOT@TIME",
        help="let a robot break down on the way, such as r2@40s; may be repeated",
    )


def add_replanning(verb: argparse.ArgumentParser) -> None:
    """Add the argument that lets the mission be planned anew."""
    verb.add_argument(
        "--replan",
        action="store_true",
        help="when a robot breaks down, or energy or tracking leave their corridor, "
        "stop the fleet and plan the rest of the mission anew",
    )
