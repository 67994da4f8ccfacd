"""The search over motions has room for all that it may come to."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from mrmg.planning.path_following.coordination.coordination import (
    ROUNDS,
    WAYS_ON,
    empty_nodes,
)
from mrmg.planning.path_following.coordination.tasks import motions
from mrmg.planning.problem.problem import Problem
from mrmg.scene.types import Scene

OTHERS = 5
"""To track, hold, wait, stay and visit."""


@pytest.mark.parametrize("model", ["car", "diffdrive", "husky"])
def test_the_table_of_cells_is_never_full(
    yard: Callable[..., Scene], state: Callable[..., Problem], model: str
) -> None:
    """A full one would be looked through for ever, as keys without nodes count, too."""
    robots = [{"id": "r", "model": model, "pose": [6, 10, 0]}]
    problem = state(yard(robots=robots), samples=50)
    for effort in ROUNDS:
        pairs = motions(problem.mission.fleet[0], 5, problem.dt_s)
        assert len(pairs) + OTHERS <= WAYS_ON
        keys = effort.most * (len(pairs) + OTHERS)
        assert len(empty_nodes(effort.most).table) > keys
