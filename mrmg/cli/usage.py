"""The parser of the command line, and what it answers to a mistake."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NoReturn

from mrmg import shipped
from mrmg.errors import ExitCode, UsageError, nearest

OPTION_SIMILARITY = 0.7
"""Least similarity of a suggested option: two dashes alone make half of some."""


class _Verbs(argparse._SubParsersAction):  # type: ignore[type-arg]
    """The verbs of a parser, each of which shows its help text on its own page, too."""

    def add_parser(self, name: str, **details: Any) -> Any:
        """Add a verb; see argparse.

        `command` is what it calls with its options; returns an exit code, None for 0.
        """
        summary, command = details.get("help", ""), details.pop("command", None)
        verb = super().add_parser(name, **{"description": summary, **details})
        verb.summary = summary
        verb.set_defaults(command=command)
        return verb

    def add_group(self, name: str, help: str) -> Any:
        """Add a verb that has verbs of its own; return what they are added to."""
        return self.add_parser(name, help=help).add_verbs()


class Parser(argparse.ArgumentParser):
    """An argument parser that answers a mistake with one message and a usage line."""

    summary = ""
    """What its verb does, in a few words."""

    def __init__(self, *args: Any, **details: Any) -> None:
        super().__init__(*args, **details)
        self.register("action", "parsers", _Verbs)

    def add_verbs(self) -> Any:
        """Return what the parser's verbs are added to."""
        return self.add_subparsers(title="commands", metavar="COMMAND", required=True)

    def add_value(
        self,
        flag: str,
        metavar: str | None,
        help: str,
        read: Callable[[str], Any] = str,
        default: Any = None,
    ) -> None:
        """Add an option with a value that `read` reads."""
        self.add_argument(
            flag, type=reader(read), metavar=metavar, help=help, default=default
        )

    def add_flag(self, flag: str, help: str) -> None:
        """Add an option without a value."""
        self.add_argument(flag, action="store_true", help=help)

    def add_run(self) -> None:
        """Add the run folder that a verb is about."""
        self.add_argument("run", type=Path, metavar="RUN", help="run folder")

    def add_out(self, metavar: str, help: str, *, short: bool = True) -> None:
        """Add the option that names what a verb writes."""
        flags = ("-o", "--out") if short else ("--out",)
        self.add_argument(*flags, type=Path, metavar=metavar, help=help)

    def add_overwrite(self, what: str) -> None:
        """Add the option that lets a verb replace finished results, named by `what`."""
        self.add_flag("--overwrite", f"replace {what} that is there")

    def add_trust(self) -> None:
        """Add the option of every verb that loads a scene, a run or a robot model."""
        self.add_flag(
            "--trust-code",
            "let robot models run Python code that they bring (motion_model: FILE.py)",
        )

    def add_json(self, what: str) -> None:
        """Add the option that prints `what` in place of words for people."""
        self.add_flag("--json", f"print {what}")

    def read(self, words: Sequence[str]) -> argparse.Namespace:
        """Return the options that `words` give; a mistake ends the program."""
        addressed = self._addressed(words)
        options, left = self.parse_known_args(words)
        if left:
            addressed.error(f"unexpected argument '{left[0]}'")
        return options

    def arguments(self) -> list[argparse.Action]:
        """Return the arguments that help shows, so no retired spellings of options.

        Argparse has no public name for them.
        """
        return [each for each in self._actions if each.help != argparse.SUPPRESS]

    def verbs(self) -> Mapping[str, Parser]:
        """Return the parsers of the verbs by their names."""
        for argument in self.arguments():
            if isinstance(argument, _Verbs):
                return argument.choices
        return {}

    def options(self) -> list[str]:
        """Return the spellings of all options, retired ones among them."""
        return [name for each in self._actions for name in each.option_strings]

    def error(self, message: str) -> NoReturn:
        """Print the message and a usage line, and end the program."""
        names = [str(a.metavar) for a in self.arguments() if not a.option_strings]
        rest = "..." if self.verbs() else "[options]"
        usage = " ".join([self.prog, *names, rest])
        text = (
            f"{self.prog}: {message}\nusage: {usage}; '{self.prog} --help' lists them\n"
        )
        self.exit(ExitCode.USAGE, text)

    def _addressed(self, words: Sequence[str]) -> Parser:
        """Return the parser of the verb that `words` name, if they know its options."""
        verbs = self.verbs()
        for place, word in enumerate(words):
            if word == "--":
                break
            if word.startswith("-"):
                self._require_option(word)
            elif word in verbs:
                return verbs[word]._addressed(words[place + 1 :])
            elif verbs:
                self.error(f"unknown command '{word}'{self._meant(word)}")
        return self

    def _require_option(self, word: str) -> None:
        name = word.partition("=")[0]
        known = self.options()
        is_short = word[:2] in known and f"-{name}" not in known
        is_text = " " in word or word == "-" or _is_number(word)
        if is_short or is_text or any(option.startswith(name) for option in known):
            return
        near = nearest(f"--{name.lstrip('-')}", known, cutoff=OPTION_SIMILARITY)
        self.error(f"unknown option '{name}'{near}")

    def _meant(self, word: str) -> str:
        """Return the question for the command that is meant by what is no verb."""
        verbs = self.verbs()
        for verb, parser in verbs.items():
            if word in parser.verbs():
                return f" (did you mean '{verb} {word}'?)"
        if word.endswith(".yaml") or word in shipped.scene_names():
            verb = "run" if "run" in verbs else "check"
            return f" (did you mean '{verb} {word}'?)"
        return nearest(word, verbs)


def reader(read: Callable[[str], Any]) -> Callable[[str], Any]:
    """Return a reader whose message argparse shows."""

    def read_text(text: str) -> Any:
        try:
            return read(text)
        except (ValueError, UsageError) as error:
            raise argparse.ArgumentTypeError(str(error)) from error

    return read_text


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True
