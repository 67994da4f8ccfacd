"""Code of downloaded models runs only when asked; models name files of their own."""

from __future__ import annotations

import argparse
import os
import py_compile
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
import yaml

import mrmg
from mrmg import shipped
from mrmg.cli.main import main
from mrmg.cli.parser import make_parser
from mrmg.errors import ExitCode, SceneError
from mrmg.motion.user_motion import user_motion
from mrmg.runs.arguments import RunArguments
from mrmg.runs.capsule import Capsule, Failure
from mrmg.scene.loading import load_scene
from mrmg.scene.loading.carrying import carried_files
from mrmg.scene.loading.models import load_model

SLIDER = (Path(__file__).parents[3] / "tools" / "first_order.py").read_text()
LOADING = {"SCENE", "RUN", "RUN|SCENE", "CAPSULE", "MODEL", "FOLDER"}
"""What verbs call the things that robot models are loaded with."""


def verbs(parser: argparse.ArgumentParser) -> Iterator[argparse.ArgumentParser]:
    """Yield the parser of every verb."""
    nested = [
        action.choices.values()
        for action in parser._actions
        if isinstance(action, argparse._SubParsersAction)
    ]
    if not nested:
        yield parser
    for choices in nested:
        for inner in choices:
            yield from verbs(inner)


def positionals(verb: argparse.ArgumentParser) -> list[argparse.Action]:
    return [action for action in verb._actions if not action.option_strings]


LOADERS = {
    verb.prog.removeprefix("mrmg "): verb
    for verb in verbs(make_parser())
    if any(action.metavar in LOADING for action in positionals(verb))
}


