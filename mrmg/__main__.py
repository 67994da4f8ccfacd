"""`python -m mrmg` is the `mrmg` command."""

import sys

from mrmg.cli import main

if __name__ == "__main__":
    sys.exit(main())
