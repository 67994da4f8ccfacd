"""The arguments of every command. Imports nothing heavy: `mrmg --help` is instant."""

from __future__ import annotations

import argparse
from pathlib import Path

from mrmg import __version__
from mrmg.cli import (
    calibrate_command,
    campaign_command,
    commands,
    completion,
    doctor_command,
    export_command,
    import_options,
    replay_command,
    robot_commands,
    robustness_commands,
    scene_commands,
    show_commands,
)
from mrmg.cli.run_options import add_options, add_overwrite, add_trust, reader
from mrmg.cli.usage import Parser
from mrmg.runs import argument_values as values
from mrmg.runs.arguments import VideoArguments

EXIT_CODES = """\
exit codes:
  0  the mission is feasible end to end       5  out of budget
  2  the command was used wrongly             6  executed, but the mission failed
  3  a scene or file is invalid               7  something on the machine is missing
  4  infeasible; the proof is named         130  stopped by Ctrl-C
"""


def make_parser() -> Parser:
    """Return the parser of the `mrmg` command."""
    parser = Parser(
        prog="mrmg",
        description="Plan missions for fleets of energy-limited cars, drive them in "
        "MuJoCo, and account for the energy.",
        epilog=EXIT_CODES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"mrmg {__version__}")
    verbs = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    _add_run(verbs)
    _add_plan(verbs)
    _add_steps(verbs)
    robustness_commands.add_robustness(verbs)
    campaign_command.add_campaign(verbs)
    replay_command.add_replay(verbs)
    _add_render(verbs)
    export_command.add_export(verbs)
    _add_compare(verbs)
    _add_figure(verbs)
    _add_view(verbs)
    _add_scene(verbs)
    robot_commands.add_robot(verbs)
    calibrate_command.add_calibrate(verbs)
    shells = verbs.add_parser("completion", help="print the completion of a shell")
    shells.add_argument("shell", choices=completion.SHELLS, metavar="bash|zsh|fish")
    shells.set_defaults(command=completion.completion)
    doctor_command.add_doctor(verbs)
    return parser


_Verbs = argparse._SubParsersAction


def _add_run(verbs: _Verbs) -> None:  # type: ignore[type-arg]
    run = verbs.add_parser("run", help="the whole mission, from scene to report")
    _add_planning(run, "run")
    run.add_argument("--no-video", action="store_true", help="leave out the video")
    run.set_defaults(command=commands.run)


def _add_plan(verbs: _Verbs) -> None:  # type: ignore[type-arg]
    plan = verbs.add_parser("plan", help="plan only")
    _add_planning(plan, "plan")
    plan.set_defaults(command=commands.plan)


def _add_planning(verb: argparse.ArgumentParser, name: str) -> None:
    verb.add_argument("scene", metavar="SCENE", help="path, or name of a shipped scene")
    verb.add_argument(
        "--out", type=Path, metavar="DIR", help="run folder; default runs/SCENE-sN"
    )
    add_overwrite(verb, "another plan, drive or video")
    add_options(verb, name)
    add_trust(verb)
    _add_json(verb, "summary.json" if name == "run" else "planning.json")


def _add_steps(verbs: _Verbs) -> None:  # type: ignore[type-arg]
    steps = {
        "verify": ("judge the plan of a run folder", commands.verify, "verdict.json"),
        "execute": ("drive the plan in MuJoCo", commands.execute, "log.json"),
        "audit": ("compare planned and driven energy", commands.audit, "audit.json"),
        "report": ("write summary and report anew", commands.report, "summary.json"),
    }
    for name, (what, command, output) in steps.items():
        verb = verbs.add_parser(name, help=what)
        verb.add_argument("run", type=Path, metavar="RUN", help="run folder")
        if name == "execute":
            verb.add_argument(
                "--out",
                type=Path,
                metavar="DIR",
                help="run folder for the drive; default RUN for the drive that RUN was "
                "started with, a folder beside it for any other",
            )
            add_overwrite(verb, "a drive")
        add_options(verb, name)
        add_trust(verb)
        _add_json(verb, output)
        verb.set_defaults(command=command)


def _add_render(verbs: _Verbs) -> None:  # type: ignore[type-arg]
    render = verbs.add_parser("render", help="make the pictures and the video")
    render.add_argument("run", type=Path, metavar="RUN", help="run folder")
    add_options(render, "render", VideoArguments)
    add_trust(render)
    render.set_defaults(command=commands.render)


def _add_compare(verbs: _Verbs) -> None:  # type: ignore[type-arg]
    compare = verbs.add_parser("compare", help="set runs side by side")
    compare.add_argument(
        "runs", type=Path, nargs="+", metavar="RUN", help="run folders, two or more"
    )
    compare.add_argument(
        "-o",
        "--out",
        type=Path,
        default=Path("compare.html"),
        metavar="PAGE.html",
        help="page with table and plots; default compare.html",
    )
    add_trust(compare)
    _add_json(compare, "the table")
    compare.set_defaults(command=show_commands.compare)


