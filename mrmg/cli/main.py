"""Entry point: run a command, and turn every way it can end into an exit code."""

from __future__ import annotations

import errno
import gc
import os
import sys
from collections.abc import Sequence

from mrmg import interruption
from mrmg.cli.parser import make_parser
from mrmg.errors import ExitCode, MrmgError

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
    try:
        code = options.command(options)
        sys.stdout.flush()
        return int(code)
    except MrmgError as error:
        print(f"mrmg: {error}", file=sys.stderr)
        return int(error.exit_code)
    except KeyboardInterrupt:
        print(interruption.MESSAGE, file=sys.stderr)
        return interruption.EXIT_CODE
    except OSError as error:
        if error.errno == errno.EPIPE:
            # The reader of our output has gone; nothing is left to be written.
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            return int(ExitCode.OK)
        about = f"{error.filename}: {error.strerror}" if error.filename else error
        print(f"mrmg: cannot read or write {about}", file=sys.stderr)
        return int(ExitCode.MACHINE)
