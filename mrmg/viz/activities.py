"""What each robot does when, and what of plan or log a picture shows."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from mrmg.energy.metering import Motion
from mrmg.energy.visits import runs
from mrmg.plans import Plan, Visit
from mrmg.scene.types import Robot, Scene
from mrmg.simulation.log import ExecutionLog

DRIVING, WAITING, CHARGING, FINISHED = "driving", "waiting", "charging", "finished"
BROKEN = "broken"
"""What a robot can be doing."""

_STANDING_M_S = 0.02
_SHORTEST_WAIT_S = 0.5


@dataclass(frozen=True, slots=True, kw_only=True)
class Activity:
    """A span of time in which a robot does one thing.

    Attributes:
        kind: `DRIVING`; `WAITING`, standing for half a second or more; `CHARGING`, from
            entering a station of its tour to leaving the region; `FINISHED`, standing
            to the end; or `BROKEN`, from when it broke down.
        start_s, end_s: when.
        target: id of the station where charging, else "".
    """

    kind: str
    start_s: float
    end_s: float
    target: str = ""


def activities(
    scene: Scene,
    motion: Motion,
    visits: Iterable[Visit],
    broken_s: float | None = None,
) -> tuple[Activity, ...]:
    """Return what a robot does, span by span, without gaps.

    Args:
        scene: gives the stations' regions.
        motion: planned or driven.
        visits: of this robot; those of stations begin spans of charging.
        broken_s: when it broke down; None if it did not.
    """
    kinds = np.full(len(motion.time_s), DRIVING, dtype=object)
    standing = np.abs(motion.state[:, 3]) < _STANDING_M_S
    for start, end in runs(standing):
        if end == len(standing):
            kinds[start:] = FINISHED
        elif motion.time_s[end] - motion.time_s[start] >= _SHORTEST_WAIT_S:
            kinds[start:end] = WAITING
    names = np.full(len(kinds), "", dtype=object)
    regions = {station.id: station.region for station in scene.stations}
    for visit in visits:
        if visit.kind == "station":
            inside = regions[visit.target].depth(motion.state[visit.step :, :2]) >= 0.0
            left = visit.step + (len(inside) if inside.all() else int(inside.argmin()))
            kinds[visit.step : left] = CHARGING
            names[visit.step : left] = visit.target
    if broken_s is not None:
        kinds[motion.time_s >= broken_s] = BROKEN
        names[motion.time_s >= broken_s] = ""
    changes = (kinds[1:] != kinds[:-1]) | (names[1:] != names[:-1])
    edges = [0, *(np.flatnonzero(changes) + 1).tolist(), len(kinds) - 1]
    return tuple(
        Activity(
            kind=kinds[start],
            start_s=float(motion.time_s[start]),
            end_s=float(motion.time_s[end]),
            target=names[start],
        )
        for start, end in zip(edges, edges[1:], strict=False)
        if end > start
    )


def visit_ranks(plan: Plan) -> dict[str, list[tuple[str, int]]]:
    """Return the visits of each target as (robot, rank in its tour from 1)."""
    ranks: dict[str, list[tuple[str, int]]] = {}
    for robot, tour in plan.tours.items():
        for rank, target in enumerate(tour, start=1):
            ranks.setdefault(target, []).append((robot, rank))
    return ranks


def legs_of_stops(tour: Iterable[str], visited: Sequence[str]) -> list[int | None]:
    """Return the number of the leg to each stop of a tour; None where it was missed.

    Args:
        tour: ids of goals and stations.
        visited: the same in order of visits, without those that were missed; each ends
            a leg.
    """
    legs: list[int | None] = []
    done = 0
    for target in tour:
        reached = done < len(visited) and visited[done] == target
        legs.append(done if reached else None)
        done += reached
    return legs


def stops_behind(
    tour: Sequence[str], visits: Sequence[Visit], steps: int | np.ndarray
) -> np.ndarray:
    """Return how many stops of its tour a robot has behind it, those missed included.

    Args:
        tour: ids of goals and stations.
        visits: of this robot, in order.
        steps: of its motion, shape (n,), or one step.

    Returns:
        One number for each step; a robot heads for the stop of that number.
    """
    legs = legs_of_stops(tour, [visit.target for visit in visits])
    behind = np.array([0, *(legs.index(leg) + 1 for leg in range(len(visits)))])
    done = np.searchsorted([visit.step for visit in visits], steps, "right")
    return np.asarray(behind[done])


def lengths_along(states: np.ndarray) -> np.ndarray:
    """Return the length of the path up to each state [m], shape (n,)."""
    steps_m = np.hypot(*np.diff(states[:, :2], axis=0).T)
    return np.concatenate([[0.0], np.cumsum(steps_m)])


def thinned(points: np.ndarray, spacing_m: float) -> np.ndarray:
    """Return points of a path about `spacing_m` apart, both ends included."""
    marks = np.floor(lengths_along(points) / spacing_m)
    kept = np.diff(marks, prepend=-1.0) > 0.0
    kept[-1] = True
    return np.asarray(points[kept])


def breakdowns(log: ExecutionLog | None) -> dict[str, float]:
    """Return when each robot that broke down did so [s], by robot."""
    events = log.events if log is not None else ()
    return {event.robot: event.time_s for event in events if event.cause == "fault"}


def standing_of(robot: Robot, plan: Plan, log: ExecutionLog | None) -> str:
    """Return "broken down", "not used", or "" of a robot with a way of its own.

    That is a tour, or a way to its finish.
    """
    if robot.id in breakdowns(log):
        return "broken down"
    pose = plan.trajectory(robot.id).state[:, :3]
    leads_home = robot.finish is not None and bool((pose != pose[0]).any())
    return "" if plan.tours.get(robot.id) or leads_home else "not used"
