"""Seeds as they are given to benches, and what makes figures comparable."""

from __future__ import annotations

import platform

import pytest
from protocol import seed_range, versions


@pytest.mark.parametrize(
    ("text", "seeds"), [("2-4", range(2, 5)), ("7", range(7, 8)), ("0-0", range(1))]
)
def test_seeds_are_read(text: str, seeds: range) -> None:
    assert seed_range(text) == seeds


def test_other_words_are_no_seeds() -> None:
    with pytest.raises(ValueError, match="some"):
        seed_range("some")


def test_no_seeds_are_refused() -> None:
    with pytest.raises(ValueError, match="no seeds from 5 to 3"):
        seed_range("5-3")


def test_versions_name_packages_python_and_processor() -> None:
    output = versions()
    assert "mujoco " in output
    assert f"Python {platform.python_version()}, " in output
    assert not output.endswith(", ")
