"""The `mrmg` command, also as `python -m mrmg`.

Ctrl-C is taken care of before anything heavy is imported.
"""

import io
import os
import signal
import sys
from contextlib import suppress
from typing import Any


def command() -> None:
    """Run the command line of this process, and end the process."""
    _make_streams_usable()
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
        signal.signal(signal.SIGINT, lambda number, frame: os._exit(130))
    from mrmg import interruption

    try:
        interruption.install()
        from mrmg.cli.main import main

        code = main()
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # what is left takes no time
        if interruption.is_pending():
            interruption.end(reported=code == interruption.EXIT_CODE)
        for stream in (sys.stdout, sys.stderr):
            with suppress(OSError):
                stream.flush()
    except BaseException:
        if interruption.is_pending():
            interruption.end()  # whatever became of the interrupt on its way
        raise
    # All is written. To take Python apart would be another tenth of a second, in which
    # Ctrl-C could not be answered.
    os._exit(code)


class _Heard(io.FileIO):
    """Messages to people, which keep no command from its work if nobody hears them."""

    def write(self, data: Any) -> int:
        """Write what can be written."""
        with suppress(OSError):
            return super().write(data)
        return len(data)


def _make_streams_usable() -> None:
    """Have what is printed escaped where its encoding lacks it, or lost where closed.

    What is opened in place of a closed stream takes its descriptor, too, which the next
    file to be written would have otherwise.
    """
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            lost = os.open(os.devnull, os.O_RDWR)
            setattr(sys, name, os.fdopen(lost, mode, closefd=False))
    sys.stderr = io.TextIOWrapper(
        io.BufferedWriter(_Heard(sys.stderr.fileno(), "w", closefd=False)),
        encoding=sys.stderr.encoding,
        errors="backslashreplace",
        line_buffering=True,
    )
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")


if __name__ == "__main__":
    command()
