"""Hints on a plan that one line can give."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

from mrmg.compared import compared
from mrmg.energy.metering import visits_and_energy
from mrmg.planning.bound.exact_tours import are_few
from mrmg.planning.endings import listed
from mrmg.plans import Plan
from mrmg.scene.types import Scene

LARGE_GAP = 0.15
"""Gap from which on it is said why it is not all room for better plans."""

INTERRUPTED = "planning was stopped by Ctrl-C; this is the best plan found until then"


def hints_on(
    scene: Scene,
    plan: Plan,
    wanted: Mapping[str, float],
    gap: float | None,
    router: str,
) -> Iterator[str]:
    """Yield hints on a plan.

    Args:
        scene: the mission.
        plan: the answer.
        wanted: distances from other robots that were asked for, by robot [m].
        gap: of the plan's objective to its bound; None if it is not known.
        router: name of the one that was asked for.
    """
    objective = scene.objective
    goals = {goal.id for goal in scene.goals}
    unused = [name for name, tour in plan.tours.items() if not goals & set(tour)]
    if goals and unused and objective.energy_weight:
        wish = "'--objective makespan' shares the work among more robots"
        if objective.makespan_weight:
            wish = "a larger weight of the makespan shares the work among more robots"
        visit = "visits" if len(unused) == 1 else "visit"
        yield f"{listed(unused)} {visit} no goal, as that takes less energy; {wish}"
    yield from _on_narrow_passages(plan)
    yield from _on_spacing(wanted, plan)
    few = are_few(len(goals), len(scene.robots))
    timed = objective.makespan_weight > 0.0 or math.isfinite(scene.time_limit_s)
    if router == "exact" and (timed or not few):
        what = (
            "the makespan or time limits" if few else f"as many as {len(goals)} goals"
        )
        yield (
            f"tours are those of router search: router exact knows none for {what}, so "
            "that nothing proves them to be the cheapest ones"
        )
    if gap is None or gap <= LARGE_GAP:
        return
    if not few:
        yield (
            f"the proven bound is loose for as many as {len(goals)} goals: much of the "
            f"gap of {gap:.0%} need not be room for better plans"
        )
    elif timed:
        share = min(robot.model.planning_share for robot in scene.robots)
        cause = (
            f"the time limit of {scene.time_limit_s:g} s"
            if math.isfinite(scene.time_limit_s)
            else f"the objective {objective.name}"
        )
        yield (
            f"{cause} makes the gap of {gap:.0%} look large: the proven bound has "
            "robots drive at top speed and turn in no time, while plans use "
            f"{share:.0%} of it"
        )


def _on_narrow_passages(plan: Plan) -> Iterator[str]:
    """Yield where robots keep less than their margins, and how much they keep."""
    for robot in plan.margins:
        own = [passage for passage in plan.narrow if passage.robot == robot]
        if own:
            places = listed(
                [
                    f"{one.margin_m:.3f} m near ({one.x_m:.1f}, {one.y_m:.1f}) at "
                    f"{one.start_s:.1f}-{one.end_s:.1f} s"
                    for one in own
                ]
            )
            yield (
                f"{robot} keeps less than its margin of {plan.margins[robot][0]:g} m "
                f"from obstacles where no wider way leads on: {places}"
            )


def on_charge(scene: Scene, plan: Plan, wanted: float) -> Iterator[str]:
    """Yield which robots leave less of their batteries than was asked for.

    Args:
        scene: the mission.
        plan: the answer.
        wanted: share of every battery's capacity, above its reserve.
    """
    left = {}
    for trajectory in plan.trajectories:
        robot = trajectory.robot
        battery = scene.robot(robot).battery
        _, content_J, _ = visits_and_energy(scene, trajectory, plan.tours[robot])
        spare_J = float(content_J.min()) - battery.reserve_J
        left[robot] = spare_J / battery.capacity_J
    less = [robot for robot, share in left.items() if share < wanted]
    if less:
        least, limit = compared(100.0 * min(left.values()), 100.0 * wanted)
        what = f"leave as little as {least} % of their batteries"
        if len(less) == 1:
            what = f"leaves {least} % of its battery"
        yield (
            f"{listed(less)} {what} above the reserve instead of {limit} %: no plan "
            "was found that leaves more"
        )


def _on_spacing(wanted: Mapping[str, float], plan: Plan) -> Iterator[str]:
    """Yield which robots keep less from each other than was asked for."""
    kept = {robot: robot_m for robot, (_, robot_m) in plan.margins.items()}
    less = [robot for robot, robot_m in kept.items() if robot_m < wanted[robot]]
    if less:
        wanted_m, kept_m = (max(known[r] for r in less) for known in (wanted, kept))
        yield (
            f"{listed(less)} may come as near to other robots as {kept_m:.3f} m "
            f"instead of {wanted_m:g} m: no motions were found otherwise"
        )
