"""Generated routing problems: missions over uneven ground."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mrmg.planning.routing._nrpa_kernels import RoutingArrays
from mrmg.planning.routing.instance import RoutingInstance

BATTERIES = {"recharged": (100.0, 140.0), "sufficient": (500.0, 800.0)}
"""Between these lies the way that full batteries last for in large missions [m]: robots
must recharge several times, or hardly."""

GOALS_PER_ROBOT, GOALS_PER_STATION = 25, 10


def large_mission(seed: int, goals: int, batteries: str) -> RoutingArrays:
    """Return a mission of many goals with one of the kinds of BATTERIES."""
    return uneven_mission(
        np.random.default_rng(seed),
        goals=goals,
        stations=goals // GOALS_PER_STATION,
        robots=max(1, goals // GOALS_PER_ROBOT),
        range_m=BATTERIES[batteries],
    )


def uneven_mission(
    rng: np.random.Generator,
    *,
    goals: int,
    stations: int,
    robots: int,
    range_m: tuple[float, float],
    open_goal: Sequence[bool] | None = None,
) -> RoutingArrays:
    """Return a mission over 100 x 100 m of uneven ground.

    Ways cost up to 1.6 times their length, and are shortened through each other, so
    that they are a metric, as shortest paths are.

    Args:
        rng: draws everything.
        goals: how many.
        stations: how many.
        robots: how many.
        range_m: between these lies the way a full battery lasts for.
        open_goal: which goals are still to be visited; all if None.
    """
    targets = goals + stations
    point = rng.uniform(0.0, 100.0, (targets + robots, 2))
    way = np.hypot(*(point[:, None] - point[None]).transpose(2, 0, 1))
    rough = rng.uniform(1.0, 1.6, way.shape)
    way *= np.maximum(rough, rough.T)
    for k in range(len(way)):
        way = np.minimum(way, way[:, k : k + 1] + way[k : k + 1])
    plain = rng.uniform(80.0, 120.0, robots)
    capacity = plain * rng.uniform(*range_m, robots)
    problem = RoutingInstance(
        goals=goals,
        distance=np.repeat(way[None, :targets, :targets], robots, axis=0),
        start_distance=way[targets:, :targets],
        plain=plain,
        energy=capacity * rng.uniform(0.5, 1.0, robots),
        capacity=capacity,
        reserve=0.05 * capacity,
    ).arrays
    if open_goal is None:
        return problem
    return problem._replace(open_goal=np.array(open_goal))
