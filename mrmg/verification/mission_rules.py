"""Rules of the mission: goals, tours, visits, recharges, energy, time and ledger."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import zip_longest

import numpy as np

from mrmg.compared import compared
from mrmg.plans import Plan, Trajectory, Visit
from mrmg.scene.objective import overtime_s
from mrmg.scene.types import Goal, Scene
from mrmg.verification.energy import (
    TIME_ROUNDING_S,
    MotionAccount,
    account_of,
    longest_stay_s,
    off_heading_rad,
    shared_stays,
)
from mrmg.verification.motion_rules import violation_at, worst_of_runs
from mrmg.verification.verdict import Violation, ViolationKind

ENERGY_TOLERANCE_J = 1e-6
"""Rounding that is forgiven in energies: a billionth of a metre's drive."""


_Key = tuple[str, int, str, str]
"""Robot, leg, target and part of an entry of the ledger."""

_Lack = tuple[float, int, str]
"""What a robot lacks of a visit [SI], in which step, and how that is said."""

_LackOf = Callable[[Goal, Trajectory], _Lack]


def check_mission(scene: Scene, plan: Plan) -> Iterator[Violation]:
    """Yield every broken rule of the mission as a whole."""
    yield from _check_goals(scene, plan)
    yield from _check_recharges(scene, plan)
    yield from _check_stations(scene, plan)
    yield from _check_time(scene, plan)
    known = {target.id for target in scene.targets()}
    accounts: dict[str, MotionAccount] = {}
    for trajectory in plan.trajectories:
        tour = [name for name in plan.tours[trajectory.robot] if name in known]
        account = account_of(scene, trajectory, tour)
        yield from _check_tour(scene, plan, trajectory, account.visits)
        yield from _check_visits(plan, trajectory, account.visits)
        yield from _check_energy(scene, trajectory, account)
        accounts[trajectory.robot] = account
    yield from _check_ledger(plan, accounts)


def _check_goals(scene: Scene, plan: Plan) -> Iterator[Violation]:
    """Check that some robot is at each goal, with its heading, for its dwell time."""
    for goal in scene.goals:
        if goal.id in plan.skipped:
            continue  # the verdict names it
        for kind, lack_of in _LACKS.items():
            (lack, step, message), trajectory = _least_lack(plan, goal, lack_of)
            if lack > 0.0:
                yield violation_at(
                    trajectory, step, kind, message, amount=lack, other=goal.id
                )
                break


def _least_lack(plan: Plan, goal: Goal, lack_of: _LackOf) -> tuple[_Lack, Trajectory]:
    """Return what the first robot without a lack, else the one nearest to that, lacks.

    Those that have the goal on their tours are looked at first.
    """
    found = []
    for item in sorted(
        plan.trajectories, key=lambda one: goal.id not in plan.tours[one.robot]
    ):
        found.append((lack_of(goal, item), item))
        if found[-1][0][0] <= 0.0:
            return found[-1]
    return min(found, key=lambda pair: pair[0][0])


def _missed(goal: Goal, trajectory: Trajectory) -> _Lack:
    depth_m = goal.region.depth(trajectory.state[:, :2])
    step = int(depth_m.argmax())
    missed_m = -float(depth_m[step])
    message = (
        f"goal {goal.id} is visited by no robot; this one comes nearest, "
        f"{missed_m:.3g} m off"
    )
    return missed_m, step, message


def _askew(goal: Goal, trajectory: Trajectory) -> _Lack:
    inside = goal.region.depth(trajectory.state[:, :2]) >= 0.0
    off_rad = np.where(inside, off_heading_rad(goal, trajectory), np.inf)
    step = int(off_rad.argmin())
    off, most = float(off_rad[step]), goal.heading_tolerance_rad
    found, allowed = compared(off, most, 2)
    message = (
        f"goal {goal.id} is visited with its heading by no robot; this one comes "
        f"nearest, {found} rad off, {allowed} are allowed"
    )
    return off - most, step, message


def _cut_short(goal: Goal, trajectory: Trajectory) -> _Lack:
    stay_s = longest_stay_s(goal, trajectory)
    lack_s = goal.dwell_s - stay_s
    step = int(goal.region.depth(trajectory.state[:, :2]).argmax())
    stay, dwell = compared(stay_s, goal.dwell_s, 1)
    message = (
        f"stays at goal {goal.id} for {stay} s without a break, longer than others; it "
        f"takes {dwell} s"
    )
    return lack_s if lack_s > TIME_ROUNDING_S else 0.0, step, message


_LACKS: Mapping[ViolationKind, _LackOf] = {
    ViolationKind.GOAL_MISSED: _missed,
    ViolationKind.HEADING: _askew,
    ViolationKind.DWELL: _cut_short,
}


def _check_tour(
    scene: Scene, plan: Plan, trajectory: Trajectory, visits: Sequence[Visit]
) -> Iterator[Violation]:
    """Check that the trajectory enters all targets of its tour in their order."""
    regions = {target.id: target.region for target in scene.targets()}
    left = [visit.target for visit in visits]
    for name in plan.tours[trajectory.robot]:
        if left and left[0] == name:
            left.pop(0)
            continue
        if name in regions:
            depth = regions[name].depth(trajectory.state[:, :2])
            step, amount = int(depth.argmax()), max(-float(depth.max()), 0.0)
            message = f"{name} is not visited at its place in the tour"
        else:
            step, amount = 0, 0.0
            message = f"the tour names {name}, which the scene does not have"
        kind = ViolationKind.TOUR
        yield violation_at(trajectory, step, kind, message, amount=amount, other=name)


