"""Run mrmg beside planners and solvers of others; print a table, write JSONL.

Protocol: one run on one machine, peers and mrmg in turn, problem by problem, with the
same seeds; each solver uses one thread; kernels are compiled and loaded before anything
is timed. Times are wall-clock. `mrmg` is the default planner's first plan, or the
default router. Ratios are peer / mrmg, medians over the problems that both solve, with
95 % bootstrap intervals over them; cost is energy. `better` names what a peer is better
at: a ratio whose interval lies below 1, or more solved.

Legs: one or two cars from rest to rest within a circle each, on plain ground among the
obstacles of a scene, which is single-leg planning only, as OMPL assigns no goals and
has no batteries. OMPL (RRT, KPIECE1, EST, SST; their defaults, controls held for 1-10
steps of 0.1 s) plans with our law of motion, limits, margins and compiled checks of
footprints at each step, and reaches them through Python, which takes about a third of
its time. SST minimises OMPL's path length and is stopped after 5 and 20 s; the others
have 20 s. Plans of all are judged by `mrmg.verify`.

Tours: who visits which goals in which order, on mrmg's own energies: those of scenes
1-6, and generated ones. Robots start where they are, end anywhere, and have batteries
of their own. PyVRP has no recharging: on problems without stations the battery bounds
the route, else it routes without batteries, and frvcpy then places the charging stops.
OR-Tools has all constraints (each station has three optional nodes), and starts with
the tours of a nearest-goal rule where that finds some. frvcpy also places the stops in
the orders of mrmg's tours, which it is given. PyVRP and OR-Tools search for 1 and 5 s.
`mrmg, 10,000 rounds` is the default router with a longer search.

Missions: scenes 1-6 whole. `straight lines` is the plain baseline: nearest goal first,
recharge when low, straight-line following, which knows nothing of obstacles; `nearest
goal` is that rule on mrmg's roadmap with its motions; `paper` is the paper's method,
beside mrmg charged as in the paper (`energy: paper`).

Finished trials are kept in --output FILE: the same command goes on from there after an
interruption. Rows of --json: `peer`, `problem`, `limit_s`, `ok` and `mrmg_ok` of
`runs`, `time_s`, `mrmg_time_s`, `time_ratio`, `time_ratio_interval`, `cost`,
`mrmg_cost`, `cost_ratio`, `cost_ratio_interval`, `better`, `failures` by cause;
`packages` has `package`, `version`, `licence`.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache, partial
from importlib.metadata import version

import numpy as np
import peer_frvcpy
import peer_ompl
import peer_ortools
import peer_pyvrp
from bench import TABLE, charged
from bench_routing import generate
from examples.own_router import nearest_goal
from peer_comparison import tabulate
from peer_legs import LEGS, leg_of
from peer_trials import ompl_row, plain_row, planned, tour_row
from protocol import (
    Row,
    Trials,
    add_file_options,
    run,
    seed_range,
    versions,
    write_document,
)
from routing_missions import uneven_mission

import mrmg
from mrmg.planning import Routing, RoutingProblem, plan_mission, profile_params
from mrmg.planning.routers import find_router
from mrmg.planning.routing.routing import RouterParams

PEERS = ("ompl", "pyvrp", "ortools", "frvcpy", "baseline", "paper")

LICENCES = {
    "ompl": "BSD-3-Clause",
    "pyvrp": "MIT",
    "ortools": "Apache-2.0",
    "frvcpy": "Apache-2.0",
}
"""Of the packages, as their projects state them."""

LEG_LIMIT_S, SST_LIMITS_S = 20.0, (5.0, 20.0)

TOUR_LIMITS_S = (1.0, 5.0)

LONG_SEARCH = RouterParams(rounds=10_000)


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """A problem for one solver.

    Attributes:
        peer: the solver's name; "mrmg" is what all are compared with.
        problem: class of problems, a row of the table.
        instance: one of the class.
        solve: returns the trial's row.
        limit_s: for which it may search.
    """

    peer: str
    problem: str
    instance: str
    solve: Callable[[], Row]
    limit_s: float | None = None


def main() -> int:
    """Run the bench; return 1 if mrmg leaves a problem unsolved."""
    options = parse_options()
    packages = [
        {"package": name, "version": version(name), "licence": licence}
        for name, licence in LICENCES.items()
    ]
    print(f"{__doc__}\n{versions()}")
    for row in packages:
        print("{package} {version} ({licence})".format(**row))
    # What peers come to is of their versions.
    trials = Trials(
        options.output, **{row["package"]: row["version"] for row in packages}
    )
    rows = []
    for case in chosen_cases(options):
        key = {"peer": case.peer, "problem": case.problem, "limit_s": case.limit_s}
        row = trials.row(case.solve, instance=case.instance, **key)
        rows.append({**row, **key, "instance": case.instance})
        cells = (case.problem, case.instance, case.peer, case.limit_s, row["time_s"])
        print(" | ".join(map(str, cells)), row["cost"], row["why"], flush=True)
    table = tabulate(rows)
    ok = all(row["ok"] for row in rows if row["peer"] == "mrmg")
    write_document(options, "peers", table, ok, packages=packages)
    return 0 if ok else 1


def parse_options() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__,
        prog="tools/peers",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "--only", nargs="+", default=list(PEERS), choices=PEERS, metavar="PEER",
        help=f"some of {', '.join(PEERS)}; default all",
    )  # fmt: skip
    parser.add_argument(
        "--seeds", type=seed_range, default="0-4", help="first-last, default 0-4"
    )
    add_file_options(parser)
    return parser.parse_args()


def chosen_cases(options: argparse.Namespace) -> Iterator[Case]:
    """Yield the cases of the chosen peers, those of mrmg first in each problem."""
    chosen = set(options.only)
    for seed in options.seeds:
        if "ompl" in chosen:
            for problem in LEGS:
                yield from leg_cases(problem, seed)
        if chosen & {"pyvrp", "ortools", "frvcpy"}:
            yield from tour_cases(seed, chosen)
        for name in TABLE:
            yield from mission_cases(name, seed, chosen)


def leg_cases(problem: str, seed: int) -> Iterator[Case]:
    """Yield a leg for mrmg and for each of OMPL's planners."""
    scene, leg = leg_of(problem)
    same = {"problem": problem, "instance": str(seed)}
    yield Case(peer="mrmg", solve=partial(planned, scene, seed), **same)
    for planner in peer_ompl.PLANNERS:
        for limit_s in SST_LIMITS_S if planner == "SST" else (LEG_LIMIT_S,):
            solve = partial(ompl_row, leg, planner, seed, limit_s)
            yield Case(peer=f"OMPL {planner}", limit_s=limit_s, solve=solve, **same)


