"""Groups of vertices: their keys, their lists, eq. (5), and the drawing of vertices."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np
import pytest

from mrmg.planning.parameters import PlannerParams
from mrmg.planning.tree._groups_kernels import (
    AGAIN,
    NEAREST_SHARE,
    Groups,
    Tree,
    add_to_group,
    group_key,
    group_weight,
    new_groups,
    new_tree,
    select_vertex,
)
from mrmg.planning.tree._mission_kernels import TreeParams
from mrmg.planning.tree.motion_tree import tree_params

REGION_M = 6.0
INITIAL_J = 1000.0

Key = tuple[tuple[int, ...], tuple[bool, ...]]


def params_of(**changes: Any) -> TreeParams:
    return tree_params(PlannerParams(region_m=REGION_M, **changes))


def meaning(state: np.ndarray, visited: np.ndarray) -> Key:
    """Return what a key stands for: the regions of all robots and the visited goals."""
    cells = np.floor(state[:, :2] / REGION_M).astype(int).ravel()
    return tuple(cells.tolist()), tuple(visited.tolist())


def random_tree(
    seed: int, *, n: int = 400, robots: int = 2, goals: int = 3, spread_m: float = 15.0
) -> tuple[Tree, Groups, int]:
    """Return a tree of n unconnected vertices, some alike, in their groups."""
    rng = np.random.default_rng(seed)
    tree = new_tree(n, robots, goals, 1)
    tree.state[:, :, :2] = rng.uniform(-spread_m, spread_m, (n, robots, 2))
    tree.visited[:] = rng.random((n, goals)) < 0.5
    tree.remaining[:] = rng.uniform(0.0, 1.2 * INITIAL_J, n)
    groups, count = new_groups(n), np.int64(0)
    for v in range(n):
        count = add_to_group(groups, tree, count, np.int64(v), REGION_M)
    return tree, groups, int(count)


def members(groups: Groups, tree: Tree, g: int) -> list[int]:
    """Return a group's vertices by walking its list."""
    found, v = [], int(groups.first[g])
    while v >= 0:
        found.append(v)
        assert len(found) <= len(tree.parent), "a circle"
        v = int(tree.sibling[v])
    return found


@pytest.mark.parametrize(("robots", "goals"), [(1, 1), (2, 3), (4, 0), (3, 12)])
def test_keys_are_equal_exactly_where_regions_and_goals_are(
    robots: int, goals: int
) -> None:
    rng = np.random.default_rng(robots)
    key_of: dict[Key, int] = {}
    for spread_m in (8.0, 100.0):
        for _ in range(4000):
            state = rng.uniform(-spread_m, spread_m, (robots, 5))
            visited = rng.random(goals) < 0.3
            key = int(group_key(state, visited, np.zeros(robots), REGION_M))
            assert key_of.setdefault(meaning(state, visited), key) == key
    assert len(set(key_of.values())) == len(key_of)
    assert len(key_of) > 100


def test_the_order_of_robots_counts() -> None:
    """Two robots that have changed places are in another group."""
    state = np.array([[1.0, 2.0, 0, 0, 0], [20.0, 30.0, 0, 0, 0]])
    visited = np.zeros(1, bool)
    still = np.zeros(2)
    turned = group_key(state[::-1], visited, still, 6.0)
    assert group_key(state, visited, still, 6.0) != turned


def test_a_region_holds_its_lower_edge_and_not_its_upper() -> None:
    keys = [
        group_key(np.array([[x, 0.0, 0, 0, 0]]), np.zeros(0, bool), np.zeros(1), 6.0)
        for x in (-6.0, -0.001, 0.0, 5.999, 6.0)
    ]
    assert keys[0] == keys[1]
    assert keys[2] == keys[3]
    assert len(set(keys)) == 3


@pytest.mark.parametrize("seed", range(3))
def test_lists_hold_every_vertex_once_among_its_like(seed: int) -> None:
    tree, groups, count = random_tree(seed)
    meanings = set()
    walked: Counter[int] = Counter()
    for g in range(count):
        own = members(groups, tree, g)
        walked.update(own)
        assert len(own) == groups.size[g]
        assert {int(tree.group[v]) for v in own} == {g}
        alike = {meaning(tree.state[v], tree.visited[v]) for v in own}
        assert len(alike) == 1
        meanings |= alike
        assert groups.remaining[g] == tree.remaining[own].min()
        assert groups.unvisited[g] == (~tree.visited[own[0]]).sum()
    assert walked == Counter(range(len(tree.parent)))
    assert len(meanings) == count
    assert max(groups.size) > 1


def test_the_table_holds_as_many_groups_as_vertices() -> None:
    tree, _, count = random_tree(1, n=300, robots=4, goals=8, spread_m=500.0)
    assert count == len(tree.parent)


