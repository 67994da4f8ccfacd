"""A map that benches plan on."""

from __future__ import annotations

from pathlib import Path

import pytest

MAP = """\
[SCALE]
1
[BORDER]
0 0
60 0
60 40
0 40
[OBSTACLE]
25 10
35 10
35 30
25 30
"""


@pytest.fixture
def hall(tmp_path: Path) -> Path:
    """A hall of 60 x 40 m with a block in its middle."""
    path = tmp_path / "hall.txt"
    path.write_text(MAP)
    return path
