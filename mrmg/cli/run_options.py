"""The options of a run on the command line, made from their one specification."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import Any

from mrmg import extensions
from mrmg.cli.usage import reader
from mrmg.errors import UsageError
from mrmg.runs.arguments import RunArguments, VideoArguments
from mrmg.runs.options import Option, options_of

_Arguments = type[RunArguments] | type[VideoArguments]


def add_options(
    parser: argparse.ArgumentParser, verb: str, arguments: _Arguments = RunArguments
) -> None:
    """Add the options of a class of arguments that a verb takes."""
    groups: dict[str, Any] = {}
    for option in options_of(arguments):
        if verb not in option.verbs:
            continue
        place: Any = parser
        if option.group:
            exclusive = parser.add_mutually_exclusive_group
            place = groups.setdefault(option.group, None) or exclusive()
            groups[option.group] = place
        argument = place.add_argument(
            option.flag,
            dest=option.name,
            default=argparse.SUPPRESS,
            help=_escaped(option),
            **_details(option),
        )
        argument.suggested = option.choices  # to complete
        for retired in option.formerly:
            place.add_argument(
                "--" + retired.replace("_", "-"),
                dest=option.name,
                default=argparse.SUPPRESS,
                help=argparse.SUPPRESS,
                **_details(option),
            )


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


def _name(group: str) -> Callable[[str], str]:
    """Return a reader of names of planners or routers."""

    def read_name(text: str) -> str:
        try:
            return extensions.require(group, text)
        except UsageError as error:
            raise argparse.ArgumentTypeError(str(error)) from error

    return read_name


def _details(option: Option) -> dict[str, Any]:
    """Return the keywords of `add_argument` for one option."""
    if isinstance(option.default, bool):
        both = option.verbs == ("render",)  # which keeps what was chosen before
        action: Any = argparse.BooleanOptionalAction if both else "store_true"
        return {"action": action}
    if option.extended:
        return {"type": _name(option.extended), "metavar": option.metavar}
    if option.choices:
        return {"choices": option.choices}
    if option.default == ():
        return {"action": "append", "metavar": option.metavar}
    details = {"type": reader(option.read), "metavar": option.metavar}
    bare = {} if option.bare is None else {"nargs": "?", "const": option.bare}
    return {**details, **bare}
