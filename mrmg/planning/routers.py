"""Routers: who visits which goals in which order, and recharges where."""

from __future__ import annotations

import operator
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Protocol

from mrmg import extensions
from mrmg.planning.bound.exact_tours import exact_routing
from mrmg.planning.routing._nrpa_kernels import RoutingArrays, with_own_tables
from mrmg.planning.routing.routing import (
    RouterParams,
    Routing,
    solve_routing,
)
from mrmg.planning.routing.routing_problem import RoutingProblem, faults_of_tours


class Router(Protocol):
    """Solves routing problems; `mrmg.testing.RouterContract` tests what it must keep.

    Tours visit every open goal once, keep every battery above its reserve and every
    tour within its limit; the cost is their energy. The same problem and seed give the
    same tours, on any thread.
    """

    def __call__(self, problem: RoutingProblem, seed: int) -> Routing:
        """Return tours, of infinite cost if none were found."""


@dataclass(frozen=True, slots=True)
class BuiltInRouter:
    """A router of this package, which also takes the arrays of its kernels.

    Robots alike may share their legs in these; a `RoutingProblem` has them for each.
    """

    params: RouterParams

    def __call__(self, problem: RoutingProblem, seed: int) -> Routing:
        """Return tours, of infinite cost if none were found."""
        return self.solve(problem.arrays, seed)

    def solve(self, problem: RoutingArrays, seed: int) -> Routing:
        """Return the same for the arrays of kernels."""
        return ROUTERS[self.params.method](self.params, problem, seed)


def solve(router: Router, problem: RoutingArrays, seed: int) -> Routing:
    """Return any router's tours for the arrays of kernels."""
    if isinstance(router, BuiltInRouter):
        return router.solve(problem, seed)
    return router(RoutingProblem.of(problem), seed)


def search(params: RouterParams, problem: RoutingArrays, seed: int) -> Routing:
    """Find tours by ruin and recreate."""
    return solve_routing(problem, params, seed)


def nrpa(params: RouterParams, problem: RoutingArrays, seed: int) -> Routing:
    """Find tours by nested rollout policy adaptation alone."""
    return solve_routing(problem, replace(params, rounds=0), seed)


def exact(params: RouterParams, problem: RoutingArrays, seed: int) -> Routing:
    """Return the cheapest tours, or those of `search` where `exact_routing` has none.

    It has none where the mission is too large, or has an option that it does not know.
    """
    best = exact_routing(with_own_tables(problem))
    return search(params, problem, seed) if best is None else best


ROUTERS: Mapping[str, Callable[[RouterParams, RoutingArrays, int], Routing]] = (
    MappingProxyType({"search": search, "nrpa": nrpa, "exact": exact})
)
"""The routers of this package by name."""


def find_router(params: RouterParams, own: Router | None = None) -> Router:
    """Return the router that parameters name.

    Args:
        params: with its name.
        own: a caller's own that has this name.

    Raises:
        UsageError: if there is none of that name.
        MachineError: if the package that adds it is broken.
    """
    name = params.method
    if own is None and name in ROUTERS:
        return BuiltInRouter(params)
    return checked(own or extensions.load(extensions.ROUTERS, name), name)


def checked(router: Router, name: str) -> Router:
    """Return a router whose tours are refused if they break their rules."""

    def route(problem: RoutingProblem, seed: int) -> Routing:
        found = router(problem, seed)
        try:
            tours = [tuple(map(operator.index, tour)) for tour in found.tours]
            routing = Routing(tuple(tours), float(found.cost_J))
        except (AttributeError, TypeError, ValueError) as error:
            what = f"returned {found!r}, not a Routing with tours of whole numbers"
            raise extensions.fault(extensions.ROUTERS, name, what) from error
        faults = "; ".join(faults_of_tours(problem, routing))
        if faults:
            what = f"returned wrong tours: {faults}"
            raise extensions.fault(extensions.ROUTERS, name, what)
        return routing

    return route
