"""From a scene to a plan: roadmap, tours, motion trees, the best of their finds."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from importlib.metadata import version

import numpy as np

from mrmg import seeding
from mrmg.accounting import battery_profile, find_visits, plan_ledger
from mrmg.mission import Plan, PlanResult, PlanStatus, Visit
from mrmg.planning.motion_tree import Growth, Problem, grow_tree, state_problem
from mrmg.planning.parameters import PlannerParams
from mrmg.planning.roadmap import build_roadmap
from mrmg.planning.routing import solve_routing
from mrmg.scene.types import Scene
from mrmg.world.world import World

Progress = Callable[[float, str], None]
"""Receives the fraction done, in [0, 1], and a short text."""


@dataclass
class Statistics:
    """Counts and times of one planning run."""

    time_s: dict[str, float] = field(default_factory=dict)
    counts: dict[str, int] = field(default_factory=dict)
    started: float = field(default_factory=time.perf_counter)

    def elapsed(self) -> float:
        """Return the time since planning began [s]."""
        return time.perf_counter() - self.started

    def add(self, counts: dict[str, int]) -> None:
        """Add the counts of one tree."""
        for name, value in counts.items():
            self.counts[name] = self.counts.get(name, 0) + value

    def as_dict(self) -> dict[str, object]:
        """Return counts and times, the total included."""
        first = self.time_s.get("first_solution", 0.0)
        times = {"init": 0.0, "routing": 0.0, **self.time_s, "first_solution": first}
        counts = {"vertices": 0, "groups": 0, "router_calls": 0, "expansions": 0}
        return {**counts, **self.counts, "time_s": {**times, "total": self.elapsed()}}


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
    statistics = Statistics()
    world = World.from_scene(scene)
    roadmap = build_roadmap(
        scene,
        world,
        samples=params.samples,
        neighbours=params.neighbours,
        rng=seeding.stream(seed, "roadmap"),
    )
    problem = state_problem(scene, world, roadmap, params)
    statistics.time_s["init"] = statistics.elapsed()
    unreachable = unreachable_goals(problem)
    if unreachable:
        return PlanResult(
            status=PlanStatus.INFEASIBLE,
            plan=None,
            reason="no robot can reach "
            + ", ".join(unreachable)
            + ": cut off by obstacles for every robot's width",
            statistics=statistics.as_dict(),
        )
    tell(0.1, "roadmap built")
    return _best_plan(problem, seed, params, statistics, tell)


def unreachable_goals(problem: Problem) -> list[str]:
    """Return the goals to which the roadmap knows no way for any robot."""
    reach = np.isfinite(problem.roadmap.start_distance).any(axis=0)
    return [
        goal.id
        for goal, fine in zip(problem.scene.goals, reach, strict=False)
        if not fine
    ]


def _best_plan(
    problem: Problem,
    seed: int,
    params: PlannerParams,
    statistics: Statistics,
    tell: Progress,
) -> PlanResult:
    best: Plan | None = None
    wanted = 1 + params.improvements
    found = 0
    routed = False
    for number in range(params.trees):
        out_of_time = (
            params.budget_s is not None and statistics.elapsed() > params.budget_s
        )
        if found == wanted or out_of_time:
            break
        before = statistics.elapsed()
        draw = seeding.stream_seed(seed, "tours", number)
        routing = solve_routing(problem.mission.routing, params.router, draw)
        spent = statistics.time_s.get("routing", 0.0)
        statistics.time_s["routing"] = spent + statistics.elapsed() - before
        if not routing.feasible:
            continue
        routed = True
        growth = grow_tree(
            problem, params, routing, seeding.stream_seed(seed, "tree", number)
        )
        statistics.add(dict(growth.counts))
        plan = _plan_of(problem, seed, params, growth) if growth.solved else None
        if plan is not None:
            found += 1
            statistics.time_s.setdefault("first_solution", statistics.elapsed())
            if best is None or plan.cost_J < best.cost_J:
                best = plan
        tell(0.1 + 0.9 * found / wanted, f"{found} of {wanted} plans")
    if best is not None:
        return PlanResult(
            status=PlanStatus.SOLVED,
            plan=best,
            reason="",
            statistics=statistics.as_dict(),
        )
    reason = "the motion tree reached its size limit before all goals were visited"
    if not routed:
        reason = "the router found no tours that keep every battery above its reserve"
    return PlanResult(
        status=PlanStatus.TIMEOUT,
        plan=None,
        reason=reason,
        statistics=statistics.as_dict(),
    )


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
