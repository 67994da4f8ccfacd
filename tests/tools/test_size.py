"""What `tools/size` counts."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest
import size

SOURCE = '''"""A module."""

# A comment.
NUMBER = (  # of it
    1
)
"""What NUMBER is,

in three lines."""


class Thing:
    """A class."""

    text = """Not a docstring,
    but a value."""

    def method(self, a, /, b, *c, d, **e):
        """Do something."""

        def inner(x):
            return x  # done

        return inner(a)
'''


def test_blanks_comments_and_docstrings_do_not_count() -> None:
    assert size.code_lines(SOURCE) == 3 + 1 + 2 + 4
    assert size.code_lines("") == 0


def test_functions_are_measured_wherever_they_are() -> None:
    assert size.functions(SOURCE) == [
        ("Thing.method", 7, 5),
        ("Thing.method.inner", 2, 1),
    ]


def test_figures_add_up_and_are_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    package, tools = tmp_path / "mrmg", tmp_path / "tools"
    for name in ("planning/one.py", "motion/two.py", "scene/three.py", "four.py"):
        path = package / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(SOURCE)
    wide = "def wide(a, b, c, d, e, f, g, h, i):\n    return a\n"
    (package / "scene" / "long.py").write_text(wide + "a = 1\n" * 349)
    far = "def far():\n" + "    a = 1\n" * 60
    (package / "scene" / "far.py").write_text(far)
    (tools / "faults").mkdir(parents=True)
    (tools / "faults" / "far.py").write_text(far)
    (tools / "long.py").write_text("a = 1\n" * 352)
    monkeypatch.setattr(size, "PACKAGE", package)
    monkeypatch.setattr(size, "TOOLS", tools)
    monkeypatch.setattr(sys, "argv", ["size", "--json", str(tmp_path / "size.json")])
    size.main()
    found = json.loads((tmp_path / "size.json").read_text())
    assert found["packages"] == {
        "motion": 10,
        "mrmg": 10,
        "planning": 10,
        "scene": 10 + 351 + 61,
    }
    assert (found["core"], found["total"]) == (20, 30 + 422)
    assert found["long_modules"] == [
        {"module": "mrmg.scene.long", "lines": 351},
        {"module": "tools.long", "lines": 352},
    ]
    assert found["long_functions"] == [
        {"module": "mrmg.scene.far", "function": "far", "lines": 61},
        {"module": "tools.faults.far", "function": "far", "lines": 61},
    ]
    assert found["wide_functions"] == [
        {"module": "mrmg.scene.long", "function": "wide", "parameters": 9}
    ]
    output = capsys.readouterr().out
    assert "    452  total\n" in output
    assert "      9  mrmg.scene.long.wide\n" in output


def test_no_module_and_no_function_is_long() -> None:
    found = size.measure(size.PACKAGE, size.TOOLS)
    assert found["long_modules"] == []
    assert found["long_functions"] == []
