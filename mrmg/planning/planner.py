"""From a scene to a plan: roadmap, tours, motion trees, the best of their finds."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache
from importlib.metadata import version

import numpy as np

from mrmg import seeding
from mrmg.accounting import battery_profile, find_visits, plan_ledger
from mrmg.errors import Fault, SceneError
from mrmg.mission import Plan, PlanResult, PlanStatus, Visit
from mrmg.planning.feasibility import proof_of_infeasibility
from mrmg.planning.motion_tree import Growth, Problem, grow_tree, state_problem
from mrmg.planning.parameters import PlannerParams
from mrmg.planning.roadmap import Roadmap, build_roadmap
from mrmg.planning.routing import solve_routing
from mrmg.scene.loading import scene_from_document
from mrmg.scene.types import Scene
from mrmg.world.world import World

Progress = Callable[[float, str], None]
"""Receives the fraction done, in [0, 1], and a short text."""

ROADMAPS = 3
"""Roadmaps built at most, each with three times the samples, to join all goals."""

MARGINS = (1.0, 0.0, 2.0)
"""Multiples of the route margin that successive trees are grown with."""

HOPELESS = 10
"""With a time limit, times the number of trees after which finding none ends it."""


@dataclass
class Statistics:
    """Counts and times of one planning run."""

    time_s: dict[str, float] = field(default_factory=dict)
    counts: dict[str, int] = field(default_factory=dict)
    improvements: list[dict[str, float]] = field(default_factory=list)
    started: float = field(default_factory=time.perf_counter)

    def elapsed(self) -> float:
        """Return the time since planning began [s]."""
        return time.perf_counter() - self.started

    def add(self, counts: dict[str, int]) -> None:
        """Add the counts of one tree."""
        for name, value in counts.items():
            self.counts[name] = self.counts.get(name, 0) + value

    def as_dict(self) -> dict[str, object]:
        """Return counts, times and improvements; the total time is the time so far."""
        first = self.time_s.get("first_solution", 0.0)
        times = {"init": 0.0, "routing": 0.0, **self.time_s, "first_solution": first}
        counts = {"vertices": 0, "groups": 0, "router_calls": 0, "expansions": 0}
        return {
            **counts,
            **self.counts,
            "improvements": self.improvements,
            "time_s": {**times, "total": self.elapsed()},
        }


def plan_mission(
    scene: Scene,
    *,
    seed: int = 0,
    params: PlannerParams | None = None,
    on_progress: Progress | None = None,
) -> PlanResult:
    """Plan a mission.

    Grows motion trees along routed tours until one visits all goals, then
    `params.improvements` more, each along tours of its own draw, and returns the
    cheapest.

    Args:
        scene: the mission.
        seed: of all random streams; same scene, seed and parameters give the same plan,
            unless `params.budget_s` ends the search.
        params: parameters; the default profile's if None.
        on_progress: told how far planning has got.
    """
    params = params or PlannerParams()
    tell = on_progress or (lambda fraction, text: None)
    if not scene.robots:
        fault = Fault("robots", "there are none; a mission needs at least one")
        raise SceneError(scene.name, [fault])
    compile_kernels()
    statistics = Statistics()
    problem = _problem(scene, seed, params)
    statistics.time_s["init"] = statistics.elapsed()
    tell(0.1, "roadmap built")
    best = _best_plan(problem, seed, params, statistics, tell)
    if best is not None:
        return PlanResult(
            status=PlanStatus.SOLVED,
            plan=best,
            reason="",
            statistics=statistics.as_dict(),
        )
    proof = proof_of_infeasibility(scene)
    return PlanResult(
        status=PlanStatus.TIMEOUT if proof is None else PlanStatus.INFEASIBLE,
        plan=None,
        reason=proof or _why_not(problem, statistics),
        statistics=statistics.as_dict(),
    )


@cache
def compile_kernels() -> None:
    """Compile or load every kernel, so that no time limit or figure includes it.

    Plans the smallest mission there is: types do not depend on a scene's size.
    """
    params = PlannerParams(samples=20, max_vertices=20, trees=1)
    document = {
        "format": 1,
        "name": "smallest",
        "bounds": [0, 0, 20, 10],
        "goals": [{"id": "g", "circle": {"center": [12, 5], "radius": 2}}],
        "battery": {"capacity_m": 100},
        "robots": [{"id": "r", "model": "car", "pose": [5, 5, 0]}],
    }
    scene = scene_from_document(document, source="smallest mission")
    _one_plan(_problem(scene, 0, params), 0, 0, params, Statistics())


def _problem(scene: Scene, seed: int, params: PlannerParams) -> Problem:
    """Build the roadmap, denser while it does not join all goals, and the problem."""
    world = World.from_scene(scene)
    samples = params.samples
    for attempt in range(ROADMAPS):
        roadmap = build_roadmap(
            scene,
            world,
            samples=samples,
            neighbours=params.neighbours,
            rng=seeding.stream(seed, "roadmap", attempt),
        )
        if not unjoined_goals(scene, roadmap):
            break
        samples *= 3
    return state_problem(scene, world, roadmap, params)


def unjoined_goals(scene: Scene, roadmap: Roadmap) -> list[str]:
    """Return the goals to which the roadmap knows no way for any robot."""
    joined = np.isfinite(roadmap.start_distance).any(axis=0)
    return [
        goal.id for goal, fine in zip(scene.goals, joined, strict=False) if not fine
    ]


def _why_not(problem: Problem, statistics: Statistics) -> str:
    unjoined = unjoined_goals(problem.scene, problem.roadmap)
    if unjoined:
        return (
            f"the roadmap found no way to {', '.join(unjoined)}, and no proof that "
            "there is none"
        )
    if "routing" not in statistics.time_s:
        return "the time limit was over before the first tours were drawn"
    if not statistics.counts:
        return "the router found no tours that keep every battery above its reserve"
    return "no motion tree reached all goals within its size and the time limit"


def _best_plan(
    problem: Problem,
    seed: int,
    params: PlannerParams,
    statistics: Statistics,
    tell: Progress,
) -> Plan | None:
    """Return the cheapest plan of several trees, each along tours of its own draw.

    With a time limit trees are grown until it is reached, else as many as the
    parameters say.
    """
    best: Plan | None = None
    found = number = 0
    while not _enough(number, found, params, statistics):
        plan = _one_plan(problem, seed, number, params, statistics)
        number += 1
        if plan is not None:
            found += 1
            statistics.time_s.setdefault("first_solution", statistics.elapsed())
            if best is None or plan.cost_J < best.cost_J:
                best = plan
                statistics.improvements.append(
                    {"time_s": statistics.elapsed(), "cost_J": plan.cost_J}
                )
        tell(_fraction(number, found, params, statistics), f"{found} plans")
    return best


def _enough(
    number: int, found: int, params: PlannerParams, statistics: Statistics
) -> bool:
    if params.budget_s is not None:
        hopeless = found == 0 and number >= HOPELESS * params.trees
        return statistics.elapsed() > params.budget_s or hopeless
    return found > params.improvements or number >= params.trees


def _fraction(
    number: int, found: int, params: PlannerParams, statistics: Statistics
) -> float:
    if params.budget_s is not None:
        done = statistics.elapsed() / params.budget_s
    else:
        done = max(number / params.trees, found / (1 + params.improvements))
    return 0.1 + 0.9 * min(done, 1.0)


def _one_plan(
    problem: Problem,
    seed: int,
    number: int,
    params: PlannerParams,
    statistics: Statistics,
) -> Plan | None:
    """Draw tours and grow a tree along them; return its plan, if it found one.

    The surcharge on the roadmap's energies changes from draw to draw: batteries may
    leave no room for it, or driving may take more than it allows for.
    """
    before = statistics.elapsed()
    margin = MARGINS[number % len(MARGINS)] * params.route_margin
    problem = problem.with_margin(margin)
    draw = seeding.stream_seed(seed, "tours", number)
    routing = solve_routing(problem.mission.routing, params.router, draw)
    spent = statistics.time_s.get("routing", 0.0)
    statistics.time_s["routing"] = spent + statistics.elapsed() - before
    if not routing.feasible:
        return None
    growth = grow_tree(
        problem, params, routing, seeding.stream_seed(seed, "tree", number)
    )
    statistics.add(dict(growth.counts))
    return _plan_of(problem, seed, params, growth) if growth.solved else None


def _plan_of(
    problem: Problem, seed: int, params: PlannerParams, growth: Growth
) -> Plan | None:
    """Return the plan of a solved tree, or None if exact accounting refuses it.

    The tree meters terrain on a grid; the ledger uses the exact areas.
    """
    scene = problem.scene
    visits: list[Visit] = []
    for trajectory in growth.trajectories:
        own = find_visits(scene, trajectory, growth.tours[trajectory.robot])
        battery = scene.robot(trajectory.robot).battery
        if battery_profile(scene, trajectory, own).min() < battery.reserve_J:
            return None
        visits += own
    visits.sort(key=lambda visit: (visit.step, visit.robot))
    return Plan(
        scene_name=scene.name,
        scene_digest=scene.digest,
        seed=seed,
        profile=params.profile,
        parameters_digest=params.digest,
        versions={
            name: version(name)
            for name in ("mrmg", "numba", "numpy", "scipy", "shapely")
        },
        dt_s=params.dt_s,
        trajectories=growth.trajectories,
        tours=growth.tours,
        visits=tuple(visits),
        ledger=plan_ledger(scene, growth.trajectories, visits),
    )
