"""The steps of a run, from files to files: none takes results from memory."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mrmg import storage
from mrmg.errors import ExitCode, Fault, MrmgError, RunFolderError
from mrmg.plans import Plan, PlanStatus, plan_in_force
from mrmg.runs.arguments import RunArguments, recorded
from mrmg.runs.code_digest import code_digest
from mrmg.runs.drive import drive
from mrmg.runs.folder import NEEDS, RunFolder, Step, stale_after
from mrmg.scene.loading import load_scene
from mrmg.scene.loading.carrying import carried_files
from mrmg.scene.margins import STATES_NONE, margins_from
from mrmg.scene.types import Scene

if TYPE_CHECKING:
    from mrmg.energy.audit_record import EnergyAudit
    from mrmg.planning import Improvement, PlannerParams
    from mrmg.runs.capsule import Failure
    from mrmg.simulation.log import ExecutionLog

StepProgress = Callable[[Step, float, str], None]
"""Called with (step, fraction 0..1, text) while a step is under way."""

OnImprovement = Callable[["Improvement"], None]
"""Called with every plan of lower cost than all before it."""

Write = Callable[[], None]
"""Puts the outcome of a step that has been worked out into the run folder."""


@dataclass(frozen=True, kw_only=True)
class Run:
    """A run being made: the scene, the arguments, and the folder they fill."""

    scene: Scene
    arguments: RunArguments
    folder: RunFolder
    on_progress: StepProgress | None = None
    on_improvement: OnImprovement | None = None

    def ensure(self, step: Step) -> None:
        """Make `step` unless the folder already holds its outcome."""
        if not self.is_done(step):
            self.make(step)

    def is_done(self, step: Step) -> bool:
        """Return whether the folder holds the outcome of `step`."""
        return self.folder.is_done(step, self.fingerprint(step))

    def is_readable(self, step: Step) -> bool:
        """Return whether the outcome of planning or driving is there and whole."""
        if not self.is_done(step):
            return False
        try:
            if step is Step.EXECUTE:
                self.log()
            elif self.status() is PlanStatus.SOLVED:
                self.plan()
        except RunFolderError:
            return False
        return True

    def make(self, step: Step) -> None:
        """Make `step`, and remove what came of another outcome of it.

        The folder changes only once the work is done: arguments that turn out to be
        wrong, and a process that is stopped, leave what was there before. What was made
        from an equal outcome stays. Where a process died as it put an outcome in its
        place, nobody knows what later steps were made from: nothing of them stays.
        """
        self._told(step, 0.0)
        write = _WORK[step](self)
        later = stale_after(step)[1:] if step in self.folder.marks() else []
        current = [each for each in later if self.is_done(each)]
        before = self.folder.content(step)
        self.folder.begin(step, self.arguments.to_json(), keep=current)
        write()
        after = self.folder.content(step)
        if before != after:
            self.folder.drop(current)
        if step is not Step.PLAN or self.status() in _FINAL:
            self.folder.finish(step, self.fingerprint(step))
        self._told(step, 1.0)

    def fingerprint(self, step: Step) -> str:
        """Return the digest of all that decides the outcome of `step`."""
        deciding: dict[Step, Any] = {
            Step.PLAN: [self.scene.digest, *self.arguments.planning()],
            Step.EXECUTE: self.arguments.deciding("drive"),
            Step.AUDIT: self.arguments.deciding("audit"),
            Step.RENDER: asdict(self.arguments.video),
        }
        needs = [self.fingerprint(need) for need in NEEDS[step]]
        own = [str(step), deciding.get(step), needs, code_digest()]
        return storage.digest(storage.canonical_json(own))

    def planning(self) -> dict[str, Any]:
        """Return how planning ended: status, reason, statistics."""
        return self.folder.read_json("planning.json", remedy="mrmg plan --overwrite")

    def status(self) -> PlanStatus:
        """Return the status planning ended with."""
        return PlanStatus(self.planning()["status"])

    def plan(self) -> Plan:
        """Return the plan; refuse where there is none, saying how planning ended."""
        found = [file.name for file in self.folder.path.glob("plan*.json")]
        if found == ["planning.json"] and self.status() is not PlanStatus.SOLVED:
            ended = f"planning ended {self.status().value}: {self.planning()['reason']}"
            fault = Fault("planning.json", f"there is no plan; {ended}")
            raise RunFolderError(str(self.folder.path), [fault])
        return Plan.load(self.folder.path)

    def plan_in_force(self) -> Plan:
        """Return the plan that was driven, joined where the mission was replanned."""
        self.plan()
        return plan_in_force(self.folder.path)

    def log(self) -> ExecutionLog:
        """Return the log of the simulation."""
        from mrmg.simulation.log import ExecutionLog

        return ExecutionLog.load(self.folder.path)

    def account(self) -> EnergyAudit:
        """Return the audit of the folder's drive."""
        from mrmg.energy.audit import audit

        decided = self.arguments.deciding("audit")
        return audit(self.scene, self.plan_in_force(), self.log(), **decided)

    def reason(self) -> str:
        """Return why there is no plan, or why the mission failed; "" if it did not."""
        if self.status() is not PlanStatus.SOLVED or not self.folder.holds(Step.AUDIT):
            return str(self.planning()["reason"])
        verdict = self.folder.read_json("verdict.json", remedy="mrmg verify")
        account = self.folder.read_json("audit.json", remedy="mrmg audit")
        broken = [violation["message"] for violation in verdict["violations"][:1]]
        return "; ".join([*broken, *account["reasons"]])

    def summary(self) -> dict[str, Any]:
        """Return the content of `summary.json`."""
        return self.folder.read_json("summary.json", remedy="mrmg report")

    def exit_code(self) -> ExitCode:
        """Return the exit code the whole run ends with."""
        status = self.status()
        if status is not PlanStatus.SOLVED:
            return status.exit_code
        return ExitCode.OK if self.summary()["mission_ok"] else ExitCode.MISSION_FAILED

    def progress_of(self, step: Step) -> Callable[[float, str], None]:
        """Return the callback that reports the progress of one step."""
        return lambda fraction, text: self._told(step, fraction, text)

    def _told(self, step: Step, fraction: float, text: str = "") -> None:
        if self.on_progress is not None:
            self.on_progress(step, fraction, text)


