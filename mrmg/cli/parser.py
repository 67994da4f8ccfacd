"""The arguments of every command. Imports nothing heavy: `mrmg --help` is instant."""

from __future__ import annotations

import argparse
from typing import Any

from mrmg import __version__
from mrmg.cli import (
    calibrate_command,
    campaign_command,
    commands,
    completion,
    doctor_command,
    export_command,
    replay_command,
    robot_commands,
    robustness_commands,
    scene_options,
    show_commands,
)
from mrmg.cli.run_options import add_options
from mrmg.cli.usage import Parser
from mrmg.runs.arguments import VideoArguments

EXIT_CODES = """\
exit codes:
    0  the mission is feasible end to end
    2  the command was used wrongly
    3  a scene or file is invalid
    4  infeasible; the proof is named
    5  no plan, and no proof that there is none
    6  executed, but the mission failed; or the plan breaks a rule
    7  something on the machine is missing
  130  stopped by Ctrl-C
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
    verbs = parser.add_verbs()
    _add_run_verbs(verbs)
    robustness_commands.add_robustness(verbs)
    campaign_command.add_campaign(verbs)
    replay_command.add_replay(verbs)
    render = verbs.add_parser(
        "render", help="make the pictures and the video", command=commands.render
    )
    render.add_run()
    add_options(render, "render", VideoArguments)
    render.add_trust()
    export_command.add_export(verbs)
    show_commands.add_show(verbs)
    scene_options.add_scene(verbs)
    robot_commands.add_robot(verbs)
    calibrate_command.add_calibrate(verbs)
    shells = verbs.add_parser(
        "completion",
        help="print the completion of a shell",
        command=completion.completion,
    )
    shells.add_argument("shell", choices=completion.SHELLS, metavar="bash|zsh|fish")
    doctor_command.add_doctor(verbs)
    return parser


def _add_run_verbs(verbs: Any) -> None:
    """Add the verbs that make a run, and those that make a step of one anew."""
    steps = {
        "run": ("the whole mission, from scene to report", commands.run, "summary"),
        "plan": ("plan only", commands.plan, "planning"),
        "verify": ("judge the plan of a run folder", commands.verify, "verdict"),
        "execute": ("drive the plan in MuJoCo", commands.execute, "log"),
        "audit": ("compare planned and driven energy", commands.audit, "audit"),
        "report": ("write summary and report anew", commands.report, "summary"),
    }
    for name, (what, command, output) in steps.items():
        verb = verbs.add_parser(name, help=what, command=command)
        if name in ("run", "plan"):
            verb.add_argument(
                "scene", metavar="SCENE", help="path, or name of a shipped scene"
            )
            verb.add_out("DIR", "run folder; default runs/SCENE-sN", short=False)
            verb.add_overwrite("another plan, drive or video")
        else:
            verb.add_run()
        if name == "execute":
            verb.add_out(
                "DIR",
                "run folder for the drive; default RUN for the drive that RUN was "
                "started with, a folder beside it for any other",
                short=False,
            )
            verb.add_overwrite("a drive")
        add_options(verb, name)
        verb.add_trust()
        verb.add_json(f"{output}.json alone")
        if name == "run":
            verb.add_flag("--no-video", "leave out the video")
