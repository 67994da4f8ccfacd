"""The paper's method as a planner."""

from __future__ import annotations

from mrmg.planning.attempt import Attempt, Request
from mrmg.planning.guided_tree.limits import refuse_unknown_features
from mrmg.planning.guided_tree.planner import grow_guided_tree
from mrmg.planning.problem.problem import Problem


def guided_tree(problem: Problem, request: Request) -> Attempt:
    """Grow the paper's motion tree, and return the plan that it leads to.

    Raises:
        UsageError: if the scene has features that the paper lacks.
    """
    refuse_unknown_features(problem.scene)
    problem = problem.with_soc_margin(request.params.soc_margin)
    draw = request.stream_seed("guided tree")
    growth = grow_guided_tree(problem, request.params, draw, request.halt)
    plan = None
    if growth.solved:
        plan = request.plan(problem, growth.trajectories, growth.tours)
    done, cap = growth.counts["iterations"], growth.counts["iteration_cap"]
    return Attempt(
        [] if plan is None else [plan],
        routing_s=growth.routing_s,
        counts=growth.counts,
        tours_found=growth.counts["vertices"] > 0,
        blocked=f"the guided tree did not solve it in {done} of at most {cap} "
        "iterations",
    )
