"""The whole mission: plan, verify, execute, audit, show."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mrmg.errors import ExitCode
from mrmg.mission import PlanStatus
from mrmg.run_arguments import DEFAULT_VIDEO, RunArguments, VideoArguments
from mrmg.run_folder import RunFolder, Step
from mrmg.scene.loading import load_scene
from mrmg.scene.types import Scene
from mrmg.steps import (
    OnImprovement,
    Run,
    StepProgress,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class RunResult:
    """How a run ended.

    Attributes:
        folder: where everything lies.
        summary: content of `summary.json`.
        reason: one sentence where planning ended without a plan.
        exit_code: what the command line would end with.
    """

    folder: Path
    summary: dict[str, Any]
    reason: str
    exit_code: ExitCode


def run(
    source: str | Path | Scene,
    *,
    seed: int = 0,
    out: Path | None = None,
    budget_s: float | None = None,
    trees: int | None = None,
    spare: float | None = None,
    workers: int = 1,
    profile: str = "default",
    controller: str = "mpc",
    disturb: str | None = None,
    disturb_seed: int = 0,
    replan: bool = False,
    faults: Sequence[str] = (),
    video: VideoArguments | None = DEFAULT_VIDEO,
    on_progress: StepProgress | None = None,
    on_improvement: OnImprovement | None = None,
) -> RunResult:
    """Do the whole mission and leave a run folder; take up a run that was stopped.

    Args:
        source: a scene, the path of a scene file, or the name of a shipped scene.
        seed: of all random streams.
        out: the run folder; `default_folder` if None.
        budget_s: wall-clock limit of planning; None for none.
        trees: number of motion trees to grow; None for the profile's.
        spare: share of every battery's capacity that plans leave above the reserve
            where they can, for robots that take more than modelled; None for the
            profile's.
        workers: threads that grow them.
        profile: "default" or "paper".
        controller: name of the tracking controller.
        disturb: disturbances to drive under, as `execution.disturbance_spec` reads
            them; "" for the default ones, None for none.
        disturb_seed: of what is drawn from them.
        replan: whether to plan anew where the mission leaves its plan.
        faults: robots that break down on the way, such as `r2@40s`.
        video: how the video is made; None for no video.
        on_progress: told (step, fraction, text).
        on_improvement: told of every plan that is cheaper than all before it.

    Raises:
        MrmgError: for everything that keeps the run from starting. A mission that
            cannot be planned, or fails, is a result and not an error.
    """
    from mrmg.execution.disturbance_spec import written_out
    from mrmg.mission_control.faults import checked_faults
    from mrmg.results.gl_backend import choose_backend

    scene = source if isinstance(source, Scene) else load_scene(source)
    arguments = RunArguments(
        seed=seed,
        profile=profile,
        budget_s=budget_s,
        trees=trees,
        spare=spare,
        workers=workers,
        controller=controller,
        disturb=None if disturb is None else written_out(disturb),
        disturb_seed=disturb_seed,
        replan=replan,
        faults=tuple(str(fault) for fault in checked_faults(scene, tuple(faults))),
        video=video or DEFAULT_VIDEO,
    )
    folder = RunFolder(out or default_folder(scene, seed))
    with folder.opened_for_writing():
        work = Run(
            scene=scene,
            arguments=arguments,
            folder=folder,
            on_progress=on_progress,
            on_improvement=on_improvement,
        )
        if video is not None and not work.is_done(Step.RENDER):
            choose_backend()  # better told now than after minutes of driving
        work.ensure(Step.PLAN)
        if work.status() is PlanStatus.SOLVED:
            work.ensure(Step.VERIFY)
            work.ensure(Step.EXECUTE)
            work.ensure(Step.AUDIT)
            if video is not None:
                work.ensure(Step.RENDER)
        work.ensure(Step.DRAW)
        work.make(Step.REPORT)
        return RunResult(
            folder=folder.path,
            summary=work.summary(),
            reason=work.planning()["reason"],
            exit_code=work.exit_code(),
        )


def default_folder(scene: Scene, seed: int) -> Path:
    """Return the run folder used when none is named."""
    return Path("runs") / f"{scene.name}-s{seed}"
