"""Flags that end work before it is done: `halt`, shape (1,), set by whoever waits."""

from __future__ import annotations

import numpy as np

from mrmg.errors import MrmgError

NEVER = np.zeros(1, np.bool_)
"""A flag that is never set."""
NEVER.setflags(write=False)


class Halted(MrmgError):
    """Work was given up because its flag had been set."""


def check(halt: np.ndarray) -> None:
    """Give up if the flag is set.

    Raises:
        Halted: if it is.
    """
    if halt[0]:
        raise Halted("halted")
