"""From a scene to a plan: roadmap, attempts of a planner, the best of their plans."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from functools import cache, partial

import numpy as np

from mrmg import seeding
from mrmg.background import Result, within
from mrmg.compilation import (
    compile_in_processes,
    kernels_are_compiled,
    note_kernels_are_compiled,
)
from mrmg.errors import UsageError
from mrmg.planning.attempt import (
    Attempt,
    attempt_plan,
    draft_plans,
    guided_plans,
    tree_plans,
)
from mrmg.planning.bound.bound import Relaxation, lower_bound_J
from mrmg.planning.bound.exact_tours import exact_routing
from mrmg.planning.bound.makespan_bound import makespan_bound_s
from mrmg.planning.bounding import bounds_beside, bounds_of
from mrmg.planning.diagnosis import (
    Proofs,
    unjoined_goals,
    why_in_short,
    why_no_plan,
    why_no_roadmap,
)
from mrmg.planning.feasibility import require_robots
from mrmg.planning.frame import Frame, on_the_map
from mrmg.planning.guided_tree.limits import refuse_unknown_features
from mrmg.planning.hints import INTERRUPTED, hints_on
from mrmg.planning.parameters import (
    GUIDED_TREE,
    PLANNERS,
    GuidedTreeParams,
    PlannerParams,
    paper_params,
)
from mrmg.planning.preference import Preference
from mrmg.planning.problem.problem import Problem, state_problem
from mrmg.planning.problem.time_weighting import priced_world, with_energies
from mrmg.planning.roadmap.roadmap import build_roadmap
from mrmg.planning.routing.routing import Routing
from mrmg.planning.search import GRACE_S, OnImprovement, Progress, Search
from mrmg.planning.statistics import UNKNOWN, Statistics
from mrmg.planning.tree.motion_tree import grow_tree
from mrmg.plans import PlanResult, PlanStatus
from mrmg.scene.loading import scene_from_document
from mrmg.scene.objective import Objective
from mrmg.scene.types import Scene
from mrmg.world.world import World

ROADMAPS = 3
"""Roadmaps built at most, each with three times the samples, to join all goals."""


def plan_mission(
    scene: Scene,
    *,
    seed: int = 0,
    params: PlannerParams | None = None,
    workers: int = 1,
    with_bound: bool = False,
    on_progress: Progress | None = None,
    on_improvement: OnImprovement | None = None,
) -> PlanResult:
    """Plan a mission.

    Makes attempts with the planner of `params` until one finds a plan, then
    `params.improvements` more, each with draws of its own, or as many as a time limit
    allows, and returns the best plan by the scene's objective.

    Args:
        scene: the mission.
        seed: of all random streams; same scene, seed and parameters give the same plan,
            whatever the number of workers, unless `params.budget_s` ends the search.
        params: parameters; the default profile's if None.
        workers: threads that make attempts.
        with_bound: bound what the objective asks of all plans, too, beside the search;
            statistics of a plan then hold `bound_J` or `bound_s`, and `gap`.
        on_progress: told how far planning has got.
        on_improvement: told of every plan that is better than all before it.

    Raises:
        SceneError: if the scene has no robots.
        UsageError: if there is to be no worker, or the scene has features that the
            planner does not know.
    """
    params = params or PlannerParams()
    require_robots(scene)
    if workers < 1:
        raise UsageError(f"workers = {workers}; planning needs at least 1")
    if params.planner == GUIDED_TREE:
        refuse_unknown_features(scene)
    compile_kernels()
    halt = np.zeros(1, np.bool_)
    try:
        return _planned(
            scene,
            seed,
            params,
            workers,
            halt,
            with_bound=with_bound,
            on_progress=on_progress or (lambda fraction, text: None),
            on_improvement=on_improvement or (lambda improvement: None),
        )
    finally:
        halt[0] = True  # nobody waits any longer for what is still under way


def _planned(
    scene: Scene,
    seed: int,
    params: PlannerParams,
    workers: int,
    halt: np.ndarray,
    *,
    with_bound: bool,
    on_progress: Progress,
    on_improvement: OnImprovement,
) -> PlanResult:
    statistics = Statistics()
    own = Frame.of(scene).scene(scene)
    bounding = None
    if with_bound:
        _load_bounds(scene.objective)  # what holds the interpreter's lock first
        anytime = params.budget_s is not None
        bounding = bounds_beside(
            own, params.dt_s, statistics, anytime=anytime, halt=halt
        )
    _load_kernels(params.planner, trees=not params.drafts)
    statistics.begin()

    proofs = Proofs(own, params.dt_s, halt)

    def in_time(call: Callable[[], Result]) -> Result | None:
        return within(call, statistics.left_s(params.budget_s) + GRACE_S)

    problem = in_time(partial(state_mission, own, seed, params))
    statistics.time_s["init"] = statistics.elapsed()
    if problem is None:
        proof = in_time(partial(proofs.reason, tours_missing=False))
        return _unsolved(statistics, proof, why_no_roadmap(params, statistics))
    on_progress(0.1, "roadmap built")

    def tours_missing() -> bool:
        unbounded = math.isinf(statistics.bounds.energy_J or 0.0)
        return search.tours_missing or unbounded

    search = Search(
        attempt=_attempts_at(problem, scene, seed, params),
        params=params,
        statistics=statistics,
        workers=workers,
        on_progress=on_progress,
        on_improvement=on_improvement,
        proof=lambda: in_time(partial(proofs.reason, tours_missing=tours_missing())),
        preference=Preference.of(scene),
    )
    best = search.run()
    if best is None:
        proof = search.proof()
        why = in_time(partial(why_no_plan, problem, params, seed, search))
        return _unsolved(statistics, proof, why or why_in_short(params, search))
    if bounding is not None:
        in_time(bounding.result)
    return PlanResult(
        status=PlanStatus.SOLVED,
        plan=best,
        reason="",
        statistics=statistics.as_dict(),
        hints=(
            *([INTERRUPTED] if search.interrupted else []),
            *hints_on(scene, best, statistics.gap),
        ),
    )


def _attempts_at(
    problem: Problem, scene: Scene, seed: int, params: PlannerParams
) -> Callable[[int, np.ndarray], Attempt]:
    def attempt(number: int, halt: np.ndarray) -> Attempt:
        found = attempt_plan(problem, seed, params, number, halt)
        return on_the_map(found, problem, scene, params)

    return attempt


def _unsolved(
    statistics: Statistics, proof: str | None, why: tuple[PlanStatus, str]
) -> PlanResult:
    statistics.bounds = UNKNOWN  # they are bounds of plans
    status, reason = (PlanStatus.INFEASIBLE, proof) if proof else why
    return PlanResult(
        status=status, plan=None, reason=reason, statistics=statistics.as_dict()
    )


def compile_kernels(on_progress: Callable[[int], None] | None = None) -> None:
    """Compile every kernel that this machine does not hold compiled.

    Args:
        on_progress: told the number of kernels compiled so far, while there are any to
            compile, which happens once for these sources.
    """
    if kernels_are_compiled():
        return
    calls = (grow_smallest, draft_smallest, guide_smallest, bound_smallest)
    compile_in_processes(calls, on_progress or (lambda number: None))
    for planner in PLANNERS:
        _load_kernels(planner, trees=True)
    bound_smallest()
    with suppress(OSError):  # without a cache that can be written, plan all the same
        note_kernels_are_compiled()


@cache
def _load_kernels(planner: str, *, trees: bool) -> None:
    """Load the kernels of a planner, so that no time limit or figure includes it.

    Those of trees take as long as all others; few missions need them where there are
    drafts, and load them then.
    """
    if planner == GUIDED_TREE:
        guide_smallest()
        return
    draft_smallest()
    if trees:
        _find_in_smallest(tree_plans, SMALL_PARAMS)


def grow_smallest() -> None:
    """Grow a tree in the smallest mission."""
    _, problem = _smallest_mission()
    routing = Routing(tours=((0,),), cost_J=0.0)
    growth = grow_tree(problem, SMALL_PARAMS, routing, 0, np.zeros(1, np.bool_))
    assert growth.solved, "the smallest mission has a plan, or not all is compiled"


def draft_smallest() -> None:
    """Plan the smallest mission without a tree."""
    _find_in_smallest(draft_plans, SMALL_PARAMS)


def guide_smallest() -> None:
    """Plan the smallest mission by the paper's method."""
    _find_in_smallest(guided_plans, SMALL_PAPER_PARAMS)


