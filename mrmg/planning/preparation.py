"""Compiling and loading kernels before planning, so that no time limit includes it."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from functools import cache
from math import pi

import numpy as np

from mrmg.compilation import (
    compile_in_processes,
    compiling_alone,
    kernels_are_compiled,
    note_kernels_are_compiled,
)
from mrmg.planning.attempt import Request
from mrmg.planning.bound.bound import relaxed_routing_J
from mrmg.planning.bound.relaxation import Relaxation
from mrmg.planning.bounding import bounds_of
from mrmg.planning.frame import Frame, on_the_map
from mrmg.planning.parameters import (
    GUIDED_TREE,
    PATH_FOLLOWING,
    GuidedTreeParams,
    PlannerParams,
    kernels_of,
    paper_params,
)
from mrmg.planning.path_following.coordination._guide_kernels import guide_at
from mrmg.planning.path_following.coordination.coordination import coordinated
from mrmg.planning.path_following.coordination.fields import NO_GUIDE
from mrmg.planning.path_following.coordination.rounds import ROUNDS
from mrmg.planning.path_following.coordination.tasks import no_path
from mrmg.planning.path_following.cost_map import cost_maps_of
from mrmg.planning.path_following.poses import posed
from mrmg.planning.planners import find_planner
from mrmg.planning.problem._target_kernels import at_target
from mrmg.planning.problem.problem import Problem, state_mission
from mrmg.planning.problem.targets import whole_tours
from mrmg.planning.routers import find_router
from mrmg.planning.routing.routing import RouterParams
from mrmg.scene.loading import scene_from_document
from mrmg.scene.objective import Objective
from mrmg.scene.types import Scene


def compile_kernels(
    planner: str, on_progress: Callable[[int], None] | None = None
) -> None:
    """Compile every kernel of a planner that this machine does not hold compiled.

    Of processes with one cache, one compiles, and the others wait for it.

    Args:
        planner: name of it; those of other packages may call what path following does.
        on_progress: receives the number of kernels compiled so far, while there are any
            to compile, which happens once for these sources.
    """
    part = kernels_of(planner)
    if kernels_are_compiled(part):
        return
    with compiling_alone():
        if kernels_are_compiled(part):
            return
        compile_in_processes(CALLS[part], on_progress or (lambda number: None))
        load_kernels(part)
        bound_smallest()
        with suppress(OSError):  # plan without a cache that can be written
            note_kernels_are_compiled(part)


@cache
def load_kernels(planner: str, *, every: bool = True) -> None:
    """Load the kernels of a planner, so that no time limit or figure includes it.

    Planners of other packages load their own.

    Args:
        planner: name of it.
        every: also those of the searches for motions and for poses, which take a third
            of the time and which many missions do not need.
    """
    if planner == GUIDED_TREE:
        guide_smallest()
    elif planner == PATH_FOLLOWING:
        follow_smallest()
        if every:
            coordinate_smallest()
            pose_smallest()


def coordinate_smallest() -> None:
    """Search for motions of two robots that change places, one by way of a goal."""
    problem = state_mission(_smallest_crossing(), 0, SMALL_PARAMS)
    tours = whole_tours(problem.mission.targets, [[0], []])
    paths, never = [no_path(problem, r) for r in range(2)], np.zeros(1, np.bool_)
    # The first round knows no turning.
    found = coordinated(problem, tours, paths, never, rounds=ROUNDS[1:])
    assert found
    # Called on wide maps, and once a robot has driven along its path to its finish.
    guide_at(NO_GUIDE, 0, 0, 0.0, 0.0)
    at_target(problem.mission.targets, 0, problem.start[0])


def pose_smallest() -> None:
    """Find a way over poses in the smallest mission."""
    _, problem = _smallest_mission()
    never = np.zeros(1, np.bool_)
    found = posed(problem, 0, cost_maps_of(problem)[0], [0], never)
    assert found


def follow_smallest() -> None:
    """Follow paths in the smallest mission."""
    _plan_smallest(SMALL_PARAMS)


def route_smallest() -> None:
    """Find tours of the smallest mission by NRPA, which any planner may ask for."""
    _, problem = _smallest_mission()
    params = replace(SMALL_PARAMS, router=RouterParams(method="nrpa"))
    request = Request(params=params, router=find_router(params.router), seed=0)
    found = request.tours(problem)
    assert found.feasible


def guide_smallest() -> None:
    """Plan the smallest mission by the paper's method."""
    _plan_smallest(SMALL_PAPER_PARAMS)


@cache
def load_bounds(objective: Objective) -> None:
    """Load the kernels of the bounds of an objective."""
    bounds_of(replace(_smallest_scene(), objective=objective), 0.1, cells=50)


def bound_smallest() -> None:
    """Bound the smallest mission: energy, makespan, and energy as of many goals."""
    load_bounds(Objective(energy_weight=1.0, makespan_weight=1.0))
    relaxed_routing_J(Relaxation.of(_smallest_scene(), cells=50).problem)


CALLS = {
    PATH_FOLLOWING: (
        coordinate_smallest,
        follow_smallest,
        bound_smallest,
        pose_smallest,
        route_smallest,
    ),
    GUIDED_TREE: (guide_smallest, bound_smallest),
}
"""What compiles all kernels of a part, what takes longest first: it would be waited for
at the end. What two share that run side by side is compiled twice."""

SMALL_PARAMS = PlannerParams(samples=20, trees=1)
"""What suffices to plan the smallest mission."""

SMALL_PAPER_PARAMS = replace(
    paper_params(), guided_tree=GuidedTreeParams(iterations=1000)
)
"""The same for the paper's method."""


def _plan_smallest(params: PlannerParams) -> None:
    scene, problem = _smallest_mission()
    request = Request(params=params, router=find_router(params.router), seed=0)
    found = find_planner(params.planner)(problem, request)
    found = on_the_map(found, problem, scene, params)
    assert found.plans, "the smallest mission has a plan, or not all is compiled"


@cache
def _smallest_mission() -> tuple[Scene, Problem]:
    scene = _smallest_scene()
    own = Frame.of(scene).scene(scene)
    return scene, state_mission(own, 0, SMALL_PARAMS)


@cache
def _smallest_scene() -> Scene:
    """Return the smallest mission there is: types do not depend on a scene's size.

    Its robot has to recharge.
    """
    document = {
        "format": 1,
        "name": "smallest",
        "bounds": [1, 0, 21, 10],
        "goals": [{"id": "g", "circle": {"center": [18, 5], "radius": 2}}],
        "stations": [{"id": "s", "circle": {"center": [9, 7], "radius": 1}}],
        "battery": {"capacity_m": 100},
        "robots": [{"id": "r", "model": "car", "pose": [6, 5, 0], "start_energy": 0.2}],
    }
    return scene_from_document(document, source="smallest mission")


def _smallest_crossing() -> Scene:
    """Return a mission of two robots that want to get past each other."""
    robots = [
        {
            "id": name,
            "model": "diffdrive",
            "pose": [start, 2, heading],
            "finish": {
                "circle": {"center": [10 - start, 2], "radius": 0.5},
                "heading": heading,
            },
        }
        for name, start, heading in (("a", 2, 0.0), ("b", 8, pi))
    ]
    document = {
        "format": 1,
        "name": "crossing",
        "bounds": [0, 0, 10, 4],
        "goals": [{"id": "g", "circle": {"center": [5, 2], "radius": 0.5}}],
        "battery": {"capacity_m": 100},
        "robots": robots,
    }
    return scene_from_document(document, source="smallest crossing")
