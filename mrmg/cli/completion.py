"""Completion of the command line in bash, zsh and fish, made from its parser."""

from __future__ import annotations

import argparse
import re
import shlex
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from mrmg import shipped
from mrmg.cli.usage import Parser
from mrmg.templates import rendered

SHELLS = ("bash", "zsh", "fish")

_BACKSLASHED = r"\\\g<0>"
"""What is found, after a backslash."""


@dataclass(frozen=True, slots=True)
class _Argument:
    """One argument of a verb.

    Attributes:
        flags: how an option is spelled; empty for an argument that goes by its place.
        help: what it is, in a few words.
        value: what its value is called; empty if it has none.
        words: the values it may have, each with a help text.
        files: "file", "folder" or "yaml" if its value is a path, else empty.
        repeats: whether several may follow each other.
    """

    flags: tuple[str, ...]
    help: str
    value: str
    words: dict[str, str]
    files: str
    repeats: bool


def completion(options: argparse.Namespace) -> None:
    """Print the completion script of a shell."""
    from mrmg.cli.parser import make_parser

    verbs = dict(_verbs(make_parser()))
    words = [verb.rpartition(" ") for verb in verbs if verb]
    script = rendered(
        __package__,
        f"completion.{options.shell}.jinja",
        {
            "quoted": shlex.quote,
            "escaped": partial(re.sub, r"[^\w/.-]", _BACKSLASHED),
            "bracketed": partial(re.sub, r"[][:\\]", _BACKSLASHED),
            "within_quotes": partial(re.sub, r"[\\']", _BACKSLASHED),
        },
        verbs=verbs,
        steps=[f'"{before} {word}"' for before, _, word in words],
    )
    print(script, end="")


def _verbs(parser: Parser, name: str = "") -> Iterator[tuple[str, list[_Argument]]]:
    """Yield the arguments of every verb, by its words: "scene check"; "" before it."""
    yield name, [_argument(action, parser) for action in parser.arguments()]
    for word, inner in parser.verbs().items():
        yield from _verbs(inner, f"{name} {word}".strip())


def _argument(action: argparse.Action, parser: Parser) -> _Argument:
    metavar = str(action.metavar or action.dest.upper())
    words = dict.fromkeys(
        map(str, action.choices or getattr(action, "suggested", ()) or ()), ""
    )
    is_verb = not action.option_strings and action.choices is not None
    if is_verb and parser.verbs():
        words = {name: verb.summary for name, verb in parser.verbs().items()}
    elif "|" in metavar:
        words = {word: "" for word in metavar.split("|") if word.islower()}
    files = ""
    if "SCENE" in metavar:
        words, files = dict.fromkeys(shipped.scene_names(), "shipped scene"), "yaml"
    elif "MODEL" in metavar:
        words, files = dict.fromkeys(shipped.model_names(), "shipped robot"), "folder"
    elif action.type is Path:
        files = "folder" if metavar in ("RUN", "DIR", "FOLDER") else "file"
    has_value = action.nargs not in (0, "?")
    return _Argument(
        flags=tuple(action.option_strings),
        help=(action.help or "").replace("%%", "%"),
        value=metavar if has_value else "",
        words=words,
        files=files,
        repeats=action.nargs == "+",
    )
