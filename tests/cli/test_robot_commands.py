"""`mrmg robot`: a model is checked and shown, begun, listed."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from mrmg import shipped
from mrmg.cli.main import main
from mrmg.errors import ExitCode
from mrmg.scene.loading import load_scene
from mrmg.scene.loading.models import load_model

RED = np.array([214, 39, 40])


@pytest.fixture(autouse=True)
def _here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def test_check_shows_the_robot_in_figures_and_in_a_picture(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["robot", "check", "car", "-o", "shown.png"]) == ExitCode.OK
    out = capsys.readouterr().out
    car, _ = load_model(shipped.models_folder() / "car")
    for words in ("180 kg", "1.8 x 1.1 m", "124.6 J/m", "249 m of plain ground"):
        assert words in out
    assert f"{car.turning_radius_m:.2f} m in plans" in out
    pixels = np.asarray(Image.open(tmp_path / "shown.png").convert("RGB")).astype(int)
    red = np.abs(pixels - RED).sum(axis=-1) < 30
    half = pixels.shape[1] // 2
    assert red[:, :half].sum() > 300
    assert red[:, half:].sum() > 300
    # The body of the robot, blue, lies within the red outline seen from above.
    blue = (pixels[..., 2] > 150) & (pixels[..., 0] < 60)
    rows, columns = np.nonzero(red[:, half:])
    own_rows, own_columns = np.nonzero(blue[:, half:])
    assert rows.min() <= own_rows.min() < own_rows.max() <= rows.max()
    assert columns.min() <= own_columns.min() < own_columns.max() <= columns.max()


@pytest.mark.parametrize("like", shipped.model_names())
def test_a_new_model_is_valid_as_it_is(
    tmp_path: Path, like: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["robot", "new", "mine", "--like", like]) == ExitCode.OK
    assert "robot check mine" in capsys.readouterr().out
    assert {path.name for path in (tmp_path / "mine").iterdir()} == {
        "robot.yaml",
        "mine.xml",
    }
    assert main(["robot", "check", "mine", "--json"]) == ExitCode.OK
    found = json.loads(capsys.readouterr().out)
    model, theirs = load_model(shipped.models_folder() / like)
    assert found["ok"]
    assert found["figures"]["mass_kg"] == model.mass_kg
    assert (tmp_path / found["picture"]).is_file()
    _, ours = load_model(tmp_path / "mine")
    assert ours.pop("mjcf") == "mine.xml"
    assert theirs.pop("mjcf") == f"{like}.xml"
    assert ours == theirs
    (tmp_path / "scene.yaml").write_text(
        "format: 1\nbounds: [0, 0, 20, 20]\n"
        "robots: [{id: r1, model: ./mine, pose: [5, 5, 0]}]\n"
    )
    assert load_scene("scene.yaml").robots[0].model.name == "mine"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["mine"], "mine is there already"),
        (["car"], "'car' cannot name a robot model"),
        (["my robot"], "cannot name"),
        ([".."], "cannot name"),
        (
            ["other", "--like", "boat"],
            "shipped model 'boat' is not known",
        ),
    ],
)
def test_new_refuses(
    tmp_path: Path, words: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "mine").mkdir()
    assert main(["robot", "new", *words]) == ExitCode.USAGE
    assert message in capsys.readouterr().err
    assert [path.name for path in tmp_path.rglob("*")] == ["mine"]


def test_check_names_all_faults(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["robot", "new", "mine"]) == ExitCode.OK
    file = tmp_path / "mine" / "robot.yaml"
    text = file.read_text().replace("mass: 180.0", "mass: 300.0")
    file.write_text(text.replace("track: 0.9", "track: 1.9"))
    capsys.readouterr()
    assert main(["robot", "check", "./mine", "--json"]) == ExitCode.INVALID_FILE
    captured = capsys.readouterr()
    found = json.loads(captured.out)
    assert not found["ok"]
    assert {fault["path"] for fault in found["faults"]} >= {"mass", "track"}
    assert "robot.yaml says 300 kg, mine.xml has 180 kg" in captured.err
    assert not (tmp_path / "mine.png").exists()


def test_a_model_that_is_only_planned_for_is_shown_as_its_footprint(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["robot", "new", "mine"]) == ExitCode.OK
    file = tmp_path / "mine" / "robot.yaml"
    file.write_text(file.read_text().replace("mjcf: mine.xml", ""))
    assert main(["robot", "check", "./mine"]) == ExitCode.OK
    assert "has no MJCF file: can be planned for" in capsys.readouterr().out
    assert (tmp_path / "mine.png").is_file()


def test_list_has_a_line_for_each_shipped_model(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["robot", "list"]) == ExitCode.OK
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines[1:]] == shipped.model_names()
    assert "180 kg" in lines[1]


def test_no_such_model(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["robot", "check", "boat"]) == ExitCode.USAGE
    assert "unknown model 'boat'" in capsys.readouterr().err


@pytest.mark.parametrize("given", [["wide"], ["wide:=1", "wide:=2"]])
def test_arguments_of_a_description_are_given_once_each(
    given: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    words = [word for argument in given for word in ("--arg", argument)]
    assert main(["robot", "import", "cart.xacro", *words]) == ExitCode.USAGE
    assert "expected NAME=VALUE, each name once" in capsys.readouterr().err
