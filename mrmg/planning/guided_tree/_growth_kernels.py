"""Algorithm 1 after ConstructPRM: the motion tree grows until the mission is solved."""

from __future__ import annotations

import numpy as np

from mrmg.compilation import kernel
from mrmg.planning.guided_tree._expansion_kernels import (
    extend_towards,
    insert,
    stop_freely,
)
from mrmg.planning.guided_tree._selection_kernels import (
    sample_target,
    select_group,
    select_vertex,
)
from mrmg.planning.guided_tree._tree_kernels import ITERATIONS
from mrmg.planning.routing._random_kernels import random_unit


@kernel
def grow(setting, rules, start, energy, tree, halt):
    """Grow the tree: lines 3-9 of Algorithm 1.

    Args:
        setting: the mission.
        rules: `Rules`.
        start: composite state at the start, shape (R, 5).
        energy: battery contents at the start [J], shape (R,).
        tree: `MotionTree`, empty; filled.
        halt: shape (1,); another thread may turn it true to end the search.

    Returns:
        (The vertex at which all goals are visited and a collision-free stop exists, or
        -1, and the steps of that stop).
    """
    trace, counts, none = tree.trace, tree.counts, np.int64(-1)
    # 3: Insert(q_init); the root has no parent and gets CreateNewTour.
    root = insert(setting, rules, tree, none, none, start, energy)
    if root < 0:
        return none, none
    if tree.groups.unvisited[tree.vertices.group[root]] == 0:
        return root, stop_freely(setting, rules, start, energy, tree.stop)
    # 4: until solved, or the cap on iterations is reached
    while counts[ITERATIONS] < rules.iterations and not halt[0]:
        i = counts[ITERATIONS]
        trace.scale[i] = tree.groups.scale[0]
        # 5: SelectGroup
        g = select_group(tree, rules, trace.group_draw[i])
        # 6: SelectVertex
        trace.vertex_draw[i] = random_unit(tree.random)
        v = select_vertex(tree, rules, g, trace.vertex_draw[i])
        trace.group[i], trace.vertex[i] = g, v
        # 7-8: GetTour, SampleTarget
        sample_target(setting, rules, tree, v, trace.target[i])
        # 9: ExtendTowards
        solution, steps = extend_towards(setting, rules, tree, v, i)
        counts[ITERATIONS] += 1
        if solution >= 0:
            return solution, steps
    return none, none
