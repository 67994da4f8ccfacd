"""The search over motions has room for all that it may come to."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from mrmg.planning.path_following.coordination.coordination import ROUNDS, empty_nodes
from mrmg.planning.path_following.coordination.tasks import no_path, task_of
from mrmg.planning.problem.problem import Problem
from mrmg.scene.types import Scene

OTHERS = 6
"""To track, hold, wait, stay, visit and end."""


@pytest.mark.parametrize("model", ["car", "diffdrive", "husky"])
def test_the_table_of_cells_is_never_full(
    yard: Callable[..., Scene], state: Callable[..., Problem], model: str
) -> None:
    """A full one would be looked through for ever, as keys without nodes count, too."""
    robots = [{"id": "r", "model": model, "pose": [6, 10, 0]}]
    problem = state(yard(robots=robots), samples=50)
    for effort in ROUNDS:
        task = task_of(problem, 0, [], no_path(problem, 0), effort)
        keys = effort.most * (len(task.motion) + OTHERS)
        assert len(empty_nodes(task).table) > keys
