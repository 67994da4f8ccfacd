"""The verb that makes a failed execution fail again."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from contextlib import redirect_stdout
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mrmg.cli import show_commands, terminal
from mrmg.cli.commands import opened_run
from mrmg.errors import ExitCode
from mrmg.runs.folder import Step

if TYPE_CHECKING:
    from mrmg.runs.reproduction import Reproduction


def add_replay(verbs: Any) -> None:
    """Add the verb `replay`."""
    verb = verbs.add_parser(
        "replay",
        help="repeat a failed execution from its capsule",
        description="Repeat the execution of a capsule, which every failed execution "
        "leaves as capsule.zip in its run folder, and report whether it fails again in "
        "the same way. Exit code 0 if it does, 6 if not.",
        command=replay,
    )
    verb.add_argument("capsule", type=Path, metavar="CAPSULE", help="capsule.zip")
    place = "run folder for what is repeated; default 'replay' beside the capsule"
    verb.add_out("DIR", place, short=False)
    verb.add_overwrite("another run")
    verb.add_flag("--render", "make the video, too")
    verb.add_flag("--view", "watch it in three dimensions")
    verb.add_trust()
    verb.add_json("the outcome as JSON")
    verb.set_defaults(
        place=None, host=show_commands.LOCAL_HOST, port=show_commands.PORT
    )


def replay(options: argparse.Namespace) -> int:
    """Repeat a failed execution, and compare."""
    from mrmg.runs.reproduction import reproduce

    out = options.out or options.capsule.parent / "replay"
    with terminal.progress() as on_progress:
        outcome = reproduce(
            options.capsule,
            out,
            on_progress,
            overwrite=options.overwrite,
            trust_code=options.trust_code,
        )
    terminal.print_result(options, outcome.to_json(), _lines(outcome, out))
    with redirect_stdout(sys.stderr if options.json else sys.stdout):
        if options.render:
            _render(out, options.trust_code)
        if options.view:
            options.source = str(out)
            show_commands.view(options)
    return ExitCode.OK if outcome.same_causes else ExitCode.MISSION_FAILED


def _render(folder: Path, trust_code: bool) -> None:
    with opened_run(folder, trust_code=trust_code) as run:
        run.make(Step.RENDER)
    print(folder / "mission.mp4")


def _lines(outcome: Reproduction, folder: Path) -> Iterator[str]:
    yield f"{outcome.verdict()}; {folder}"
    for reason in outcome.before.reasons:
        yield f"  then  {reason}"
    for reason in outcome.after.reasons if outcome.after else ():
        yield f"  now   {reason}"
    for name, (then, now) in outcome.changed_versions.items():
        yield f"  {name} {then} then, {now} now"