@pytest.mark.parametrize("unvisited", [0, 1, 4])
@pytest.mark.parametrize("visits", [0, 1, 37])
def test_the_weight_is_equation_5(unvisited: int, visits: int) -> None:
    """w = lambda^visits (alpha / |unvisited| + beta dist)."""
    params = params_of(group_alpha=1.5, group_beta=3.0, group_lambda=0.9)
    groups = new_groups(2)
    groups.unvisited[1], groups.visits[1] = unvisited, visits
    groups.remaining[1] = 0.25 * INITIAL_J
    weight = 0.9**visits * (1.5 / max(unvisited, 1) + 3.0 * 0.75)
    assert group_weight(groups, 1, params, INITIAL_J) == pytest.approx(
        weight, rel=1e-14
    )


def test_every_visit_of_a_group_lowers_its_weight_by_lambda() -> None:
    params = params_of(group_lambda=0.97, group_bias=1.0)
    tree, groups, count = random_tree(5)
    random = np.array([3], np.uint64)
    for _ in range(50):
        before = [group_weight(groups, g, params, INITIAL_J) for g in range(count)]
        v = select_vertex(groups, tree, count, params, INITIAL_J, random)
        chosen = tree.group[v]
        assert before[chosen] == max(before)
        after = group_weight(groups, chosen, params, INITIAL_J)
        assert after == pytest.approx(0.97 * before[chosen], rel=1e-12)


def test_groups_are_drawn_in_proportion_to_their_weights() -> None:
    """With lambda = 1 the weights stay; negative ones count as none."""
    params = params_of(group_lambda=1.0, group_bias=0.0, group_beta=2.0)
    tree, groups, count = random_tree(6, n=40, robots=1, goals=1)
    tree.remaining[:10] = 2.5 * INITIAL_J
    groups.remaining[:] = [
        min(tree.remaining[members(groups, tree, g)], default=np.inf)
        for g in range(len(groups.remaining))
    ]
    weight = np.array(
        [max(0.0, group_weight(groups, g, params, INITIAL_J)) for g in range(count)]
    )
    assert (weight == 0.0).any()
    random = np.array([9], np.uint64)
    drawn = np.zeros(count)
    n = 20_000
    for _ in range(n):
        v = select_vertex(groups, tree, count, params, INITIAL_J, random)
        drawn[tree.group[v]] += 1
    share = weight / weight.sum()
    spread = np.sqrt(share * (1.0 - share) / n)
    assert (np.abs(drawn / n - share) <= 4.5 * spread + 1e-9).all()


def test_within_a_group_the_nearest_is_taken_or_any() -> None:
    params = params_of()
    tree, groups, count = random_tree(7, n=12, robots=1, goals=0, spread_m=0.0)
    assert count == 1
    nearest = int(np.argmin(tree.remaining))
    random = np.array([4], np.uint64)
    drawn: Counter[int] = Counter()
    n = 6000
    for _ in range(n):
        tree.expanded[:] = 0
        v = select_vertex(groups, tree, count, params, INITIAL_J, random)
        drawn[int(v)] += 1
        assert tree.expanded[v] == 1
        assert tree.expanded.sum() == 1
    assert set(drawn) == set(range(12))
    expected = NEAREST_SHARE + (1.0 - NEAREST_SHARE) / 12
    assert drawn[nearest] / n == pytest.approx(expected, abs=0.03)


def test_expansions_count_as_way_so_that_turns_are_taken() -> None:
    """Two vertices 10 J apart: the farther one's turn comes after 10 / 5 expansions."""
    params = params_of()
    tree, groups, count = random_tree(8, n=2, robots=1, goals=0, spread_m=0.0)
    tree.remaining[:] = [500.0, 510.0]
    random = np.array([1], np.uint64)
    tree.expanded[:] = [int(10.0 / (AGAIN * INITIAL_J)) + 1, 0]
    drawn: Counter[int] = Counter()
    for _ in range(300):
        book = tree.expanded.copy()
        v = select_vertex(groups, tree, count, params, INITIAL_J, random)
        drawn[int(v)] += 1
        tree.expanded[:] = book
    assert drawn[1] > 200


@pytest.mark.parametrize("bias", [0.0, 0.5, 1.0])
def test_choices_are_a_function_of_the_seed_and_never_out_of_range(bias: float) -> None:
    params = params_of(group_bias=bias)

    def choices(seed: int) -> list[int]:
        tree, groups, count = random_tree(9, n=150)
        random = np.array([seed], np.uint64)
        found = [
            int(select_vertex(groups, tree, count, params, INITIAL_J, random))
            for _ in range(500)
        ]
        assert groups.visits.sum() == 500
        return found

    first = choices(1)
    assert choices(1) == first
    # A bias of 1 and groups of one vertex mostly leave little to chance.
    assert bias == 1.0 or choices(2) != first
    assert min(first) >= 0 and max(first) < 150


def test_a_choice_is_made_even_where_no_group_weighs_anything() -> None:
    """All groups farther from the end than the root: every weight is negative."""
    tree, groups, count = random_tree(10, n=30)
    groups.remaining[:] = 50.0 * INITIAL_J
    random = np.array([2], np.uint64)
    for bias in (0.0, 1.0):
        for _ in range(50):
            v = select_vertex(
                groups, tree, count, params_of(group_bias=bias), INITIAL_J, random
            )
            assert 0 <= v < 30
