"""The verbs that make, judge and show a run."""

from __future__ import annotations

import argparse
import shlex
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from mrmg.cli import terminal
from mrmg.cli.run_options import given
from mrmg.counted import counted
from mrmg.errors import ExitCode
from mrmg.runs.arguments import DEFAULT_VIDEO, RunArguments, VideoArguments
from mrmg.runs.folder import RunFolder, Step, existing

if TYPE_CHECKING:
    from mrmg.runs.steps import Run
    from mrmg.scene.types import Scene


def run(options: argparse.Namespace) -> int:
    """Do the whole mission."""
    from mrmg.runs import pipeline

    scene = _scene(options)
    terminal.compile_kernels(RunArguments(**given(options)))
    with terminal.progress() as on_progress:
        result = pipeline.run(
            scene,
            out=options.out,
            overwrite=options.overwrite,
            video=None if options.no_video else DEFAULT_VIDEO,
            trust_code=options.trust_code,
            on_progress=on_progress,
            on_improvement=terminal.improvement_reporter(on_progress),
            **given(options),
        )
    lines = terminal.summary_lines(result.summary, result.reason)
    page = f"  report     {result.folder / 'report.html'}"
    terminal.print_result(options, result.summary, [*lines, page])
    return result.exit_code


def _scene(options: argparse.Namespace) -> Scene:
    """Return the scene of the command line, and warn of what it may not mean."""
    from mrmg.scene.loading import load_scene
    from mrmg.scene.loading.hints import heading_hints
    from mrmg.scene.slopes import bend_warnings

    scene = load_scene(options.scene, trust_code=options.trust_code)
    more = f"mrmg scene check {shlex.quote(options.scene)}"
    warnings = [*heading_hints(options.scene), *bend_warnings(scene)]
    terminal.print_warnings(warnings, more=more)
    return scene


def plan(options: argparse.Namespace) -> int:
    """Plan, and start a run folder."""
    from mrmg.runs.pipeline import default_folder
    from mrmg.runs.replacing import require_room
    from mrmg.runs.steps import Run

    arguments = RunArguments(**given(options))
    loaded = _scene(options)
    scene = arguments.scene(loaded)
    terminal.compile_kernels(arguments)
    folder = RunFolder(options.out or default_folder(scene, arguments.seed))
    with folder.opened_for_writing(), terminal.progress() as on_progress:
        work = Run(
            scene=scene,
            arguments=arguments,
            folder=folder,
            on_progress=on_progress,
            on_improvement=terminal.improvement_reporter(on_progress),
        )
        if not options.overwrite:
            require_room(work)
        kept = work.is_readable(Step.PLAN) and not options.overwrite
        if not kept:
            work.make(Step.PLAN)
    outcome = work.planning()
    text = f"{scene.name}: {outcome['status']}"
    text += f"; {outcome['reason']}" if outcome["reason"] else ""
    if outcome["statistics"]["improvements"]:
        text += f"\n  {terminal.quality(outcome['statistics']['improvements'][-1])}"
        if "iteration_cap" in outcome["statistics"]:
            text += f"\n  {terminal.iterations(outcome['statistics'])}"
    skipped = outcome.get("skipped", {})
    text += "".join(f"\n  left out {goal}: {why}" for goal, why in skipped.items())
    text += "".join(f"\n  hint: {hint}" for hint in outcome.get("hints", ()))
    text += f"\n  in {folder.path}"
    text += "; planned before, --overwrite plans again" if kept else ""
    terminal.print_result(options, outcome, [text])
    return ExitCode.MISSION_FAILED if skipped else work.status().exit_code


@contextmanager
def opened_run(path: Path, *, trust_code: bool) -> Iterator[Run]:
    """Take up the run of a folder, show its progress, and keep other commands out."""
    from mrmg.runs.steps import taken_up

    folder = existing(path)
    with folder.opened_for_writing(), terminal.progress() as on_progress:
        yield taken_up(folder, on_progress, trust_code=trust_code)


def verify(options: argparse.Namespace) -> int:
    """Judge the plan of a run folder."""
    work = _make(options, Step.VERIFY)
    verdict = work.folder.read_json("verdict.json", remedy="mrmg verify")
    found = [violation["message"] for violation in verdict["violations"]]
    lines = terminal.because("valid" if verdict["ok"] else "not valid", found)
    lines += [f"  {goal} is left out" for goal in verdict["skipped"]]
    terminal.print_result(options, verdict, lines)
    return ExitCode.OK if verdict["ok"] else ExitCode.MISSION_FAILED


