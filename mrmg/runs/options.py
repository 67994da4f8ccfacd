"""Options: what one argument of a command is called, reads, decides and shows.

A class of arguments states each of its options once, as a field made by `option` with a
docstring, which is its help. The command line, the keywords of the Python API and the
records of runs are made from them.
"""

from __future__ import annotations

import ast
import inspect
import sys
from collections.abc import Callable, Mapping
from dataclasses import Field, dataclass, field, fields
from functools import cache
from itertools import pairwise
from typing import Any, TypeVar

from mrmg.errors import UsageError

_OPTION = "option"
_MARK = "`:\n"
"""Ends what a docstring says of keywords that `documented` lists."""

_Function = TypeVar("_Function", bound=Callable[..., Any])
_VERBS = {
    "plan": ("run", "plan"),
    "drive": ("run", "execute"),
    "audit": ("run", "execute", "audit"),
    "": (),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Option:
    """How one argument is spelled, read and used.

    Attributes:
        name: of the field and of the keyword of `mrmg.run`.
        type: of its values, as annotated.
        flag: of the command line.
        help: what it does.
        read: returns the value of a text or of a value, or raises ValueError.
        decides: "plan", "drive" or "audit", what its value decides; "" for none.
        verbs: of the command line that take it.
        metavar: name of its value in the help; None for a switch or with `choices`.
        choices: allowed values, where they are few.
        extended: group of entry points whose names are allowed;
            `RunArguments.require_names` checks them, as recorded ones need not be
            installed.
        bare: value of the flag alone, where its value may be left out.
        group: name of a set of options that exclude each other; "" for none.
        formerly: retired names of the field, still read everywhere and shown nowhere.
        default: of the field.
    """

    name: str
    type: str
    flag: str
    help: str
    verbs: tuple[str, ...]
    default: Any
    read: Callable[[Any], Any] = str
    decides: str = ""
    metavar: str | None = None
    choices: tuple[str, ...] | None = None
    extended: str | None = None
    bare: str | None = None
    group: str = ""
    formerly: tuple[str, ...] = ()

    def words(self, value: Any) -> list[str]:
        """Return the words of a command line that give `value`."""
        if value == self.default:
            return []
        if value == self.bare or value is True:
            return [self.flag]
        if isinstance(value, tuple):
            return [word for each in value for word in (self.flag, each)]
        return [self.flag, value_text(value)]


def value_text(value: Any) -> str:
    """Return a value as the command line takes it."""
    if isinstance(value, Mapping) and "makespan" not in value:  # margins
        return ",".join(f"{key}={value_text(number)}" for key, number in value.items())
    if isinstance(value, Mapping):  # the weights of an objective
        return f"{value_text(value['energy'])}:{value_text(value['makespan'])}"
    if isinstance(value, float):
        short = f"{value:g}"
        return short if float(short) == value else repr(value)
    return str(value)


def option(default: Any, **details: Any) -> Any:
    """Return a dataclass field that is an option; `details` as in `Option`."""
    metadata = {_OPTION: {"default": default, **details}}
    return field(default=default, metadata=metadata)


def options_of(arguments: type[Checked]) -> tuple[Option, ...]:
    """Return the options of a class of arguments, in the order of their fields."""
    by_class: Any = arguments  # classes of dataclasses are hashable, mypy doubts it
    return _options_of(by_class)


@cache
def _options_of(arguments: Any) -> tuple[Option, ...]:
    helps = _docstrings(arguments)
    return tuple(
        _option_of(each, helps[each.name])
        for each in fields(arguments)
        if each.metadata.get(_OPTION)
    )


def _docstrings(arguments: type) -> dict[str, str]:
    """Return the docstrings of a class's fields, which only its source has."""
    found: dict[str, str] = {}
    for kind in reversed(arguments.__mro__[:-1]):
        for statement, below in pairwise(_definitions(kind.__module__)[kind.__name__]):
            match statement, below:
                case (
                    ast.AnnAssign(target=ast.Name(id=name)),
                    ast.Expr(value=ast.Constant(value=str(text))),
                ):
                    found[name] = " ".join(text.split())
    return found


@cache
def _definitions(module: str) -> dict[str, list[ast.stmt]]:
    """Return the bodies of a module's classes; to find one's source takes longer."""
    tree = ast.parse(inspect.getsource(sys.modules[module]))
    return {one.name: one.body for one in tree.body if isinstance(one, ast.ClassDef)}


def _option_of(each: Field[Any], help: str) -> Option:
    details = each.metadata[_OPTION]
    usual = {
        "flag": "--" + each.name.removesuffix("_s").replace("_", "-"),
        "verbs": _VERBS[details.get("decides", "")],
    }
    return Option(name=each.name, type=str(each.type), help=help, **(usual | details))


class Checked:
    """Arguments whose values are read by their options' readers."""

    __slots__ = ()

    def __post_init__(self) -> None:
        groups: dict[str, str] = {}
        for option in options_of(type(self)):
            value = getattr(self, option.name)
            if value == option.default:
                continue
            try:
                value = option.read(value)
            except ValueError as error:
                raise UsageError(f"{option.name}: {error}") from error
            if option.choices and value not in option.choices:
                allowed = ", ".join(option.choices)
                raise UsageError(f"{option.name}: {value!r}; allowed: {allowed}")
            object.__setattr__(self, option.name, value)
            other = groups.setdefault(option.group or option.name, option.name)
            if other != option.name:
                raise UsageError(f"{option.name} is not allowed with {other}")


def documented(arguments: type[Checked]) -> Callable[[_Function], _Function]:
    """Return a decorator that states options as keywords of a function.

    It gives the function's signature the options in place of its last parameter, and
    adds them to what its documentation states of that one, which ends with a colon.
    """

    def decorate(function: _Function) -> _Function:
        own = inspect.signature(function)
        every = [
            one for one in own.parameters.values() if one.kind is not one.VAR_KEYWORD
        ]
        for each in options_of(arguments):
            keyword = inspect.Parameter(each.name, inspect.Parameter.KEYWORD_ONLY)
            every.append(keyword.replace(default=each.default, annotation=each.type))
        function.__signature__ = own.replace(parameters=every)  # type: ignore[attr-defined]
        head, colon, rest = (function.__doc__ or "").partition(_MARK)
        stated = "".join(
            f"            {each.name}: {each.help}.\n" for each in options_of(arguments)
        )
        function.__doc__ = f"{head}{colon}{stated}{rest}"
        return function

    return decorate
