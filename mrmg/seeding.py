"""Random streams by name: the same seed gives every part its own fixed stream."""

from __future__ import annotations

import hashlib

import numpy as np


def stream(seed: int, *names: str | int) -> np.random.Generator:
    """Return the generator that belongs to `names` under `seed`.

    Streams of different names are independent, so that drawing more numbers in one
    part of the planner never shifts the numbers of another.
    """
    return np.random.default_rng(np.random.PCG64DXSM(_entropy(seed, *names)))


def stream_seed(seed: int, *names: str | int) -> int:
    """Return a 63-bit integer for kernels that carry their own generator state."""
    return _entropy(seed, *names) & (2**63 - 1)


def _entropy(seed: int, *names: str | int) -> int:
    text = "/".join(str(part) for part in (seed, *names))
    return int.from_bytes(hashlib.sha256(text.encode()).digest()[:16], "little")
