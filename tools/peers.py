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
import statistics
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from importlib.metadata import version
from typing import Any

import numpy as np
import peer_motion
import peer_routing
from bench import TABLE, charged
from bench_routing import generate, uneven_mission
from examples.own_router import nearest_goal
from mission_tables import median_interval
from peer_baseline import StuckError, plain_plan
from protocol import (
    Row,
    Trials,
    add_file_options,
    run,
    seed_range,
    versions,
    write_document,
)

import mrmg
from mrmg.planning import (
    PlannerParams,
    Routing,
    RoutingProblem,
    faults_of_tours,
    plan_mission,
    profile_params,
)
from mrmg.planning.routers import find_router
from mrmg.planning.routing.routing import RouterParams
from mrmg.plans import Plan
from mrmg.scene.loading import scene_from_document
from mrmg.scene.types import Scene

PEERS = ("ompl", "pyvrp", "ortools", "frvcpy", "baseline", "paper")

LICENCES = {
    "ompl": "BSD-3-Clause",
    "pyvrp": "MIT",
    "ortools": "Apache-2.0",
    "frvcpy": "Apache-2.0",
}
"""Of the packages, as their projects state them."""

LEGS = {
    "quickstart, 1 car": ("quickstart", ("g2",)),
    "quickstart, 2 cars": ("quickstart", ("g2", "g3")),
    "scene1, 1 car": ("scene1", ("g5",)),
}
"""Scene of each leg, and the goals where its first cars end."""

AMPLE_M = 10_000.0
"""Range of the batteries on a leg [m]: no limit."""

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
    trials = Trials(options.output)
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
    for planner in peer_motion.PLANNERS:
        for limit_s in SST_LIMITS_S if planner == "SST" else (LEG_LIMIT_S,):
            solve = partial(ompl_row, leg, planner, seed, limit_s)
            yield Case(peer=f"OMPL {planner}", limit_s=limit_s, solve=solve, **same)


@cache
def leg_of(problem: str) -> tuple[Scene, peer_motion.Leg]:
    """Return a leg as a scene, planned once to load kernels, and for OMPL."""
    name, goals = LEGS[problem]
    document = dict(mrmg.load_scene(name).document)
    regions = {goal["id"]: goal for goal in document["goals"]}
    robots = [
        {**robot, "finish": {"circle": regions[goal]["circle"]}}
        for robot, goal in zip(document["robots"], goals, strict=False)
    ]
    for left_out in ("goals", "stations", "terrain"):
        document.pop(left_out, None)
    document |= {"robots": robots, "battery": {"capacity_m": AMPLE_M}}
    scene = scene_from_document(document, source=problem)
    plan_mission(scene)
    return scene, peer_motion.Leg.of(scene, PlannerParams())


def planned(scene: Scene, seed: int, router: Any = None, **profile: Any) -> Row:
    """Return the row of mrmg's first plan, or of what a profile or router gives."""
    params = replace(profile_params(**profile), improvements=0)
    own = {} if router is None else {"router": router}
    began = time.perf_counter()
    result = plan_mission(scene, seed=seed, params=params, **own)
    took_s = time.perf_counter() - began
    return judged(scene, result.plan, took_s, result.reason)


def judged(scene: Scene, plan: Plan | None, took_s: float, why: str) -> Row:
    """Return the row of a plan, judged by the verifier."""
    if plan is None:
        return {"ok": False, "time_s": took_s, "cost": None, "why": [why]}
    verdict = mrmg.verify(scene, plan)
    causes = sorted({violation.kind.value for violation in verdict.violations})
    return {"ok": verdict.ok, "time_s": took_s, "cost": plan.cost_J, "why": causes}


def ompl_row(leg: peer_motion.Leg, planner: str, seed: int, limit_s: float) -> Row:
    """Return the row of one of OMPL's planners."""
    controls, took_s = peer_motion.solve(leg, planner, seed, limit_s)
    plan = None if controls is None else leg.plan(controls)
    return judged(leg.scene, plan, took_s, "time over")


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
            solve = partial(by_pyvrp, problem, seed, limit_s)
            peer = "PyVRP, then frvcpy" if stations else "PyVRP"
            yield case(peer=peer, limit_s=limit_s, solve=partial(row, solve))
        if "ortools" in chosen:
            first = nearest_goal(problem, seed).tours
            solve = partial(peer_routing.ortools, problem, limit_s, first)
            yield case(peer="OR-Tools", limit_s=limit_s, solve=partial(row, solve))
    if "frvcpy" in chosen and stations:
        orders = [
            [node for node in tour if node < problem.goals] for tour in best.tours
        ]
        solve = partial(peer_routing.frvcpy, problem, orders)
        yield case(peer="frvcpy, orders given", solve=partial(row, solve))


