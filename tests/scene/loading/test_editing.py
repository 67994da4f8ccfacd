"""Values of a YAML text change; comments, order and layout stay."""

from __future__ import annotations

import pytest
import yaml

from mrmg import shipped
from mrmg.errors import SceneError
from mrmg.scene.loading.editing import NewValue, with_values

TEXT = """\
# A robot.
mass: 180.0   # kg; weighed
rolling: 0.06
wheel:
  radius: 0.25        # m
  inertia: 0.25       # kg m^2; a disc
limits: {a: 1.0, b: 2.0}
"""


def changed(text: str, **values: NewValue) -> str:
    changes = {tuple(key.split("__")): value for key, value in values.items()}
    return with_values(text, changes, source="robot.yaml")


def new(text: str, unit: str = "1", detail: str = " 1.0: +-0.1") -> NewValue:
    return NewValue(text, unit, "measured", detail)


def test_only_the_value_and_its_comment_change() -> None:
    text = changed(TEXT, wheel__inertia=new("0.3", "kg m^2"))
    before, after = TEXT.splitlines(), text.splitlines()
    assert after[5] == "  inertia: 0.3       # kg m^2; a disc; measured 1.0: +-0.1"
    assert [line for i, line in enumerate(after) if i != 5] == [
        line for i, line in enumerate(before) if i != 5
    ]


def test_a_value_without_comment_gets_one_with_its_unit() -> None:
    assert "\nrolling: 0.07  # 1; measured 1.0: +-0.1\n" in changed(
        TEXT, rolling=new("0.07")
    )


def test_a_second_measurement_takes_the_place_of_the_first() -> None:
    once = changed(TEXT, mass=new("181", "kg"))
    twice = changed(once, mass=new("182", "kg", " 2.0: +-0.2"))
    assert twice.splitlines()[1] == "mass: 182   # kg; weighed; measured 2.0: +-0.2"
    bare = changed(changed(TEXT, rolling=new("0.1")), rolling=new("0.2"))
    assert "\nrolling: 0.2  # 1; measured 1.0: +-0.1\n" in bare


def test_several_values_at_once_even_on_one_line() -> None:
    text = changed(
        TEXT,
        mass=new("1"),
        limits__b=new("20.5"),
        limits__a=new("10"),
        rolling=new("2"),
    )
    assert yaml.safe_load(text) == {
        "mass": 1,
        "rolling": 2,
        "wheel": {"radius": 0.25, "inertia": 0.25},
        "limits": {"a": 10, "b": 20.5},
    }


def test_a_text_without_a_last_newline_is_fine() -> None:
    assert changed("a: 1", a=new("2")) == "a: 2  # 1; measured 1.0: +-0.1"


@pytest.mark.parametrize("name", shipped.model_names())
def test_shipped_models_can_be_edited(name: str) -> None:
    text = (shipped.models_folder() / name / "robot.yaml").read_text()
    edited = changed(text, rolling_coefficient=new("0.5"), wheel__inertia=new("7.0"))
    before, after = yaml.safe_load(text), yaml.safe_load(edited)
    assert after["rolling_coefficient"] == 0.5
    assert after["wheel"].pop("inertia") == 7.0
    del before["wheel"]["inertia"]
    assert after | {"rolling_coefficient": before["rolling_coefficient"]} == before


@pytest.mark.parametrize(
    ("text", "path", "output"),
    [
        (TEXT, "turning", "turning: missing"),
        (TEXT, "wheel__mass", "wheel.mass: missing"),
        (TEXT, "mass__kg", "mass.kg: missing"),
        (TEXT, "wheel", "wheel: missing"),
        ("a: [1", "a", "no valid YAML"),
        ("", "a", "a: missing"),
    ],
)
def test_what_cannot_be_changed_is_named(text: str, path: str, output: str) -> None:
    with pytest.raises(SceneError, match=output):
        changed(text, **{path: new("1")})