@cache
def _load_bounds(objective: Objective) -> None:
    """Load the kernels of the bounds of an objective."""
    bounds_of(replace(_smallest_scene(), objective=objective), 0.1, cells=50)


def bound_smallest() -> None:
    """Bound the energy and the makespan of the smallest mission, in all ways."""
    scene = _smallest_scene()
    lower_bound_J(scene, cells=50)
    makespan_bound_s(scene, cells=50)
    exact_routing(Relaxation.of(scene, cells=50).problem)


SMALL_PARAMS = PlannerParams(samples=20, max_vertices=20, trees=1)
"""What suffices to plan the smallest mission."""

SMALL_PAPER_PARAMS = replace(
    paper_params(), guided_tree=GuidedTreeParams(iterations=1000)
)
"""The same for the paper's method."""


def _find_in_smallest(find: Callable[..., Attempt], params: PlannerParams) -> None:
    scene, problem = _smallest_mission()
    found = find(problem, 0, params, 0, np.zeros(1, np.bool_))
    found = on_the_map(found, problem, scene, params)
    assert found.plans, "the smallest mission has a plan, or not all is compiled"


@cache
def _smallest_mission() -> tuple[Scene, Problem]:
    scene = _smallest_scene()
    return scene, state_mission(Frame.of(scene).scene(scene), 0, SMALL_PARAMS)


@cache
def _smallest_scene() -> Scene:
    """Return the smallest mission there is: types do not depend on a scene's size."""
    document = {
        "format": 1,
        "name": "smallest",
        "bounds": [1, 0, 21, 10],
        "goals": [{"id": "g", "circle": {"center": [13, 5], "radius": 2}}],
        "battery": {"capacity_m": 100},
        "robots": [{"id": "r", "model": "car", "pose": [6, 5, 0]}],
    }
    return scene_from_document(document, source="smallest mission")


def state_mission(scene: Scene, seed: int, params: PlannerParams) -> Problem:
    """Build the roadmap, denser while it does not join all goals, and the problem."""
    world = World.from_scene(scene)
    priced = priced_world(scene, world)
    samples = params.samples
    for attempt in range(ROADMAPS):
        roadmap = build_roadmap(
            scene,
            priced,
            samples=samples,
            neighbours=params.neighbours,
            margin_m=params.obstacle_margin_m,
            rng=seeding.stream(seed, "roadmap", attempt),
        )
        if not unjoined_goals(scene, roadmap):
            break
        samples *= 3
    if priced is not world:
        roadmap = with_energies(roadmap, scene, world, params.obstacle_margin_m)
    return state_problem(scene, world, roadmap, params)
