"""Entry point: run a command, and turn every way it can end into an exit code."""

from __future__ import annotations

import errno
import gc
import os
import sys
import warnings
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

from mrmg import interruption
from mrmg.cli.parser import make_parser
from mrmg.errors import ExitCode, MrmgError

LONGEST_LINE = 450
"""Characters of a message's line; a damaged file may have names of thousands."""

MOST_NEW_OBJECTS = 50_000
"""New objects after which there is a search for garbage."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line `arguments` (those of the process if None).

    Returns:
        The exit code; errors go to stderr, by their message alone.
    """
    options = make_parser().read(sys.argv[1:] if arguments is None else arguments)
    # What imports make stays: to search it for garbage again and again takes a tenth of
    # the time of a short command.
    gc.set_threshold(MOST_NEW_OBJECTS)
    if not sys.warnoptions:
        warnings.simplefilter("ignore")  # of libraries, to programmers
    code = ExitCode.OK
    try:
        code = options.command(options) or code
        sys.stdout.flush()
        return int(code)
    except MrmgError as error:
        return _refused(str(error), error.exit_code)
    except KeyboardInterrupt:
        print(interruption.MESSAGE, file=sys.stderr)
        return interruption.EXIT_CODE
    except OSError as error:
        if error.errno == errno.EPIPE:
            # The reader of our output has gone; nothing is left to be written.
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            return int(code)
        return _unusable(error)
    except MemoryError:
        remedy = "end other programs, raise the limit of memory, or use fewer --workers"
        return _refused(f"not enough memory; {remedy}", ExitCode.MACHINE)
    except Exception as error:
        altered = [*_altered_files(vars(options).values())]
        if not altered:
            raise
        reason = f"{type(error).__name__}: {error}".partition("\n")[0]
        message = "not as this version of mrmg wrote it, and of no use"
        remedy = "'mrmg run SCENE --out RUN --overwrite' makes all anew"
        text = f"{altered[0]}: {message} ({reason}); {remedy}"
        return _refused(text, ExitCode.INVALID_FILE)


def _unusable(error: OSError) -> int:
    """Print why a file or folder cannot be used, and what to do if it was named."""
    if isinstance(error, IsADirectoryError):
        message = f"{error.filename} is a folder; name a file instead"
        return _refused(message, ExitCode.USAGE)
    if isinstance(error, FileExistsError | NotADirectoryError):
        message = f"{error.filename} is a file, and a folder is needed there"
        return _refused(f"{message}; name another place", ExitCode.USAGE)
    about = f"{error.filename}: {error.strerror}" if error.filename else error
    return _refused(f"cannot read or write {about}", ExitCode.MACHINE)


def _refused(text: str, code: ExitCode) -> int:
    """Print why a command ends with an exit code."""
    print(_printable(f"mrmg: {text}"), file=sys.stderr)
    return int(code)


def _altered_files(values: Iterable[Any]) -> Iterator[Path]:
    """Yield the files of all run folders among `values` that their runs did not leave.

    Files that people or disks changed may contradict each other in any way, which no
    reader can foresee; what goes wrong with files that mrmg wrote is a fault of mrmg.
    """
    from mrmg.runs.folder import RunFolder

    for value in values:
        if isinstance(value, (str, Path)) and Path(value, "run.json").is_file():
            folder = RunFolder(Path(value))
            yield from (folder.file(name) for name in folder.altered())
        elif isinstance(value, list):
            yield from _altered_files(value)


def _printable(text: str) -> str:
    """Return a message in lines to be read, without what a terminal would act on."""
    shown = "".join(
        sign if sign.isprintable() or sign == "\n" else repr(sign)[1:-1]
        for sign in text
    )
    return "\n".join(
        line if len(line) <= LONGEST_LINE else f"{line[:300]} ... {line[-100:]}"
        for line in shown.split("\n")
    )
