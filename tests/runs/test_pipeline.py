from __future__ import annotations

import json
from pathlib import Path

import jsonschema
import pytest

from mrmg.errors import ExitCode, UsageError
from mrmg.plans import Plan
from mrmg.runs import pipeline, steps
from mrmg.runs.arguments import RunArguments, VideoArguments
from mrmg.runs.folder import OUTPUTS, RunFolder, Step
from mrmg.runs.steps import taken_up
from mrmg.runs.summary_model import summary_schema
from mrmg.scene.loading import load_scene

MADE_WITHOUT_VIDEO = [step for step in Step if step is not Step.RENDER]


def written(folder: Path) -> dict[str, int]:
    """Return when each file was written."""
    return {path.name: path.stat().st_mtime_ns for path in folder.iterdir()}


def test_a_run_leaves_every_file_and_nothing_else(quickstart_run: Path) -> None:
    expected = {name for step in MADE_WITHOUT_VIDEO for name in OUTPUTS[step]}
    assert set(written(quickstart_run)) == {*expected, "run.json"}


def test_the_summary_keeps_to_its_schema(quickstart_run: Path) -> None:
    summary = json.loads((quickstart_run / "summary.json").read_text())
    jsonschema.validate(summary, summary_schema())
    assert summary["mission_ok"]
    assert summary["execution"]["goals_visited"] == summary["goals"]


def test_the_folder_holds_the_scene_it_was_made_for(quickstart_run: Path) -> None:
    scene = load_scene(quickstart_run / "scene.yaml")
    assert scene.digest == load_scene("quickstart").digest
    assert Plan.load(quickstart_run).scene_digest == scene.digest


def test_a_finished_run_is_not_made_again(own_run: Path) -> None:
    before = written(own_run)
    result = pipeline.run("quickstart", out=own_run, video=None)
    after = written(own_run)
    assert result.exit_code == ExitCode.OK
    made_again = {name for name in after if after[name] != before[name]}
    assert made_again <= {"run.json", *OUTPUTS[Step.REPORT]}


@pytest.mark.quick("log.json")
@pytest.mark.parametrize("lost", ["log.json", "audit.json", "energy.png"])
def test_only_what_is_missing_is_made(own_run: Path, lost: str) -> None:
    before = written(own_run)
    (own_run / lost).unlink()
    named = str(own_run)  # as people write it
    assert pipeline.run("quickstart", out=named, video=None).exit_code == ExitCode.OK
    after = written(own_run)
    assert lost in after
    untouched = [*OUTPUTS[Step.PLAN], *OUTPUTS[Step.VERIFY]]
    assert [after[name] for name in untouched] == [before[name] for name in untouched]


def test_who_died_while_a_plan_was_put_in_place_keeps_nothing_made_from_one(
    own_run: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nobody knows whether it was the plan that was verified and driven."""
    run = taken_up(RunFolder(own_run))

    def die(*_: object) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(steps, "write_planning", die)
        with pytest.raises(KeyboardInterrupt):
            run.make(Step.PLAN)
    run.make(Step.PLAN)
    assert set(run.folder.marks()) == {Step.PLAN}


def test_another_seed_begins_with_planning(own_run: Path) -> None:
    before = written(own_run)
    with pytest.raises(UsageError, match="overwrite=True"):
        pipeline.run("quickstart", seed=1, out=own_run, video=None)
    assert written(own_run) == before
    result = pipeline.run("quickstart", seed=1, out=own_run, video=None, overwrite=True)
    after = written(own_run)
    assert result.summary["seed"] == 1
    assert Plan.load(own_run).seed == 1
    assert all(after[name] != before[name] for name in OUTPUTS[Step.EXECUTE])


def test_another_video_begins_with_filming(own_run: Path) -> None:
    run = taken_up(RunFolder(own_run))
    other = VideoArguments(view="chase", size=(320, 240))
    arguments = RunArguments(video=other)
    changed = type(run)(scene=run.scene, arguments=arguments, folder=run.folder)
    done = {step: changed.is_done(step) for step in Step}
    assert done == {step: step in run.folder.marks() for step in Step}
    assert changed.fingerprint(Step.RENDER) != run.fingerprint(Step.RENDER)


def test_arguments_survive_the_folder() -> None:
    arguments = RunArguments(
        seed=3, budget_s=2.5, profile="paper", video=VideoArguments(size=(640, 480))
    )
    stored = json.loads(json.dumps(arguments.to_json()))
    assert RunArguments.from_json(stored) == arguments


def test_an_infeasible_mission_ends_with_its_proof_and_a_report(
    walled_scene: Path, tmp_path: Path
) -> None:
    out = tmp_path / "run"
    result = pipeline.run(walled_scene, out=out, video=None)
    assert result.exit_code == ExitCode.INFEASIBLE
    assert "g1" in result.reason
    jsonschema.validate(result.summary, summary_schema())
    assert result.summary["status"] == "infeasible"
    assert result.summary["plan"] is None
    assert "g1" in (out / "report.html").read_text()
    assert (out / "overview.png").exists()

    before = written(out)
    again = pipeline.run(walled_scene, out=out, video=None)
    assert again.exit_code == ExitCode.INFEASIBLE
    assert written(out)["planning.json"] == before["planning.json"]


def test_progress_goes_through_every_step_to_its_end(
    walled_scene: Path, tmp_path: Path
) -> None:
    output: list[tuple[Step, float]] = []
    pipeline.run(
        walled_scene,
        out=tmp_path / "run",
        video=None,
        on_progress=lambda step, fraction, text: output.append((step, fraction)),
    )
    steps = list(dict.fromkeys(step for step, _ in output))
    assert steps == [Step.PLAN, Step.DRAW, Step.REPORT]
    for step in steps:
        fractions = [fraction for name, fraction in output if name is step]
        assert fractions[0] == 0.0
        assert fractions[-1] == 1.0
        assert fractions == sorted(fractions)