def _check_visits(
    plan: Plan, trajectory: Trajectory, visits: Sequence[Visit]
) -> Iterator[Violation]:
    """Check that the plan states the visits that the motion makes, and no others."""
    stated = [visit for visit in plan.visits if visit.robot == trajectory.robot]
    last = len(trajectory.state) - 1
    for index, (claim, truth) in enumerate(zip_longest(stated, visits)):
        if _agree(claim, truth):
            continue
        visit = claim or truth
        assert visit is not None
        yield violation_at(
            trajectory,
            min(max(visit.step, 0), last),
            ViolationKind.VISIT,
            f"visit {index} is stated as {_described(claim)}, "
            f"the motion makes it {_described(truth)}",
            amount=abs(claim.time_s - truth.time_s) if claim and truth else 0.0,
            other=visit.target,
        )


def _agree(claim: Visit | None, truth: Visit | None) -> bool:
    return (
        claim is not None
        and truth is not None
        and (claim.target, claim.kind, claim.step)
        == (truth.target, truth.kind, truth.step)
        and abs(claim.time_s - truth.time_s) < 1e-9
        and abs(claim.energy_J - truth.energy_J) <= ENERGY_TOLERANCE_J
    )


def _described(visit: Visit | None) -> str:
    if visit is None:
        return "none"
    return (
        f"{visit.kind} {visit.target} in step {visit.step} "
        f"at {visit.time_s:.6g} s with {visit.energy_J:.6g} J"
    )


def _check_recharges(scene: Scene, plan: Plan) -> Iterator[Violation]:
    """Check that batteries are filled inside stations only."""
    stations = {station.id: station.region for station in scene.stations}
    for visit in plan.visits:
        if visit.kind != "station":
            continue
        trajectory = plan.trajectory(visit.robot)
        step = min(max(visit.step, 0), len(trajectory.state) - 1)
        if visit.target in stations:
            region = stations[visit.target]
            off_m = -float(region.depth(trajectory.state[step, :2])[0])
            message = f"recharges {off_m:.3g} m outside station {visit.target}"
        else:
            off_m = np.inf
            message = f"recharges at {visit.target}, which is no station"
        if off_m > 0.0:
            amount = off_m if np.isfinite(off_m) else 0.0
            kind = ViolationKind.RECHARGE
            yield violation_at(
                trajectory, step, kind, message, amount=amount, other=visit.target
            )


def _check_stations(scene: Scene, plan: Plan) -> Iterator[Violation]:
    """Check that stations for one robot at a time hold one at any time."""
    for station in scene.stations:
        if not station.one_at_a_time:
            continue
        for one, other, (first, last) in shared_stays(station, plan.trajectories):
            shared_s = (last - first) * plan.dt_s
            message = (
                f"is at {station.id} for {shared_s:.3g} s together with {other.robot}; "
                "it is for one robot at a time"
            )
            kind = ViolationKind.OCCUPIED
            yield violation_at(
                one, first, kind, message, amount=shared_s, other=station.id
            )


def _check_time(scene: Scene, plan: Plan) -> Iterator[Violation]:
    """Check that all robots are at rest when the time limit is over."""
    late_s = overtime_s(scene.time_limit_s, plan.makespan_s)
    if not late_s:
        return
    taken, limit = compared(plan.makespan_s, scene.time_limit_s, 1)
    message = (
        f"the plan takes {taken} s, {late_s:.3g} s more than the limit of {limit} s"
    )
    kind = ViolationKind.LATE
    yield Violation(kind=kind, time_s=plan.makespan_s, amount=late_s, message=message)


def _check_energy(
    scene: Scene, trajectory: Trajectory, account: MotionAccount
) -> list[Violation]:
    """Check that the battery never holds less than the reserve."""
    battery = scene.robot(trajectory.robot).battery
    content_J = account.content_J.copy()
    for visit in account.visits:
        content_J[visit.step] = min(content_J[visit.step], visit.energy_J)
    lack_J = battery.reserve_J - content_J
    return [
        violation_at(
            trajectory,
            step,
            ViolationKind.ENERGY,
            "the battery holds {} J, the reserve is {} J".format(
                *compared(content_J[step], battery.reserve_J, 1)
            ),
            amount=float(lack_J[step]),
        )
        for step in worst_of_runs(lack_J, lack_J > ENERGY_TOLERANCE_J)
    ]


def _check_ledger(
    plan: Plan, accounts: Mapping[str, MotionAccount]
) -> Iterator[Violation]:
    """Check the predicted ledger entry by entry."""
    stated: dict[_Key, float] = defaultdict(float)
    for entry in plan.ledger.entries:
        key = (entry.robot, entry.leg, entry.target, entry.part)
        stated[key] += entry.energy_J
    recomputed: dict[_Key, float] = defaultdict(float)
    for robot, account in accounts.items():
        for place, energy_J in account.entries():
            recomputed[(robot, *place)] = energy_J
    keys = sorted({*stated, *recomputed})
    off_J = np.array([abs(stated[key] - recomputed[key]) for key in keys])
    if not keys or off_J.max() <= ENERGY_TOLERANCE_J:
        return
    worst = int(off_J.argmax())
    robot, leg, target, part = keys[worst]
    claimed, takes = compared(stated[keys[worst]], recomputed[keys[worst]], 1)
    message = (
        f"{robot or 'plan'}: the ledger states {claimed} J for {part} on leg {leg} to "
        f"{target or 'the end'}, the motion takes {takes} J"
    )
    yield Violation(
        kind=ViolationKind.LEDGER,
        robot=robot,
        other=target,
        amount=float(off_J[worst]),
        message=message,
    )
