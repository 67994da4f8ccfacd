"""The `mrmg` command: arguments in, exit code out."""

from mrmg.cli.main import main

__all__ = ["main"]
