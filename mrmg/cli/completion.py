"""Completion of the command line in bash, zsh and fish, made from its parser."""

from __future__ import annotations

import argparse
import re
import shlex
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from mrmg import shipped
from mrmg.cli.usage import Parser
from mrmg.errors import ExitCode

SHELLS = ("bash", "zsh", "fish")


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


_Verbs = dict[str, list[_Argument]]
"""The arguments of every verb, by its words: "scene check"; "" before the verb."""


def completion(options: argparse.Namespace) -> int:
    """Print the completion script of a shell."""
    from mrmg.cli.parser import make_parser

    verbs = dict(_verbs(make_parser()))
    script = {"bash": _bash, "zsh": _zsh, "fish": _fish}[options.shell]
    print(script(verbs), end="")
    return ExitCode.OK


def _verbs(parser: Parser, name: str = "") -> Iterator[tuple[str, list[_Argument]]]:
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


_BASH = """\
# Completion of mrmg in bash; for ~/.bashrc: eval "$(mrmg completion bash)"
_mrmg() {
    local cur=${COMP_WORDS[COMP_CWORD]} prev=${COMP_WORDS[COMP_CWORD - 1]}
    local verb= words= files= options= i
    [[ $cur == "=" ]] && cur=
    [[ $prev == "=" ]] && prev=${COMP_WORDS[COMP_CWORD - 2]}
    for ((i = 1; i < COMP_CWORD; i++)); do
        case "$verb ${COMP_WORDS[i]}" in
            @VERBS@) verb="${verb:+$verb }${COMP_WORDS[i]}" ;;
        esac
    done
    case "$verb $prev" in
@VALUES@
        *)
            case "$verb" in
@PLACES@
            esac
            [[ $cur == -* || -z $words$files ]] && words=$options files=
            ;;
    esac
    mapfile -t COMPREPLY < <(
        compgen -W "$words" -- "$cur"
        case $files in
            file) compgen -f -- "$cur" ;;
            folder) compgen -d -- "$cur" ;;
            yaml) compgen -d -- "$cur"; compgen -f -X '!*.yaml' -- "$cur" ;;
        esac
    )
    [[ $files ]] && compopt -o filenames 2> /dev/null
    return 0
}
complete -F _mrmg mrmg
"""


def _bash(verbs: _Verbs) -> str:
    def found(argument: _Argument) -> str:
        return f"words={shlex.quote(' '.join(argument.words))} files={argument.files}"

    values, places = [], []
    for name, arguments in verbs.items():
        flags = [flag for argument in arguments for flag in argument.flags]
        place = [found(argument) for argument in arguments if not argument.flags]
        line = " ".join([f"options={shlex.quote(' '.join(flags))}", *place[:1]])
        places.append(f'                "{name}") {line} ;;')
        for argument in arguments:
            if argument.flags and argument.value:
                spelled = "|".join(f'"{name} {flag}"' for flag in argument.flags)
                values.append(f"        {spelled}) {found(argument)} ;;")
    script = _BASH.replace("@VERBS@", _patterns(verbs, "|"))
    script = script.replace("@VALUES@", "\n".join(values))
    return script.replace("@PLACES@", "\n".join(places))


_ZSH = """\
#compdef mrmg
# Completion of mrmg in zsh; for ~/.zshrc, after compinit: eval "$(mrmg completion zsh)"
_mrmg() {
    local verb= i last=1
    for ((i = 2; i < CURRENT; i++)); do
        case "$verb ${words[i]}" in
            @VERBS@) verb="${verb:+$verb }${words[i]}" last=$i ;;
        esac
    done
    words=("${(@)words[last,-1]}")
    ((CURRENT -= last - 1))
    case "$verb" in
@PLACES@
    esac
}
if [[ $funcstack[1] == _mrmg ]]; then _mrmg "$@"; else compdef _mrmg mrmg; fi
"""
_ZSH_FILES = {
    "": "",
    "file": "_files",
    "folder": "_files -/",
    "yaml": '_files -g "*.yaml"',
}


def _zsh(verbs: _Verbs) -> str:
    def escaped(text: str) -> str:
        return re.sub(r"([^\w/.-])", r"\\\1", text)

    def value(argument: _Argument) -> str:
        if argument.files:
            names = " ".join(argument.words)
            action = f"{{compadd -- {names}; {_ZSH_FILES[argument.files]}}}"
        else:
            items = argument.words.items()
            shown = [f"{escaped(word)}\\:{escaped(text)}" for word, text in items]
            action = f"(({' '.join(shown)}))" if shown else " "
        return f":{escaped(argument.value)}:{action}"

    def specs(argument: _Argument) -> list[str]:
        if not argument.flags:
            return ["*" * argument.repeats + value(argument)]
        about = "[" + re.sub(r"([][:\\])", r"\\\1", argument.help) + "]"
        end = value(argument) if argument.value else ""
        return [f"{flag}{about}{end}" for flag in argument.flags]

    places = []
    for name, arguments in verbs.items():
        lines = [shlex.quote(spec) for item in arguments for spec in specs(item)]
        places.append(f'        "{name}") _arguments {" ".join(lines)} ;;')
    script = _ZSH.replace("@VERBS@", _patterns(verbs, "|"))
    return script.replace("@PLACES@", "\n".join(places))


_FISH = """\
# Completion of mrmg in fish; for config.fish: mrmg completion fish | source
function __mrmg_at
    set -l verb
    for word in (commandline -opc)[2..]
        switch "$verb $word"
            case @VERBS@
                set verb (string trim -- "$verb $word")
        end
    end
    test "$verb" = "$argv[1]"
end
complete -c mrmg -f
"""
_FISH_FILES = {
    "": "",
    "file": "-F",
    "folder": "-a '(__fish_complete_directories)'",
    "yaml": "-a '(__fish_complete_suffix .yaml)'",
}


def _fish(verbs: _Verbs) -> str:
    def quoted(text: str) -> str:
        return "'" + text.replace("\\", "\\\\").replace("'", "\\'") + "'"

    lines = [_FISH.replace("@VERBS@", _patterns(verbs, " "))]
    for name, arguments in verbs.items():
        for argument in arguments:
            start = f"complete -c mrmg -n {quoted(f'__mrmg_at {quoted(name)}')}"
            for flag in argument.flags:
                kind = "-l" if flag.startswith("--") else "-s"
                start += f" {kind} {flag.lstrip('-')}"
            about = quoted(argument.help)
            needs = ""
            if argument.flags and argument.value:
                needs = " -r" if argument.files == "file" else " -x"
            if argument.flags:
                lines.append(f"{start}{needs} -d {about}\n")
            for word, text in argument.words.items():
                lines.append(
                    f"{start}{needs} -a {word} -d {quoted(text) if text else about}\n"
                )
            if argument.files:
                lines.append(f"{start}{needs} {_FISH_FILES[argument.files]}\n")
    return "".join(lines)


def _patterns(verbs: Iterable[str], separator: str) -> str:
    """Return how a shell's case spells "verb so far" and "next word" of every verb."""
    words = [verb.rpartition(" ") for verb in verbs if verb]
    return separator.join(f'"{before} {word}"' for before, _, word in words)
