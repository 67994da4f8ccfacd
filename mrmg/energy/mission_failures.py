"""Why a simulated mission failed, apart from the energy that its models predict."""

from __future__ import annotations

from collections.abc import Mapping, Set

import numpy as np

from mrmg.compared import compared
from mrmg.energy.visits import crowded_stations, first_stay, is_at
from mrmg.scene.objective import overtime_s
from mrmg.scene.types import Scene
from mrmg.simulation.log import ExecutionLog

AT_REST = 0.02
"""Speed below which a simulated robot is at rest [m/s], and rate of turning [rad/s]."""

GOAL_SKIPPED = "goal skipped"
"""Cause of the failure of a mission whose plan leaves goals out."""

_TROUBLE = {
    "lost": "a robot was too far from its plan",
    "diverged": "the physics got out of hand",
    "stalled": "the fleet did not get on",
    "restless": "the fleet did not come to rest",
}


def mission_failures(
    scene: Scene,
    log: ExecutionLog,
    goals_visited: tuple[str, ...],
    least_J: Mapping[str, float],
    skipped: Mapping[str, str],
) -> dict[str, list[str]]:
    """Return one sentence for each failure by its cause, as `EnergyAudit` has them.

    Args:
        scene: with batteries as they were.
        log: what was driven.
        goals_visited: ids of the goals that some robot visited.
        least_J: least measured content of each robot's battery.
        skipped: goals that the plan leaves out, with the proofs that no plan serves
            them.
    """
    finishes_missed = _finishes_missed(scene, log)
    missed = len(goals_visited) < len(scene.goals) or bool(finishes_missed)
    return {
        log.gave_up or "unfinished": _unfinished(log),
        "ended": _given_up(log, missed=missed),
        "goal missed": _goals_missed(scene, {*goals_visited, *skipped}),
        "finish missed": finishes_missed,
        GOAL_SKIPPED: [
            f"goal {goal} was left out: {proof}" for goal, proof in skipped.items()
        ],
        "contact": _contacts(log),
        "station shared": _crowded(scene, log),
        "late": _late(scene, log),
        "below reserve": _below_reserve(scene, least_J),
        "battery empty": _ran_empty(least_J),
    }


def _unfinished(log: ExecutionLog) -> list[str]:
    if log.completed:
        return []
    why = f" ({_TROUBLE[log.gave_up]})" if log.gave_up in _TROUBLE else ""
    return [f"the simulation was ended early, at {log.time_s[-1]:.1f} s{why}"]


def _given_up(log: ExecutionLog, *, missed: bool) -> list[str]:
    ended = {"end": "the mission was ended", "give_up": "goals were given up"}
    return [
        f"{ended[event.action]} at {event.time_s:.1f} s: {event.message}"
        for event in log.events
        if event.action in ended and missed
    ]


def _goals_missed(scene: Scene, visited: Set[str]) -> list[str]:
    return [
        f"goal {goal.id} was visited by no robot"
        for goal in scene.goals
        if goal.id not in visited
    ]


def _finishes_missed(scene: Scene, log: ExecutionLog) -> list[str]:
    """Say where robots with a finish ended; those that broke down need not get there.

    They stay where they are, and the mission is what the others make of it.
    """
    broken_down = {event.robot for event in log.events if event.cause == "fault"}
    reasons = []
    for robot, end in zip(scene.robots, log.state[:, -1:], strict=True):
        if robot.finish is None or robot.id in broken_down:
            continue
        if is_at(robot.finish, end)[0]:
            continue
        off_m = -float(robot.finish.region.depth(end[:, :2])[0])
        outside = f"{off_m:.3g} m outside its finish"
        how = outside if off_m > 0.0 else "in its finish with another heading"
        reasons.append(f"{robot.id} ended {how}")
    return reasons


def _crowded(scene: Scene, log: ExecutionLog) -> list[str]:
    paths = dict(zip(log.robots, log.state[:, :, :2], strict=True))
    return [
        f"{' and '.join(found.robots)} were both at {found.station} at "
        f"{log.time_s[found.first]:.1f} s, which is for one robot at a time"
        for found in crowded_stations(scene, paths)
    ]


def over_s(scene: Scene, log: ExecutionLog) -> float:
    """Return when a simulated mission was over: all at rest, no stay too short [s].

    Goals that were not visited do not count.
    """
    turning = [robot.model.motion_model != "car" for robot in scene.robots]
    rates = np.concatenate([log.state[:, :, 3], log.state[turning, :, 4]])
    moving = np.flatnonzero((np.abs(rates) > AT_REST).any(axis=0))
    last = min(int(moving.max(initial=-1)) + 1, len(log.time_s) - 1)
    stays = [
        [first_stay(goal, log.time_s, state, 0) for state in log.state]
        for goal in scene.goals
    ]
    ends = [[stay.over for stay in found if stay] for found in stays]
    return float(log.time_s[max([last, *(min(found) for found in ends if found)])])


def _late(scene: Scene, log: ExecutionLog) -> list[str]:
    done_s = over_s(scene, log)
    late_s = overtime_s(scene.time_limit_s, done_s)
    if not late_s:
        return []
    done, limit = compared(done_s, scene.time_limit_s, 2)
    late, _ = compared(late_s, 0.0, 2)
    return [
        f"the mission was over at {done} s, {late} s after its time limit of {limit} s"
    ]


def _contacts(log: ExecutionLog) -> list[str]:
    return [
        f"{contact.robot} touched {contact.other} at {contact.time_s:.2f} s "
        f"near ({contact.x_m:.2f}, {contact.y_m:.2f})"
        for contact in log.contacts
    ]


def _below_reserve(scene: Scene, least_J: Mapping[str, float]) -> list[str]:
    reasons = []
    for robot, content_J in least_J.items():
        reserve_J = scene.robot(robot).battery.reserve_J
        if 0.0 <= content_J < reserve_J:
            found, needed = compared(content_J, reserve_J)
            reasons.append(
                f"{robot}'s battery fell to {found} J, below its reserve of {needed} J"
            )
    return reasons


def _ran_empty(least_J: Mapping[str, float]) -> list[str]:
    return [
        f"{robot}'s battery ran empty, {compared(-content_J, 0.0)[0]} J short"
        for robot, content_J in least_J.items()
        if content_J < 0.0
    ]
