"""From a scene to a plan: roadmap, attempts of a planner, the best of their plans."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from concurrent.futures import Future
from dataclasses import dataclass, field, replace
from functools import cache, partial
from typing import TypedDict, Unpack

import numpy as np

from mrmg import extensions
from mrmg.background import Result, within
from mrmg.errors import UsageError, require_types, whole
from mrmg.planning import planners, routers
from mrmg.planning.attempt import Attempt, GivenUp, Request
from mrmg.planning.bounding import bounds_beside
from mrmg.planning.diagnosis import Proofs, why_in_time, why_no_plan
from mrmg.planning.feasibility import require_robots
from mrmg.planning.frame import Frame, on_the_map
from mrmg.planning.hints import INTERRUPTED, hints_on, on_charge
from mrmg.planning.margins_kept import with_least_spacing, with_margins
from mrmg.planning.parameters import GUIDED_TREE, PlannerParams, profile_params
from mrmg.planning.planners import Planner
from mrmg.planning.preference import Preference
from mrmg.planning.preparation import compile_kernels, load_bounds, load_kernels
from mrmg.planning.problem.little_room import little_room
from mrmg.planning.problem.problem import Problem, state_mission, tightened
from mrmg.planning.roadmap.fleet import margins_of, motion_addresses
from mrmg.planning.routers import Router
from mrmg.planning.search import GRACE_S, OnImprovement, Progress, Search
from mrmg.planning.skipping import plan_reachable
from mrmg.planning.statistics import UNKNOWN, Statistics
from mrmg.plans import PlanResult, PlanStatus
from mrmg.scene.margins import STATES_NONE, Margins, margins_from
from mrmg.scene.types import Scene


class Options(TypedDict, total=False):
    """What else may be asked of planning.

    Attributes:
        margins: distances in m that all robots keep in place of their own, such as
            {"obstacle": 0.1, "robot": 0.3}.
        skip_unreachable: plan without the goals that are proven out of reach.
        on_progress: receives how far planning has got.
        on_improvement: receives every plan that is better than all before it.
    """

    margins: Margins | Mapping[str, float] | str
    skip_unreachable: bool

    on_progress: Progress | None
    on_improvement: OnImprovement | None


def plan_mission(
    scene: Scene,
    *,
    seed: int = 0,
    params: PlannerParams | None = None,
    planner: str | Planner | None = None,
    router: str | Router | None = None,
    workers: int = 1,
    with_bound: bool = False,
    **options: Unpack[Options],
) -> PlanResult:
    """Plan a mission.

    Makes attempts with a planner until one finds a plan, then `params.improvements`
    more, each with draws of its own, or as many as a time limit allows, and returns the
    best plan by the scene's objective.

    Args:
        scene: the mission.
        seed: of all random streams; same scene, seed and parameters give the same plan,
            whatever the number of workers, unless `params.budget_s` ends the search.
        params: parameters; the default profile's if None.
        planner: name of a planner, or one of your own; that of `params` if None.
        router: name of a router, or one of your own; that of `params` if None.
        workers: threads that make attempts.
        with_bound: bound the objective of all plans, too, beside the search; statistics
            of a plan then hold `bound_J` or `bound_s`, and `gap`.
        **options: `margins`, such as {"obstacle": 0.1, "robot": 0.3} in m, that all
            robots keep in place of their own; `skip_unreachable` to plan without the
            goals that are proven out of reach (`Plan.skipped`); `on_progress` receives
            how far planning has got, `on_improvement` every plan that is better than
            all before it.

    Raises:
        SceneError: if the scene has no robots, or numbers that are not finite.
        UsageError: if a name is unknown, an argument of another type, there is to be no
            worker, or the scene has features that the planner does not know.
        MachineError: if a planner or router of another package is broken.
    """
    require_types((scene, Scene))
    require_robots(scene)
    _require_known(options)
    seed, workers = whole("seed", seed), whole("workers", workers)
    if workers < 1:
        raise UsageError(f"workers = {workers}; planning needs at least 1")
    params, made_by, routed_by = _resolved(params, planner, router)
    params = params.with_margins(margins_from(options.get("margins", STATES_NONE)))
    compile_kernels(params.planner)

    def plan(mission: Scene, spent_s: float = 0.0) -> PlanResult:
        request = Request(params=params, router=routed_by, seed=seed)
        planning = _Planning(mission, made_by, request, workers, options, spent_s)
        try:
            return planning.result(with_bound)
        finally:
            request.halt[0] = True  # nobody waits for what is still under way

    if options.get("skip_unreachable"):
        return plan_reachable(scene, params, plan)
    return plan(scene)


def _require_known(options: Mapping[str, object]) -> None:
    own = plan_mission.__kwdefaults__ or {}
    allowed = ", ".join([*own, *Options.__annotations__])
    for name in options:
        if name not in Options.__annotations__:
            raise TypeError(
                f"plan() takes no argument {name!r}; allowed: {allowed}; others are "
                "part of params, as in params=PlannerParams(budget_s=30)"
            )


def _resolved(
    params: PlannerParams | None,
    planner: str | Planner | None,
    router: str | Router | None,
) -> tuple[PlannerParams, Planner, Router]:
    """Return parameters that name planner and router, with both."""
    own_planner = None if isinstance(planner, str) else planner
    own_router = None if isinstance(router, str) else router
    if params is None:
        params = profile_params(
            planner=planner if isinstance(planner, str) else None,
            router=router if isinstance(router, str) else None,
        )
    require_types((params, PlannerParams))
    # Both at once, as a planner may take one router alone.
    params = replace(
        params,
        planner=extensions.name_of(planner or params.planner),
        router=replace(
            params.router, method=extensions.name_of(router or params.router.method)
        ),
    )
    return (
        params,
        planners.find_planner(params.planner, own_planner),
        routers.find_router(params.router, own_router),
    )


@dataclass(frozen=True, slots=True)
class _Planning:
    """One planning run.

    Attributes:
        scene: the mission.
        planner: makes the attempts.
        request: that of the first attempt; its flag ends what is under way beside them.
        workers: threads that make attempts.
        options: what else is asked for.
        spent_s: how much of the budget was spent before.
        statistics: receives counts and times.
    """

    scene: Scene
    planner: Planner
    request: Request
    workers: int
    options: Options
    spent_s: float = 0.0
    statistics: Statistics = field(default_factory=Statistics)

    @property
    def params(self) -> PlannerParams:
        """Parameters of the run."""
        return self.request.params

    @property
    def frame(self) -> Frame:
        """The frame that is planned in."""
        return Frame.of(self.scene, self.params.margins)

    def result(self, with_bound: bool) -> PlanResult:
        """Return the result of planning."""
        own, params = self.frame.scene(self.scene), self.frame.params(self.params)
        bounding = self._bounding(own) if with_bound else None
        load_kernels(self.params.planner, every=self.params.budget_s is not None)
        for robot in own.robots:
            motion_addresses(robot.model)
        self.statistics.begin(self.spent_s)
        seed, halt = self.request.seed, self.request.halt
        proofs = Proofs(self.scene, self.params.dt_s, halt)
        problem = self._in_time(partial(state_mission, own, seed, params, halt))
        self.statistics.time_s["init"] = self.statistics.elapsed()
        if problem is None:
            proof = self._in_time(partial(proofs.reason, tours_missing=False))
            return self._unsolved(proof, why_in_time(self.params, self.statistics))
        search = self._search(problem, proofs)
        search.on_progress(0.1, "roadmap built")
        best = search.run()
        proof = None if best else search.proof(search.tours_missing, False)
        if best is None:
            why = self._in_time(
                partial(
                    why_no_plan,
                    replace(problem, scene=self.scene),
                    self.request,
                    search,
                )
            )
            return self._unsolved(
                proof, why or why_in_time(self.params, self.statistics, search)
            )
        if bounding is not None:
            self._in_time(bounding.result)
        margins, spent = self.params.margins, GivenUp.CHARGE in search.given_up
        wanted = {one.id: margins_of(one, margins)[1] for one in self.scene.robots}
        return PlanResult(
            status=PlanStatus.SOLVED,
            plan=best,
            reason="",
            statistics=self.statistics.as_dict(),
            hints=(
                *([INTERRUPTED] if search.interrupted else []),
                *(on_charge(self.scene, best, self.params.soc_margin) if spent else ()),
                *hints_on(
                    self.scene,
                    best,
                    wanted,
                    self.statistics.gap,
                    self.params.router.method,
                ),
            ),
        )

    def _bounding(self, own: Scene) -> Future[None]:
        """Begin to prove bounds of the mission in its frame."""
        load_bounds(own.objective)  # what holds the interpreter's lock first
        return bounds_beside(
            own,
            self.params.dt_s,
            self.statistics,
            anytime=self.params.budget_s is not None,
            halt=self.request.halt,
        )

    def _search(self, problem: Problem, proofs: Proofs) -> Search:
        """Return the search among attempts at a problem."""
        margins = self.params.margins
        hopeless = cache(lambda: next(little_room(self.scene, margins), None))

        def attempt(number: int, halt: np.ndarray) -> Attempt:
            request = replace(self.request, number=number, halt=halt)
            found = self.planner(problem, request)
            # A longer search keeps robots apart about as soon as the least margins do,
            # and keeps the margins that are wanted.
            meeting = found.tours_found and len(self.scene.robots) > 1
            longer = meeting and number == 0 and self.params.trees > 1
            kept = self.scene
            if not (
                found.plans
                or GivenUp.DISTANCES not in search.given_up
                or longer
                or halt[0]
                or self.params.planner == GUIDED_TREE  # it has one search of some work
                or proof(not found.tours_found, True)
            ):
                found = self._tried_tightly(found, tight(), request)
                kept = with_least_spacing(self.scene, margins)
            found = on_the_map(found, problem, self.scene, self.params)
            stated = STATES_NONE if kept is not self.scene else margins
            plans = [with_margins(kept, plan, stated) for plan in found.plans]
            return replace(found, plans=plans)

        @cache
        def tight() -> Problem | None:
            own = self.frame.params(self.params).margins
            near = with_least_spacing(problem.scene, own)
            bare = replace(self.params, obstacle_margin_m=None, robot_margin_m=None)
            tighter = tightened(near, self.request.seed, bare, self.request.halt)
            # Plans are of the scene as it is.
            return tighter and replace(tighter, scene=problem.scene)

        def proof(tours_missing: bool, goes_on: bool) -> str | None:
            if goes_on and hopeless():
                return hopeless()
            missing = tours_missing or math.isinf(self.statistics.bounds.energy_J or 0)
            # Where there are tours, next to nothing but finishes can be in the way, and
            # the proofs of a large fleet take longer than its next attempts.
            if goes_on and not missing and not any(r.finish for r in self.scene.robots):
                return None
            return self._in_time(partial(proofs.reason, tours_missing=missing))

        search = Search(
            attempt=attempt,
            params=self.params,
            statistics=self.statistics,
            workers=self.workers,
            on_progress=self.options.get("on_progress") or (lambda *_: None),
            on_improvement=self.options.get("on_improvement") or (lambda _: None),
            proof=proof,
            preference=Preference.of(self.scene),
        )
        return search

    def _tried_tightly(
        self, failed: Attempt, problem: Problem | None, request: Request
    ) -> Attempt:
        """Return an attempt that keeps the least margins, if there are any.

        It follows one that has found no plan with the margins that are wanted.
        """
        if problem is None:
            return failed
        found = self.planner(problem, request).after(failed)
        return replace(
            found,
            blocked=failed.blocked or found.blocked,
            given_up=found.given_up | GivenUp.DISTANCES,
        )

    def _in_time(self, call: Callable[[], Result]) -> Result | None:
        """Return what a call returns, or None once the budget is over."""
        return within(call, self.statistics.left_s(self.params.budget_s) + GRACE_S)

    def _unsolved(self, proof: str | None, why: tuple[PlanStatus, str]) -> PlanResult:
        self.statistics.bounds = UNKNOWN  # they are bounds of plans
        status, reason = (PlanStatus.INFEASIBLE, proof) if proof else why
        statistics = self.statistics.as_dict()
        return PlanResult(
            status=status, plan=None, reason=reason, statistics=statistics
        )