def taken_up(
    folder: RunFolder, on_progress: StepProgress | None = None, trust_code: bool = False
) -> Run:
    """Return the run that `folder` holds, with the arguments it was started with."""
    return Run(
        scene=load_scene(folder.file("scene.yaml"), trust_code=trust_code),
        arguments=recorded(folder),
        folder=folder,
        on_progress=on_progress,
    )


def _plan(run: Run) -> Write:
    from mrmg.planning import plan_mission

    arguments, files = run.arguments, carried_files(run.scene)
    result = plan_mission(
        run.scene,
        seed=arguments.seed,
        params=planner_params(arguments),
        skip_unreachable=arguments.skip_unreachable,
        workers=arguments.workers,
        with_bound=True,
        on_progress=run.progress_of(Step.PLAN),
        on_improvement=run.on_improvement,
    )
    outcome = {
        "status": result.status.value,
        "reason": result.reason,
        "hints": list(result.hints),
        "statistics": dict(result.statistics),
        "skipped": dict(result.plan.skipped) if result.plan else {},
    }

    return lambda: write_planning(run.folder, files, result.plan, outcome)


def planner_params(arguments: RunArguments) -> PlannerParams:
    """Return the parameters that the arguments of a run give the planner."""
    from mrmg.planning import profile_params

    return profile_params(
        arguments.profile,
        planner=arguments.planner,
        router=arguments.router,
        budget_s=arguments.budget_s,
        trees=arguments.trees,
        soc_margin=arguments.soc_margin,
        margins=margins_from(arguments.margins or STATES_NONE),
    )


