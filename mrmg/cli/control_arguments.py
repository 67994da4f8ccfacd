"""The arguments for missions that go wrong: faults, and planning anew."""

from __future__ import annotations

import argparse


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
