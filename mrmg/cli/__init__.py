"""The `mrmg` command: arguments in, exit code out."""
