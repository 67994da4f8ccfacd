"""The whole mission: plan, verify, execute, audit, show."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

from mrmg.errors import ExitCode, UsageError, require_types
from mrmg.plans import PlanStatus
from mrmg.runs.arguments import (
    DEFAULT_VIDEO,
    RunArguments,
    VideoArguments,
    keyword,
    recorded,
)
from mrmg.runs.drive import checked_drive
from mrmg.runs.folder import RunFolder, Step
from mrmg.runs.options import documented
from mrmg.runs.replacing import require_room
from mrmg.runs.steps import OnImprovement, Run, StepProgress
from mrmg.scene.driven_parts import require_drivable
from mrmg.scene.loading import load_scene
from mrmg.scene.loading.reading import require_faithful
from mrmg.scene.types import Scene


@dataclass(frozen=True, slots=True, kw_only=True)
class RunResult:
    """How a run ended.

    Attributes:
        folder: where everything lies.
        summary: content of `summary.json`.
        reason: why there is no plan, or why the mission failed; "" if it did not.
        exit_code: what the command line would end with.
    """

    folder: Path
    summary: dict[str, Any]
    reason: str
    exit_code: ExitCode


@documented(RunArguments)
def run(
    source: str | Path | Scene,
    *,
    out: str | Path | None = None,
    overwrite: bool = False,
    video: VideoArguments | None = DEFAULT_VIDEO,
    trust_code: bool = False,
    on_progress: StepProgress | None = None,
    on_improvement: OnImprovement | None = None,
    **arguments: Any,
) -> RunResult:
    """Do the whole mission and leave a run folder; take up a run that was stopped.

    Args:
        source: a scene, the path of a scene file, or the name of a shipped scene.
        out: the run folder; `default_folder` if None.
        overwrite: replace results that the folder holds of another scene, of other
            arguments or of another version; refused if not.
        video: how the video is made; None for no video.
        trust_code: whether robot models may bring Python code (`scene.loading.trust`).
        on_progress: called with (step, fraction, text).
        on_improvement: called with every plan of lower cost than all before it.
        **arguments: fields of `RunArguments`, which are the options of `mrmg run`:

    Raises:
        MrmgError: for everything that keeps the run from starting. A mission that
            cannot be planned, or fails, is a result and not an error.
    """
    loaded = source
    if not isinstance(loaded, Scene):
        loaded = load_scene(loaded, trust_code=trust_code)
    require_drivable(loaded.robots)
    require_types((video or DEFAULT_VIDEO, VideoArguments))
    asked = _arguments(loaded, {**arguments, "video": video or DEFAULT_VIDEO})
    scene = asked.scene(loaded)
    require_faithful(scene, scene.document)  # before there is a folder
    folder = RunFolder(Path(out or default_folder(scene, asked.seed)))
    with folder.opened_for_writing():
        work = Run(
            scene=scene,
            arguments=asked,
            folder=folder,
            on_progress=on_progress,
            on_improvement=on_improvement,
        )
        if not overwrite:
            require_room(work)
        if video == DEFAULT_VIDEO and folder.holds(Step.RENDER):
            kept = replace(asked, video=recorded(folder).video)
            if replace(work, arguments=kept).is_done(Step.RENDER):
                work = replace(work, arguments=kept)  # `mrmg render` made it
        _make_steps(work, with_video=video is not None)
        return RunResult(
            folder=folder.path,
            summary=work.summary(),
            reason=work.reason(),
            exit_code=work.exit_code(),
        )


def _make_steps(work: Run, *, with_video: bool) -> None:
    """Make what is missing of a run; the report always."""
    from mrmg.viz.gl_backend import choose_backend

    if with_video and not work.is_done(Step.RENDER):
        choose_backend()  # better found now than after minutes of driving
    work.ensure(Step.PLAN)
    if work.status() is PlanStatus.SOLVED:
        work.ensure(Step.VERIFY)
        work.ensure(Step.EXECUTE)
        work.ensure(Step.AUDIT)
        if with_video:
            work.ensure(Step.RENDER)
    work.ensure(Step.DRAW)
    work.make(Step.REPORT)


def _arguments(scene: Scene, given: dict[str, Any]) -> RunArguments:
    """Return the arguments of a run, refused before any work if they are wrong."""
    named = {keyword(name): value for name, value in given.items()}
    known = [each.name for each in fields(RunArguments)]
    for name in named:
        if name not in known:
            allowed = ", ".join(known)
            raise TypeError(f"run() takes no argument {name!r}; allowed: {allowed}")
    asked = RunArguments(**named)
    asked.require_names()
    return checked_drive(scene, asked)


def rehearse(scene: Scene) -> list[str]:
    """Refuse, before any planning, what `run` would refuse of a scene that was loaded.

    Returns:
        Why robots of it can be planned for, but not driven.

    Raises:
        FileError: if it has no robots, its robots' own motions cannot be used, or
            MuJoCo cannot hold it.
    """
    from mrmg.planning.feasibility import require_robots
    from mrmg.planning.roadmap.fleet import motion_addresses

    require_robots(scene)
    for robot in scene.robots:
        motion_addresses(robot.model)
    try:
        require_drivable(scene.robots)
    except UsageError as error:
        return [str(error)]
    from mrmg.simulation.world_model import build_world

    build_world(scene, drawn=False)
    return []


def default_folder(scene: Scene, seed: int) -> Path:
    """Return the run folder used when none is named."""
    return Path("runs") / f"{scene.name}-s{seed}"