def by_pyvrp(problem: RoutingProblem, seed: int, limit_s: float) -> Routing:
    """Return PyVRP's tours, with charging stops by frvcpy where there are stations."""
    stations = problem.targets > problem.goals
    found = peer_routing.pyvrp(problem, seed, limit_s, battery=not stations)
    if not stations or not found.feasible:
        return found
    return peer_routing.frvcpy(problem, found.tours)


def tour_row(problem: RoutingProblem, solve: Callable[[], Routing]) -> Row:
    """Return the row of tours, judged by mrmg's rules of tours."""
    began = time.perf_counter()
    routing = solve()
    took_s = time.perf_counter() - began
    if not routing.feasible:
        return {"ok": False, "time_s": took_s, "cost": None, "why": ["no tours"]}
    faults = list(faults_of_tours(problem, routing))
    return {
        "ok": not faults, "time_s": took_s, "cost": routing.cost_J, "why": faults[:1]
    }  # fmt: skip


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


def plain_row(scene: Scene) -> Row:
    """Return the row of the plain baseline."""
    began = time.perf_counter()
    try:
        plan, why = plain_plan(scene), ""
    except StuckError as error:
        plan, why = None, str(error)
    return judged(scene, plan, time.perf_counter() - began, why)


def tabulate(rows: Sequence[Row]) -> list[Row]:
    """Print and return a row for each peer, problem and limit."""
    own = {
        (row["problem"], row["instance"]): row for row in rows if row["peer"] == "mrmg"
    }
    keys = dict.fromkeys(
        (row["problem"], row["peer"], row["limit_s"])
        for row in rows
        if row["peer"] != "mrmg"
    )
    print(
        "\nproblem | peer | limit s | ok | time s | / mrmg | cost / mrmg | better | "
        "failures"
    )
    table = []
    for problem, peer, limit_s in keys:
        found = [
            (row, own[problem, row["instance"]])
            for row in rows
            if (row["problem"], row["peer"], row["limit_s"]) == (problem, peer, limit_s)
        ]
        line = compared(found)
        table.append({"peer": peer, "problem": problem, "limit_s": limit_s, **line})
        print_row(table[-1])
    return table


def compared(pairs: Sequence[tuple[Row, Row]]) -> Row:
    """Return a peer's line: pairs of its trials and mrmg's."""
    both = [(peer, own) for peer, own in pairs if peer["ok"] and own["ok"]]
    causes = Counter(
        cause for peer, _ in pairs if not peer["ok"] for cause in peer["why"]
    )
    line: Row = {
        "ok": sum(peer["ok"] for peer, _ in pairs),
        "mrmg_ok": sum(own["ok"] for _, own in pairs),
        "runs": len(pairs),
        "failures": dict(causes.most_common()),
    }
    better = ["success"] if line["ok"] > line["mrmg_ok"] else []
    for key, name in (("time_s", "time"), ("cost", "cost")):
        ratios = [peer[key] / own[key] for peer, own in both]
        interval = median_interval(ratios)
        line |= {
            key: statistics.median(peer[key] for peer, _ in both) if both else None,
            f"mrmg_{key}": statistics.median(own[key] for _, own in both)
            if both
            else None,
            f"{name}_ratio": statistics.median(ratios) if ratios else None,
            f"{name}_ratio_interval": interval,
        }
        if interval[1] is not None and interval[1] < 1.0:
            better.append(name)
    return {**line, "better": better}


def print_row(row: Row) -> None:
    """Print a line of the table."""

    def ratio(name: str) -> str:
        low, high = row[f"{name}_interval"]
        if row[name] is None:
            return "-"
        return f"{row[name]:.4g}" + (f" [{low:.4g}, {high:.4g}]" if low else "")

    cells = [
        row["problem"],
        row["peer"],
        "-" if row["limit_s"] is None else f"{row['limit_s']:g}",
        f"{row['ok']}/{row['runs']} (mrmg {row['mrmg_ok']})",
        "-" if row["time_s"] is None else f"{row['time_s']:.3f}",
        ratio("time_ratio"),
        ratio("cost_ratio"),
        ", ".join(row["better"]) or "-",
        ", ".join(f"{cause}: {n}" for cause, n in row["failures"].items()) or "-",
    ]
    print(" | ".join(cells))


if __name__ == "__main__":
    run(main)