def execute(options: argparse.Namespace) -> int:
    """Drive the plan of a run folder in MuJoCo."""
    work, note = _driven(options)
    log = work.folder.read_json("log.json", remedy="mrmg execute --overwrite")
    lost = [item for item in log["events"] if item["action"] in ("end", "give_up")]
    driven = log["completed"] and not lost
    ended = "driven to the end" if driven else "given up on the way"
    events = [f"{item['time_s']:>7.1f} s  {item['message']}" for item in log["events"]]
    reasons = _why_failed(work)
    contacts = counted(len(log["contacts"]), "contact")
    lines = [
        *terminal.because(f"{ended}, {contacts}", reasons),
        *events,
        f"  {note}",
    ]
    terminal.print_result(options, log, lines)
    done = driven and not reasons
    return ExitCode.OK if done else ExitCode.MISSION_FAILED


def _why_failed(work: Run) -> list[str]:
    """Return the rule that the plan breaks, if any, and what went wrong on the way.

    The plan as it is now is judged: a verdict may be missing, or of another plan.
    """
    from mrmg.verification.verify import verify

    violations = verify(work.scene, work.plan()).violations
    broken = [violation.message for violation in violations[:1]]
    return [*broken, *work.account().reasons]


def _driven(options: argparse.Namespace) -> tuple[Run, str]:
    """Drive as the command line wants it; return the run of it and a note on it.

    A drive other than that of the run goes to a folder of its own.
    """
    from mrmg.runs.drive import checked_drive
    from mrmg.runs.separate_drives import drive_again, drive_apart, folder_beside
    from mrmg.simulation.log import require_same_mission

    undisturbed = RunArguments().deciding("drive")
    for name in ("controller", "plant"):
        del undisturbed[name]
    kept = "driven before, --overwrite drives again"
    with opened_run(options.run, trust_code=options.trust_code) as run:
        folder = run.folder
        drive = {**undisturbed, **given(options)}
        asked = checked_drive(run.scene, replace(run.arguments, **drive))
        own = asked.deciding("drive") == run.arguments.deciding("drive")
        place = options.out or (folder.path if own else folder_beside(run, asked))
        if place.resolve() == folder.path.resolve():
            run = replace(run, arguments=asked)
            made = drive_again(run, overwrite=options.overwrite)
            return run, f"in {folder.path}" if made else f"in {folder.path}; {kept}"
        require_same_mission(run.scene, run.plan())  # before there is a folder
        with RunFolder(place).opened_for_writing() as other:
            work, made = drive_apart(run, other, asked, overwrite=options.overwrite)
    page = place / "report.html"
    return work, f"report     {page}" if made else f"report     {page}; {kept}"


def audit(options: argparse.Namespace) -> int:
    """Compare planned, metered and measured energy of a run folder."""
    work = _make(options, Step.AUDIT)
    account = work.folder.read_json("audit.json", remedy="mrmg audit")
    reasons = _why_failed(work)
    outcome = "mission failed" if reasons else "mission done"
    terminal.print_result(options, account, terminal.because(outcome, reasons))
    return ExitCode.MISSION_FAILED if reasons else ExitCode.OK


_SHOWN = ("overview.png", "energy.png", "mission.gif", "mission.mp4", "report.html")


def render(options: argparse.Namespace) -> None:
    """Make the pictures, the video and the report of a run folder."""
    work = _make(options, Step.RENDER, Step.DRAW, Step.REPORT)
    for name in _SHOWN:
        if work.folder.file(name).exists():
            print(work.folder.file(name))


def report(options: argparse.Namespace) -> int:
    """Write the summary and the report of a run folder anew."""
    work = _make(options, Step.REPORT)
    page = str(work.folder.file("report.html"))
    terminal.print_result(options, work.summary(), [page])
    return work.exit_code()


def _make(options: argparse.Namespace, *steps: Step) -> Run:
    """Make steps of a run anew, with the arguments changed that are given."""
    from mrmg.runs.drive import checked_drive

    with opened_run(options.run, trust_code=options.trust_code) as work:
        folder = work.folder
        video = replace(work.arguments.video, **given(options, VideoArguments))
        changed = replace(work.arguments, video=video, **given(options))
        work = replace(work, arguments=checked_drive(work.scene, changed))
        shown = [step for step in (Step.DRAW, Step.REPORT) if folder.holds(step)]
        for step in steps:
            work.make(step)
        for step in shown:
            if not folder.holds(step):  # made from another outcome than there is now
                work.make(step)
    return work