def tour_cases(seed: int, chosen: set[str]) -> Iterator[Case]:
    """Yield routing problems for mrmg, with and without a long search, and peers."""
    for name in TABLE:
        yield from routed(
            "scenes 1-6", f"{name} {seed}", scene_tours(name, seed), chosen
        )
    rng = np.random.default_rng
    small = next(
        problem
        for problem in map(generate, range(1000 * seed, 1000 * (seed + 1)))
        if nearest_goal(RoutingProblem.of(problem), 0).feasible
    )
    yield from routed("6-10 goals", str(seed), RoutingProblem.of(small), chosen)
    for goals, stations, range_m in ((40, 6, (150.0, 300.0)), (80, 0, (400.0, 700.0))):
        arrays = uneven_mission(
            rng(seed), goals=goals, stations=stations, robots=4, range_m=range_m
        )
        charging = "with" if stations else "without"
        problem = f"{goals} goals, {charging} stations"
        yield from routed(problem, str(seed), RoutingProblem.of(arrays), chosen)


@cache
def scene_tours(name: str, seed: int) -> RoutingProblem:
    """Return the routing problem of a scene's mission on the roadmap of a seed."""
    kept: list[RoutingProblem] = []

    def keep(problem: RoutingProblem, router_seed: int) -> Routing:
        kept.append(problem)
        return find_router(RouterParams())(problem, router_seed)

    plan_mission(mrmg.load_scene(name), seed=seed, router=keep)
    return kept[0]


def routed(
    name: str, instance: str, problem: RoutingProblem, chosen: set[str]
) -> Iterator[Case]:
    """Yield one routing problem for mrmg and the chosen peers."""
    seed = int(instance.rsplit(maxsplit=1)[-1])
    stations = problem.targets > problem.goals
    case = partial(Case, problem=name, instance=instance)
    router = find_router(RouterParams())
    router(problem, seed)
    best = router(problem, seed)
    row = partial(tour_row, problem)
    yield case(peer="mrmg", solve=partial(row, partial(router, problem, seed)))
    longer = partial(find_router(LONG_SEARCH), problem, seed)
    yield case(peer="mrmg, 10,000 rounds", solve=partial(row, longer))
    for limit_s in TOUR_LIMITS_S:
        if "pyvrp" in chosen:
            solve = partial(peer_pyvrp.solve, problem, seed, limit_s)
            peer = "PyVRP, then frvcpy" if stations else "PyVRP"
            yield case(peer=peer, limit_s=limit_s, solve=partial(row, solve))
        if "ortools" in chosen:
            first = nearest_goal(problem, seed).tours
            solve = partial(peer_ortools.solve, problem, limit_s, first)
            yield case(peer="OR-Tools", limit_s=limit_s, solve=partial(row, solve))
    if "frvcpy" in chosen and stations:
        orders = [
            [node for node in tour if node < problem.goals] for tour in best.tours
        ]
        solve = partial(peer_frvcpy.solve, problem, orders)
        yield case(peer="frvcpy, orders given", solve=partial(row, solve))


@cache
def load(*profiles: str) -> None:
    """Plan once with each profile, so that kernels are loaded."""
    for profile in profiles:
        plan_mission(mrmg.load_scene("quickstart"), params=profile_params(profile))


def mission_cases(name: str, seed: int, chosen: set[str]) -> Iterator[Case]:
    """Yield a whole mission for mrmg, the baseline and the paper's method."""
    load("default", *chosen & {"paper"})
    if "baseline" in chosen:
        scene = mrmg.load_scene(name)
        case = partial(Case, problem="missions", instance=f"{name} {seed}")
        yield case(peer="mrmg", solve=partial(planned, scene, seed))
        yield case(peer="straight lines", solve=partial(plain_row, scene))
        nearest = partial(planned, scene, seed, nearest_goal)
        yield case(peer="nearest goal", solve=nearest)
    if "paper" in chosen:
        scene = charged(mrmg.load_scene(name), "paper")
        case = partial(
            Case, problem="missions, energy paper", instance=f"{name} {seed}"
        )
        yield case(peer="mrmg", solve=partial(planned, scene, seed))
        paper = partial(planned, scene, seed, profile="paper")
        yield case(peer="paper", solve=paper)


if __name__ == "__main__":
    run(main)