def _add_figure(verbs: _Verbs) -> None:  # type: ignore[type-arg]
    figure = verbs.add_parser("figure", help="draw a figure for a paper")
    figure.add_argument("run", type=Path, metavar="RUN", help="run folder")
    figure.add_argument(
        "--kind",
        choices=("map", "energy", "timeline"),
        default="map",
        help="default map",
    )
    figure.add_argument(
        "-o",
        "--out",
        type=Path,
        metavar="FIGURE.pdf",
        help="PDF, SVG or PNG by its suffix; default KIND.pdf",
    )
    add_trust(figure)
    figure.set_defaults(command=show_commands.figure)


def _add_view(verbs: _Verbs) -> None:  # type: ignore[type-arg]
    view = verbs.add_parser("view", help="watch a run or a scene in three dimensions")
    view.add_argument(
        "source", metavar="RUN|SCENE", help="run folder, scene file or shipped scene"
    )
    view.add_argument(
        "--in",
        dest="place",
        choices=("window", "browser"),
        help="default: window where there is a screen, else browser",
    )
    view.add_argument(
        "--host", default=show_commands.LOCAL_HOST, help="address the page is served on"
    )
    view.add_argument(
        "--port",
        type=reader(values.port),
        default=show_commands.PORT,
        help="port of the page; default 8080",
    )
    add_trust(view)
    view.set_defaults(command=show_commands.view)


def _add_scene(verbs: _Verbs) -> None:  # type: ignore[type-arg]
    scene = verbs.add_parser("scene", help="make, check, draw or import scenes")
    acts = scene.add_subparsers(title="commands", metavar="COMMAND", required=True)

    new = acts.add_parser("new", help="write a commented scene to begin with")
    new.add_argument("name", metavar="NAME")
    new.add_argument("-o", "--out", type=Path, metavar="FILE", help="default NAME.yaml")
    new.set_defaults(command=scene_commands.new)

    listed = acts.add_parser("list", help="list the shipped scenes")
    listed.set_defaults(command=scene_commands.list_)

    check = acts.add_parser("check", help="report every fault of a scene")
    check.add_argument("scene", metavar="SCENE")
    add_trust(check)
    _add_json(check, "faults and warnings")
    check.set_defaults(command=scene_commands.check)

    draw = acts.add_parser("draw", help="draw a scene")
    draw.add_argument("scene", metavar="SCENE")
    draw.add_argument(
        "-o", "--out", type=Path, metavar="PICTURE.png", help="default NAME.png"
    )
    add_trust(draw)
    draw.set_defaults(command=scene_commands.draw)

    roadmap = acts.add_parser("roadmap", help="write the roadmap as GraphML")
    roadmap.add_argument("scene", metavar="SCENE")
    roadmap.add_argument(
        "--seed", type=reader(values.seed), default=0, metavar="N", help="default 0"
    )
    roadmap.add_argument(
        "-o", "--out", type=Path, metavar="OUT.graphml", help="default NAME.graphml"
    )
    add_trust(roadmap)
    roadmap.set_defaults(command=scene_commands.roadmap)

    schema = acts.add_parser("schema", help="print the JSON Schema of scene files")
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
    schema.set_defaults(command=scene_commands.schema)

    imported = import_options.add_import(acts)
    _add_scene_out(imported)
    imported.set_defaults(command=scene_commands.import_)

    _add_populate(acts)


def _add_populate(acts: _Verbs) -> None:  # type: ignore[type-arg]
    populate = acts.add_parser("populate", help="place robots, goals and stations")
    populate.add_argument("scene", metavar="SCENE")
    for name, count in (("robots", 2), ("goals", 14), ("stations", 5)):
        populate.add_argument(
            f"--{name}",
            type=reader(values.count),
            default=count,
            metavar="N",
            help=f"default {count}",
        )
    populate.add_argument(
        "--seed", type=reader(values.seed), default=3, metavar="N", help="default 3"
    )
    populate.add_argument(
        "--model",
        default="car",
        help="of all robots: a shipped model, or a folder such as ./mine; default car",
    )
    _add_scene_out(populate)
    add_trust(populate)
    populate.set_defaults(command=scene_commands.populate)


def _add_scene_out(verb: argparse.ArgumentParser) -> None:
    add_overwrite(verb, "the file")
    verb.add_argument(
        "-o",
        "--out",
        type=Path,
        metavar="OUT.yaml",
        help="file to write; without it the scene goes to stdout",
    )


def _add_json(verb: argparse.ArgumentParser, what: str) -> None:
    verb.add_argument("--json", action="store_true", help=f"print {what} alone")
