"""The verbs about robot models: check and show one, begin one, list shipped ones."""

from __future__ import annotations

import argparse
import shlex
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any

from mrmg.cli import terminal
from mrmg.errors import MachineError, SceneError, UsageError


def add_robot(verbs: Any) -> None:
    """Add the verb `robot`."""
    acts = verbs.add_group("robot", "check, make, import or list robot models")
    check = acts.add_parser(
        "check",
        help="compare a model's robot.yaml with its MJCF, and show the robot",
        description="Report every fault of a robot model, differences between its "
        "robot.yaml and its MJCF included, or else print its figures and draw it. "
        "Exit code 0 if it is valid, 3 if not.",
        command=check_robot,
    )
    place = "a model's folder, or the name of a shipped model"
    check.add_argument("model", metavar="FOLDER", help=place)
    check.add_out("PICTURE.png", "default NAME.png")
    check.add_trust()
    check.add_json("faults and figures alone")

    new = acts.add_parser(
        "new", help="begin a robot model of your own", command=new_robot
    )
    new.add_argument("name", metavar="NAME", help="of the model, and of its folder")
    new.add_value("--like", "MODEL", "shipped model; default car", str, "car")

    _add_import(acts)
    listed = acts.add_parser(
        "list", help="list the shipped robot models", command=list_robots
    )
    listed.add_json("their figures as JSON")


def _add_import(acts: Any) -> None:
    imported = acts.add_parser(
        "import",
        help="make a model of a robot description: URDF, xacro or MJCF",
        description="Write a model's folder with every parameter that the description "
        "states, and report those that it does not. No code of the file is run: "
        "expressions of xacro that could run some are refused.",
        command=import_robot,
    )
    imported.add_argument("file", type=Path, metavar="FILE.urdf|FILE.xacro|FILE.xml")
    imported.add_out("FOLDER", "default models/NAME")
    for flag, what in (("--drive", "turn the driven wheels"), ("--steer", "steer")):
        imported.add_argument(
            flag,
            nargs=2,
            default=(),
            metavar=("LEFT", "RIGHT"),
            help=f"joints that {what}; default: found by axis and place",
        )
    imported.add_argument(
        "--arg",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="argument of a xacro file; may be repeated",
    )


def check_robot(options: argparse.Namespace) -> None:
    """Report the faults of a robot model, or show it."""
    from mrmg.cli.calibrate_command import folder_of_model
    from mrmg.scene.loading.models import load_model
    from mrmg.scene.robot_figures import figure_lines, robot_figures

    folder = folder_of_model(options.model)
    try:
        model, _ = load_model(folder, trust_code=options.trust_code)
        if model.has_custom_motion:
            from mrmg.planning.roadmap.fleet import motion_addresses

            motion_addresses(model)
    except SceneError as error:
        if options.json:
            faults = [asdict(fault) for fault in error.faults]
            terminal.print_json({"model": folder.name, "ok": False, "faults": faults})
        raise
    picture = _draw(model, options.out)
    found = {"model": model.name, "ok": True, "faults": []}
    found |= {"figures": robot_figures(model), "picture": picture}
    lines = [f"{model.name}: valid", *(f"  {line}" for line in figure_lines(model))]
    terminal.print_result(options, found, [*lines, *([picture] if picture else [])])


def _draw(model: Any, out: Path | None) -> str | None:
    """Draw a robot; a machine that cannot fails only if the picture was asked for."""
    from mrmg.viz.robot_drawing import draw_robot

    picture = out or Path(f"{model.name}.png")
    try:
        draw_robot(model, picture)
    except MachineError as error:
        if out is not None:
            raise
        print(f"mrmg: no picture: {error}", file=sys.stderr)
        return None
    return str(picture)


def new_robot(options: argparse.Namespace) -> None:
    """Begin a robot model of the user's own."""
    from mrmg.scene.new_robot import new_robot as written

    folder = Path(options.name)
    for file in written(folder, like=options.like):
        print(file)
    _print_next(folder, "next, after changing both files")


def import_robot(options: argparse.Namespace) -> None:
    """Make a robot model of a description of another tool."""
    from mrmg.scene.importing.robots.importing import import_robot as imported

    given = [item.replace(":=", "=").partition("=") for item in options.arg]
    arguments = {name: value for name, sign, value in given if name and sign}
    if len(arguments) < len(given):
        message = f"--arg: got {options.arg}; expected NAME=VALUE, each name once"
        raise UsageError(message)
    folder = options.out or Path("models") / options.file.name.partition(".")[0]
    found = imported(
        options.file,
        folder,
        drive=options.drive,
        steer=options.steer,
        arguments=arguments,
    )
    for file in found.files:
        print(file)
    for note in found.notes:
        print(f"note: {note}")
    print(f"read: {', '.join(found.read)}")
    print("not in the file, and assumed (marked in robot.yaml):")
    for line in found.assumed:
        print(f"  {line}")
    _print_next(folder, "next")


def _print_next(folder: Path, when: str) -> None:
    """Print what may be done with the folder of a new model."""
    name = shlex.quote(str(folder))
    reference = str(folder) if folder.is_absolute() else f"./{folder}"
    print(f"{when}:\n  mrmg robot check {name}\n  mrmg calibrate {name}")
    print(f"in a scene: {{id: r1, model: {reference}, pose: [5, 5, 0]}}")


def list_robots(options: argparse.Namespace) -> None:
    """List the shipped robot models with their figures."""
    from mrmg import shipped
    from mrmg.scene.loading.models import load_model
    from mrmg.scene.robot_figures import robot_figures

    found = {}
    for name in shipped.model_names():
        model, _ = load_model(shipped.models_folder() / name)
        found[name] = robot_figures(model)
    heads = ("model", "motion", "size [m]", "mass", "top speed", "plain", "range")
    rows = [
        (
            name,
            each["motion_model"],
            f"{each['length_m']:g} x {each['width_m']:g}",
            f"{each['mass_kg']:g} kg",
            f"{each['v_max_m_s']:g} m/s",
            f"{each['plain_ground_J_per_m']:.0f} J/m",
            f"{each['battery_range_m']:.0f} m",
        )
        for name, each in found.items()
    ]
    lines = [
        f"{first:<12}{second:<10}" + "".join(f"{cell:>13}" for cell in others)
        for first, second, *others in (heads, *rows)
    ]
    terminal.print_result(options, found, lines)
