"""The routers by name: whoever asks for tours asks here."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Protocol

from mrmg.planning.bound.exact_tours import exact_routing
from mrmg.planning.routing._nrpa_kernels import RoutingArrays
from mrmg.planning.routing.routing import RouterParams, Routing, solve_routing


class Router(Protocol):
    """Solves routing problems.

    Tours visit every open goal once, keep every battery above its reserve and every
    route within its limit; the cost is theirs. The same seed gives the same tours.
    """

    def __call__(
        self, problem: RoutingArrays, params: RouterParams, seed: int
    ) -> Routing:
        """Return tours, of infinite cost if none were found."""


def _nrpa_alone(problem: RoutingArrays, params: RouterParams, seed: int) -> Routing:
    return solve_routing(problem, replace(params, rounds=0), seed)


def _exact(problem: RoutingArrays, params: RouterParams, seed: int) -> Routing:
    best = exact_routing(problem)
    return solve_routing(problem, params, seed) if best is None else best


ROUTERS: Mapping[str, Router] = MappingProxyType(
    {"nrpa": _nrpa_alone, "search": solve_routing, "exact": _exact}
)
"""nrpa: nested rollout policy adaptation alone; search: improved by ruin and recreate;
exact: the cheapest tours there are, or those of `search` where the mission is too large
or has an option that exact tours do not know (`exact_routing`)."""


def route(problem: RoutingArrays, params: RouterParams, seed: int) -> Routing:
    """Solve a routing problem with the router that the parameters name."""
    return ROUTERS[params.method](problem, params, seed)