def write_planning(
    folder: RunFolder,
    files: Mapping[str, bytes],
    plan: Plan | None,
    outcome: dict[str, Any],
) -> None:
    """Write the files of the scene, the plan, and how planning ended."""
    for name, data in files.items():
        storage.write_bytes(folder.file(name), data)
    if plan is not None:
        plan.save(folder.path)
    storage.write_json(folder.file("planning.json"), outcome)


def _verify(run: Run) -> Write:
    from mrmg.verification.verify import verify

    verdict = verify(run.scene, run.plan())
    return lambda: verdict.save(run.folder.path)


def _execute(run: Run) -> Write:
    from mrmg.runs.capsule import Failure

    progress = run.progress_of(Step.EXECUTE)
    try:
        driven = drive(run.scene, run.plan(), run.arguments, progress)
    except MrmgError:
        raise
    except Exception as error:
        path = _keep(run, Failure.of_crash(error))
        error.add_note(f"{path} keeps all that is needed to make this happen again")
        raise

    def write() -> None:
        from mrmg.energy.audit_record import MODEL_MISMATCH
        from mrmg.energy.mission_failures import GOAL_SKIPPED

        driven.save(run.folder.path)
        account = run.account()
        # A drive that only took another energy has nothing to be repeated for.
        if {*account.causes} - {MODEL_MISMATCH, GOAL_SKIPPED}:
            _keep(run, Failure.of(driven.log, account.causes, account.reasons))

    return write


def _keep(run: Run, failure: Failure) -> Path:
    """Leave a capsule of an execution that failed."""
    from mrmg.runs.capsule import CAPSULE_FILE, Capsule

    path = run.folder.file(CAPSULE_FILE)
    arguments, carried = run.arguments.to_json(), carried_files(run.scene)
    Capsule.of_run(run.folder.path, arguments, failure, carried).save(path)
    return path


def _audit(run: Run) -> Write:
    account = run.account()
    return lambda: account.save(run.folder.path)


def _draw(run: Run) -> Write:
    from mrmg.viz.energy_plot import draw_energy
    from mrmg.viz.overview import draw_overview

    overview = run.folder.file("overview.png")
    if run.status() is not PlanStatus.SOLVED:
        return lambda: draw_overview(run.scene, path=overview)
    plan, log = run.plan_in_force(), run.log()

    def write() -> None:
        draw_overview(run.scene, plan, log, path=overview)
        draw_energy(run.scene, plan, log, path=run.folder.file("energy.png"))

    return write


def _render(run: Run) -> Write:
    from mrmg.viz.gif import render_gif
    from mrmg.viz.video import render_video

    plan, log = run.plan_in_force(), run.log()
    asked = asdict(run.arguments.video) | {"on_progress": run.progress_of(Step.RENDER)}
    films = {"mission.gif": render_gif} if asked.pop("gif") else {}
    films["mission.mp4"] = render_video
    for name, film in films.items():
        film(run.scene, plan, log, run.folder.unfinished(name), **asked)

    def write() -> None:
        for name in films:
            run.folder.unfinished(name).replace(run.folder.file(name))

    return write


def _report(run: Run) -> Write:
    from mrmg.report.report import write_report
    from mrmg.runs.summary import summarize

    summary = summarize(run.scene, run.folder.path)

    def write() -> None:
        storage.write_json(run.folder.file("summary.json"), summary)
        write_report(run.folder.path, trust_code=run.scene.has_custom_motion)

    return write


_FINAL = (PlanStatus.SOLVED, PlanStatus.INFEASIBLE)
"""Statuses that the same arguments would lead to again."""

_WORK: dict[Step, Callable[[Run], Write]] = {
    Step.PLAN: _plan,
    Step.VERIFY: _verify,
    Step.EXECUTE: _execute,
    Step.AUDIT: _audit,
    Step.DRAW: _draw,
    Step.RENDER: _render,
    Step.REPORT: _report,
}
