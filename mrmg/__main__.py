"""`python -m mrmg` is the `mrmg` command."""

from mrmg.cli import command

if __name__ == "__main__":
    command()
