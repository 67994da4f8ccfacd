"""The `mrmg` command: arguments in, exit code out."""

from mrmg.cli.main import command, main

__all__ = ["command", "main"]