class Foreign:
    """A downloaded scene, its model, a run folder and a capsule of it."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.marker = folder, folder / "marker"
        self.model = folder / "slider"
        self.model.mkdir()
        raw = yaml.safe_load((shipped.models_folder() / "car/robot.yaml").read_text())
        del raw["mjcf"]
        raw["motion_model"] = "motion.py"
        raw["limits"] |= {"u1_max": 2.0, "u2_max": 2.0}  # its controls are speeds
        (self.model / "robot.yaml").write_text(yaml.safe_dump(raw))
        touch = f"open({str(self.marker)!r}, 'a').close()\n"
        (self.model / "motion.py").write_text(SLIDER + touch)
        self.scene = folder / "scene.yaml"
        document = {
            "format": 1,
            "bounds": [0, 0, 30, 20],
            "goals": [{"id": "g1", "circle": {"center": [20, 10], "radius": 2}}],
            "robots": [{"id": "r1", "model": "./slider", "pose": [5, 10, 0]}],
        }
        self.scene.write_text(yaml.safe_dump(document))

    def plan(self) -> int:
        self.run = self.folder / "run"
        return main(["plan", str(self.scene), "--out", str(self.run), "--trust-code"])

    def arguments_of(self, verb: argparse.ArgumentParser) -> list[str]:
        """Return arguments with which a verb loads the model."""
        things = {
            "SCENE": [self.scene],
            "RUN": [self.run],
            "RUN|SCENE": [self.run],
            "CAPSULE": [self.folder / "capsule.zip"],
            "MODEL": [self.model],
            "FOLDER": [self.model],
        }
        words = verb.prog.split()[1:]
        for action in positionals(verb):
            found = things.get(str(action.metavar), [])
            if action.nargs == "+":
                found = [*found, shutil.copytree(self.run, self.folder / "other")]
            words += map(str, found)
        for action in verb._actions:
            if action.required and action.option_strings:
                words += [action.option_strings[0], next(iter(action.choices or ()))]
        return words


@pytest.fixture(scope="module")
def planned(tmp_path_factory: pytest.TempPathFactory) -> Foreign:
    foreign = Foreign(tmp_path_factory.mktemp("foreign"))
    assert foreign.plan() == ExitCode.OK
    assert foreign.marker.exists()
    failure = Failure.of_crash(ValueError("no log"))
    carried = carried_files(load_scene(foreign.run / "scene.yaml", trust_code=True))
    capsule = Capsule.of_run(foreign.run, RunArguments().to_json(), failure, carried)
    capsule.save(foreign.folder / "capsule.zip")
    return foreign


@pytest.fixture
def foreign(planned: Foreign, monkeypatch: pytest.MonkeyPatch) -> Foreign:
    """The same as nobody in this process has ever seen it."""
    monkeypatch.chdir(planned.folder)
    user_motion.cache_clear()
    planned.marker.unlink(missing_ok=True)
    shutil.rmtree(planned.folder / "other", ignore_errors=True)
    return planned


def test_every_verb_that_loads_models_takes_the_flag() -> None:
    assert len(LOADERS) > 15
    without = [
        name
        for name, verb in LOADERS.items()
        if not any("--trust-code" in action.option_strings for action in verb._actions)
    ]
    assert without == []


@pytest.mark.parametrize("name", sorted(LOADERS))
def test_no_verb_runs_foreign_code_unasked(
    foreign: Foreign, name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    code = main(foreign.arguments_of(LOADERS[name]))
    error = capsys.readouterr().err
    assert not foreign.marker.exists()
    assert code == ExitCode.INVALID_FILE, error
    for words in ("slider/motion.py", "--trust-code", "$MRMG_TRUSTED_MODELS"):
        assert words in error


@pytest.mark.parametrize("name", ["verify", "report", "figure", "scene check"])
def test_asked_for_it_runs(foreign: Foreign, name: str) -> None:
    words = [*foreign.arguments_of(LOADERS[name]), "--trust-code"]
    # The report ends with the mission's own exit code: nothing was driven.
    ends = {"report": ExitCode.MISSION_FAILED}
    assert main(words) == ends.get(name, ExitCode.OK)


@pytest.mark.parametrize(
    "name", ["run", "execute", "robustness", "replay", "calibrate"]
)
def test_what_drives_says_that_such_a_robot_is_only_planned_for(
    foreign: Foreign, name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    words = [*foreign.arguments_of(LOADERS[name]), "--trust-code"]
    assert main(words) == ExitCode.USAGE
    assert "has a motion of its own" in capsys.readouterr().err


def test_the_python_interface_asks_too(foreign: Foreign) -> None:
    with pytest.raises(SceneError, match="trust_code=True"):
        load_scene(foreign.scene)
    with pytest.raises(SceneError, match="trust_code=True"):
        mrmg.run(foreign.scene, out=foreign.folder / "new")
    assert not foreign.marker.exists()
    assert load_scene(foreign.scene, trust_code=True).has_custom_motion
    with pytest.raises(SceneError):  # trust is given to a call, not to the process
        load_scene(foreign.scene)


@pytest.mark.parametrize(
    ("listed", "trusted"),
    [
        ("{model}", True),
        ("{folder}", True),
        ("/nowhere{sep}{folder}", True),
        ("{folder}/link", True),
        ("", False),
        ("{sep}", False),
        ("{model}2", False),
        ("{model}/motion.py", False),
        ("{model}/deeper", False),
        ("/nowhere", False),
    ],
)
def test_listed_folders_are_trusted(
    foreign: Foreign, monkeypatch: pytest.MonkeyPatch, listed: str, trusted: bool
) -> None:
    link = foreign.folder / "link"
    link.unlink(missing_ok=True)
    link.symlink_to(foreign.model)
    value = listed.format(folder=foreign.folder, model=foreign.model, sep=os.pathsep)
    monkeypatch.setenv("MRMG_TRUSTED_MODELS", value)
    assert (main(["scene", "check", str(foreign.scene)]) == ExitCode.OK) == trusted


def test_a_link_into_a_trusted_folder_is_judged_by_where_it_leads(
    foreign: Foreign, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    trusted = tmp_path / "trusted"
    trusted.mkdir()
    (trusted / "slider").symlink_to(foreign.model)
    monkeypatch.setenv("MRMG_TRUSTED_MODELS", str(trusted))
    with pytest.raises(SceneError, match="--trust-code"):
        load_model(trusted / "slider")


def test_compiled_code_that_came_along_is_not_run(tmp_path: Path) -> None:
    foreign = Foreign(tmp_path)
    motion = foreign.model / "motion.py"
    text = motion.read_text()
    evil = text.replace("\n", " ", 0) + f"open({str(tmp_path / 'evil')!r}, 'a')\n"
    motion.write_text(evil)
    compiled = Path(py_compile.compile(str(motion), invalidation_mode=UNCHECKED))
    motion.write_text(text)
    user_motion(str(motion))
    assert compiled.exists()
    assert not (tmp_path / "evil").exists()


UNCHECKED = py_compile.PycInvalidationMode.UNCHECKED_HASH


@pytest.mark.parametrize("key", ["mjcf", "motion_model"])
@pytest.mark.parametrize(
    "way", ["../{0}", "{folder}/{0}", "sub/../{0}", "link{suffix}"]
)
def test_a_model_names_files_of_its_own_folder(
    tmp_path: Path, key: str, way: str
) -> None:
    suffix = {"mjcf": ".xml", "motion_model": ".py"}[key]
    outside = tmp_path / f"outside{suffix}"
    outside.write_text(SLIDER)
    folder = tmp_path / "car"
    shutil.copytree(shipped.models_folder() / "car", folder)
    (folder / f"link{suffix}").symlink_to(outside)
    raw = yaml.safe_load((folder / "robot.yaml").read_text())
    raw[key] = way.format(outside.name, folder=folder, suffix=suffix)
    (folder / "robot.yaml").write_text(yaml.safe_dump(raw))
    message = f"{key}.*: got .*must be a file inside the model's folder"
    with pytest.raises(SceneError, match=message):
        load_model(folder, trust_code=True)
