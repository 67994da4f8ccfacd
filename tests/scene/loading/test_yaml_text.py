"""YAML is read as YAML 1.2 has it, and written so that it reads back equal."""

from __future__ import annotations

import math

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from mrmg.errors import SceneError
from mrmg.scene.loading.yaml_text import dump_yaml, parse_yaml

SCALARS = [
    ("1e3", 1000.0),  # PyYAML: text
    ("1.5e+2", 150.0),
    ("-.5", -0.5),
    ("+7", 7),
    ("010", 10),  # PyYAML: octal 8
    ("0o10", 8),
    ("0x10", 16),
    ("1_000", "1_000"),  # PyYAML: 1000
    ("1:30", "1:30"),  # PyYAML: 90
    ("no", "no"),  # PyYAML: False
    ("on", "on"),
    ("true", True),
    ("~", None),
    ("2026-01-01", "2026-01-01"),  # PyYAML: a date
    ("'1'", "1"),
    (".inf", math.inf),
    ("-.Inf", -math.inf),
    ("=", "="),
]


@pytest.mark.parametrize(("text", "value"), SCALARS)
def test_scalars(text: str, value: object) -> None:
    read = parse_yaml(f"key: {text}", source="test")["key"]
    assert read == value
    assert type(read) is type(value)


def test_nan() -> None:
    assert math.isnan(parse_yaml(".nan", source="test"))


def test_duplicate_key_is_refused_with_its_place() -> None:
    with pytest.raises(SceneError, match=r"line 3, column 1: the key 'a' is given twi"):
        parse_yaml("a: 1\nb: 2\na: 3\n", source="test")


def test_keys_are_taken_as_they_are_written() -> None:
    read = parse_yaml("010: a\n1e3: b\n~: c\nno: d\n", source="test")
    assert read == {"010": "a", "1e3": "b", "~": "c", "no": "d"}


@pytest.mark.parametrize("key", ["[a, b]", "{a: b}"])
def test_other_keys_are_refused_with_their_place(key: str) -> None:
    with pytest.raises(SceneError, match="line 2, column 3: a key is a .*; expected t"):
        parse_yaml(f"a: 1\n? {key}\n: 3\n", source="test")


PLAIN = st.recursive(
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats(allow_nan=False)
    | st.text(st.characters(codec="utf-8", exclude_categories=["C"])),
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.dictionaries(
            st.text(st.characters(codec="ascii", min_codepoint=32), min_size=1),
            inner,
            max_size=4,
        )
    ),
    max_leaves=12,
)


@pytest.mark.parametrize("text", ["1e3", "0E0", "0o10", "no", "~", "", "1.", "=", "a"])
def test_text_is_written_as_text(text: str) -> None:
    """Whatever YAML 1.1 or 1.2 would take it for."""
    document = {text or "key": text}
    assert parse_yaml(dump_yaml(document), source="test") == document
    assert yaml.safe_load(dump_yaml(document)) == document


@given(PLAIN)
def test_what_is_written_reads_back_equal(value: object) -> None:
    assert parse_yaml(dump_yaml(value), source="test") == value


@given(st.floats(allow_nan=False))
def test_other_readers_read_our_numbers_as_numbers(value: float) -> None:
    assert yaml.safe_load(dump_yaml([value])) == [value]
