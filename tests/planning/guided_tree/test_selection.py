"""How often groups and vertices are drawn, on a tree that does not change."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable

import numpy as np
import pytest
from scipy.stats import chisquare

from mrmg.planning.guided_tree._selection_kernels import select_group, select_vertex
from mrmg.planning.guided_tree.planner import rules_of

DRAWS = 10_000


def p_value(found: Counter[int], numbers: np.ndarray, chance: np.ndarray) -> float:
    """Return that of a chi-square test; what is expected < 5 times counts together."""
    counted = np.array([found[int(number)] for number in numbers])
    assert counted.sum() == DRAWS
    rare = DRAWS * chance < 5.0
    observed = np.append(counted[~rare], counted[rare].sum())
    expected = np.append(DRAWS * chance[~rare], DRAWS * chance[rare].sum())
    kept = expected > 0.0
    return float(chisquare(observed[kept], expected[kept]).pvalue)


@pytest.mark.parametrize("bias", [0.0, 0.4, 0.9])
def test_groups_are_drawn_by_weight_with_a_bias_to_the_heaviest(
    recorded: Callable, bias: float
) -> None:
    run = recorded(3, iterations=1500, decline=0.97, bias=bias)
    tree, method = run.growth.tree, run.params.guided_tree
    n, m = run.growth.counts["groups"], len(run.scene.goals)
    assert n >= 20
    groups = tree.groups
    beta = 0.01 * method.alpha / (m * groups.scale[0])
    weight = method.decline ** groups.visits[:n] * (
        method.alpha / np.maximum(groups.unvisited[:n], 1) + beta * groups.dist[:n]
    )
    chance = (1.0 - bias) * weight / weight.sum()
    chance[weight.argmax()] += bias
    fixed = tree._replace(random=np.array([2026], np.uint64))
    rules, draw = rules_of(run.problem, run.params), np.zeros(2)
    before = groups.visits[:n].copy()
    found = Counter(int(select_group(fixed, rules, draw)) for _ in range(DRAWS))
    assert np.array_equal(groups.visits[:n], before)
    assert p_value(found, np.arange(n), chance) > 0.001


def test_vertices_are_drawn_by_distance(recorded: Callable) -> None:
    run = recorded(3, iterations=1500)
    tree, spread = run.growth.tree, run.params.guided_tree.vertex_spread_m
    group = tree.vertices.group[: run.growth.counts["vertices"]]
    largest = int(np.bincount(group).argmax())
    own = np.flatnonzero(group == largest)
    assert len(own) >= 20
    chance = np.exp(-tree.vertices.to_target_m[own] / spread)
    rules = rules_of(run.problem, run.params)
    draws = np.random.default_rng(2026).random(DRAWS)
    found = Counter(int(select_vertex(tree, rules, largest, draw)) for draw in draws)
    assert p_value(found, own, chance / chance.sum()) > 0.001
