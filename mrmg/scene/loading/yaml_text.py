"""YAML text to plain data and back, without PyYAML's traps.

PyYAML follows YAML 1.1: `1e3` is a string, `no` is False, `010` is 8, `1:30` is 90, and
a key given twice silently keeps the last value. Here scalars follow the core schema of
YAML 1.2, keys are taken as they are written: `10: x` has the key "10", and a repeated
one is refused.
"""

from __future__ import annotations

import re
from contextlib import suppress
from pathlib import Path
from typing import Any

import yaml
from yaml.composer import Composer

from mrmg.errors import Fault, SceneError
from mrmg.storage import UNREADABLE

MAX_INTEGER_DIGITS = 400
"""Longer integers are beyond every floating-point number."""

MAX_ALIASED_VALUES = 100_000
"""Values that aliases may repeat; a few lines of them can stand for billions."""


class _CoreLoader(yaml.SafeLoader):  # type: ignore[misc]
    """A safe loader with the scalars of YAML 1.2's core schema."""

    yaml_implicit_resolvers: dict[str, list[tuple[str, re.Pattern[str]]]] = {}

    def construct_object(self, node: yaml.Node, deep: bool = False) -> Any:
        try:
            return super().construct_object(node, deep)
        except (ValueError, LookupError, AttributeError, TypeError) as error:
            # PyYAML trusts that what is tagged as a number or a date is one.
            kind = node.tag.rpartition(":")[2]
            text = str(node.value)
            shown = text if len(text) <= 20 else f"{text[:20]}... of {len(text)} signs"
            message = f"got {shown}, which is no {kind}; write a plain value"
            raise yaml.constructor.ConstructorError(
                None, None, message, node.start_mark
            ) from error

    def construct_mapping(
        self, node: yaml.MappingNode, deep: bool = False
    ) -> dict[Any, Any]:
        mapping: dict[Any, Any] = {}
        for key_node, value_node in node.value:
            key, fault = key_node.value, ""
            if not isinstance(key_node, yaml.ScalarNode):
                fault = f"a key is a {key_node.id}; expected text"
            elif key in mapping:
                fault = f"the key '{key}' is given twice"
            if fault:
                raise yaml.constructor.ConstructorError(
                    None, None, fault, key_node.start_mark
                )
            mapping[key] = self.construct_object(value_node, deep=deep)
        return mapping


def _construct_core_int(loader: _CoreLoader, node: yaml.ScalarNode) -> int:
    text = str(loader.construct_scalar(node))
    if len(text) > MAX_INTEGER_DIGITS:
        raise ValueError("beyond all numbers that a scene can mean")
    return int(text, 0) if text[:2] in ("0o", "0x") else int(text)


def _construct_core_float(loader: _CoreLoader, node: yaml.ScalarNode) -> float:
    text = str(loader.construct_scalar(node)).lower()
    return float(text.replace(".inf", "inf").replace(".nan", "nan"))


_CORE_SCALARS = (
    ("tag:yaml.org,2002:null", r"~|null|Null|NULL|", ["~", "n", "N", ""]),
    ("tag:yaml.org,2002:bool", r"true|True|TRUE|false|False|FALSE", list("tTfF")),
    (
        "tag:yaml.org,2002:int",
        r"[-+]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+",
        list("-+0123456789"),
    ),
    (
        "tag:yaml.org,2002:float",
        r"[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?"
        r"|[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN)",
        list("-+.0123456789"),
    ),
)


class _Dumper(getattr(yaml, "CSafeDumper", yaml.SafeDumper)):  # type: ignore[misc]
    """Writes lists of plain values on one line, and never an alias.

    It quotes what readers of YAML 1.1 or 1.2 take for something else than text: "no" in
    the former, "1e3" in the latter.
    """

    def ignore_aliases(self, data: Any) -> bool:
        return True


for _tag, _pattern, _first in _CORE_SCALARS:
    _scalar = re.compile(f"^(?:{_pattern})$")
    _CoreLoader.add_implicit_resolver(_tag, _scalar, _first)
    _Dumper.add_implicit_resolver(_tag, _scalar, _first)
