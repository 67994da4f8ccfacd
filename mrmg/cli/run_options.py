"""The options of a run on the command line, made from their one specification."""

from __future__ import annotations

import argparse
from functools import partial
from typing import Any

from mrmg import extensions
from mrmg.cli.usage import reader
from mrmg.runs.arguments import RunArguments, VideoArguments
from mrmg.runs.options import Option, options_of

_Arguments = type[RunArguments] | type[VideoArguments]


def add_options(
    parser: argparse.ArgumentParser, verb: str, arguments: _Arguments = RunArguments
) -> None:
    """Add the options of a class of arguments that a verb takes."""
    groups: dict[str, Any] = {"": parser}
    for option in options_of(arguments):
        if verb not in option.verbs:
            continue
        if option.group not in groups:
            groups[option.group] = parser.add_mutually_exclusive_group()
        flags = {option.flag: _escaped(option)}
        for retired in option.formerly:
            flags["--" + retired.replace("_", "-")] = argparse.SUPPRESS
        for flag, text in flags.items():
            argument = groups[option.group].add_argument(
                flag,
                dest=option.name,
                default=argparse.SUPPRESS,
                help=text,
                **_details(option),
            )
            if option.extended:
                argument.suggested = extensions.BUILT_IN[option.extended]  # to complete


def help_of(name: str) -> str:
    """Return what an option of a run does, for a verb that takes it otherwise."""
    return next(
        _escaped(each) for each in options_of(RunArguments) if each.name == name
    )


def _escaped(option: Option) -> str:
    return option.help.replace("%", "%%")


def given(
    options: argparse.Namespace, arguments: _Arguments = RunArguments
) -> dict[str, Any]:
    """Return what the command line gives of a class of arguments, by field."""
    known = [option.name for option in options_of(arguments)]
    return {name: value for name, value in vars(options).items() if name in known}


def _details(option: Option) -> dict[str, Any]:
    """Return the keywords of `add_argument` for one option."""
    if isinstance(option.default, bool):
        both = option.verbs == ("render",)  # which keeps what was chosen before
        action: Any = argparse.BooleanOptionalAction if both else "store_true"
        return {"action": action}
    if option.choices:
        return {"choices": option.choices}
    if option.default == ():
        return {"action": "append", "metavar": option.metavar}
    group = option.extended
    read = partial(extensions.require, group) if group else option.read
    details = {"type": reader(read), "metavar": option.metavar}
    bare = {} if option.bare is None else {"nargs": "?", "const": option.bare}
    return {**details, **bare}