_CoreLoader.add_constructor("tag:yaml.org,2002:int", _construct_core_int)
_CoreLoader.add_constructor("tag:yaml.org,2002:float", _construct_core_float)


class _FastLoader(Composer, getattr(yaml, "CSafeLoader", yaml.SafeLoader)):  # type: ignore[misc]
    """The same with the parser in C, a third of the time; its errors say less.

    Python's composer refuses what is nested too deeply; that in C ends the process.
    """

    yaml_implicit_resolvers = _CoreLoader.yaml_implicit_resolvers
    yaml_constructors = _CoreLoader.yaml_constructors
    construct_mapping = _CoreLoader.construct_mapping

    def __init__(self, stream: str) -> None:
        super(Composer, self).__init__(stream)
        Composer.__init__(self)


def read_yaml(path: Path, *, source: str) -> Any:
    """Read a YAML file as plain data.

    Raises:
        SceneError: if it cannot be read or is no YAML; names the line.
    """
    return parse_yaml(read_text(path, source=source), source=source)


def read_text(path: Path, *, source: str) -> str:
    """Read a text file.

    Raises:
        SceneError: if it cannot be read.
    """
    try:
        return path.read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        message = f"not a text file in UTF-8 (byte {error.start})"
        raise SceneError(source, [Fault("", message)]) from error
    except OSError as error:
        message = f"cannot be read ({error.strerror})"
        raise SceneError(source, [Fault("", message)]) from error


def parse_yaml(text: str, *, source: str) -> Any:
    """Turn YAML text into plain data.

    Args:
        text: the YAML.
        source: what error messages call it.

    Raises:
        SceneError: if it is no YAML; names the line and column.
    """
    try:
        document = _loaded(text)
        if "*" in text and _repeated(document, {}) > MAX_ALIASED_VALUES:
            message = f"aliases repeat more than {MAX_ALIASED_VALUES} values"
            raise SceneError(source, [Fault("", f"{message}; write them out")])
        return document
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        place = f"line {mark.line + 1}, column {mark.column + 1}" if mark else ""
        problem = ", ".join(part for part in (error.context, error.problem) if part)
        if not isinstance(error, yaml.constructor.ConstructorError):
            problem = f"no valid YAML: {problem}"
        raise SceneError(source, [Fault(place, problem)]) from error
    except yaml.YAMLError as error:
        raise SceneError(source, [Fault("", f"no valid YAML: {error}")]) from error
    except RecursionError as error:
        raise SceneError(source, [Fault("", "nested too deeply")]) from error


def _loaded(text: str) -> Any:
    with suppress(*UNREADABLE, yaml.YAMLError):  # read again for the message
        return yaml.load(text, Loader=_FastLoader)  # noqa: S506 (a safe loader)
    return yaml.load(text, Loader=_CoreLoader)  # noqa: S506 (a safe loader)


def _repeated(value: Any, sizes: dict[int, float]) -> float:
    """Return how many values a document has that are given as aliases alone.

    Args:
        value: the document, or a part of it.
        sizes: of the parts that were met, by identity.
    """
    items = value.values() if isinstance(value, dict) else value
    if not isinstance(value, (dict, list)):
        return 0.0
    sizes[id(value)] = 1.0
    repeated, size = 0.0, 1.0
    for item in items:
        if id(item) in sizes:
            repeated += sizes[id(item)]
        else:
            repeated += _repeated(item, sizes)
        size += sizes.get(id(item), 1.0)
    sizes[id(value)] = size
    return repeated


def _represent_list(dumper: _Dumper, data: list[Any]) -> yaml.SequenceNode:
    short = not any(isinstance(item, dict) for item in data)
    return dumper.represent_sequence("tag:yaml.org,2002:seq", data, flow_style=short)


_Dumper.add_representer(list, _represent_list)


def dump_yaml(document: Any) -> str:
    """Return plain data as YAML text; `parse_yaml` gives equal data back."""
    text: str = yaml.dump(
        document, Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=88
    )
    return text
