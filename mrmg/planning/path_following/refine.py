"""Refinement: paths are smoothed and followed again.

Each robot's path is smoothed (`band`) and followed in closed loop (`tracking`), as if
the robot were alone. What goes wrong is put right, and it drives again: where it would
run into an obstacle, its path is led farther from obstacles; where it misses a target,
deeper into it, or to another heading. Where robots then meet, a search over their
motions that starts from their paths (`coordination`) decides who waits, or goes round.

A refined plan counts only if it visits the same targets in the same order as deep,
keeps every battery above its reserve, and is better by the scene's objective.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from math import remainder, tau

import numpy as np

from mrmg.motion._kernels import CAR, USER
from mrmg.planning.attempt import Request
from mrmg.planning.path_following.band import SPACINGS_M, path_of, visit_steps
from mrmg.planning.path_following.coordination.coordination import coordinated
from mrmg.planning.path_following.coordination.rounds import ROUNDS, Round
from mrmg.planning.path_following.coordination.tasks import no_path
from mrmg.planning.path_following.cost_map import cost_maps_of, inflated
from mrmg.planning.path_following.gears import smoothed_cost_m
from mrmg.planning.path_following.pauses import with_pauses
from mrmg.planning.path_following.poses import posed
from mrmg.planning.path_following.robot_task import RobotTask
from mrmg.planning.path_following.tracking import Drive, Motion, drive_alone
from mrmg.planning.problem._target_kernels import at_target
from mrmg.planning.problem.problem import Problem
from mrmg.planning.problem.targets import target_depth_m, whole_tours
from mrmg.planning.roadmap.vertices import planned_regions
from mrmg.plans import Plan, Trajectory

TRIES = 14
"""Times that driving is repeated with what went wrong put right."""

DEEPER_M = 0.005
"""How much deeper than it was missed by a target is entered the next time."""

SWERVES = 3
"""Times that a robot's path is led round a place."""

ROBOTS_MEET = "no motions were found that keep the robots apart"
"""Why driving failed where robots get in each other's way."""

NEAR_M = 3.0
"""How near to each other two places are the same."""


def refine(problem: Problem, request: Request, plan: Plan) -> Plan:
    """Return a plan that is better than `plan`, or `plan` itself.

    Args:
        problem: the mission.
        request: the attempt, by whose seed the plan was found.
        plan: a valid plan.
    """
    tours = tour_numbers(problem, plan)
    trajectories = along_trajectories(problem, tours, plan.trajectories, request.halt)
    if not trajectories:
        return plan
    found = request.plan(problem, trajectories, plan.tours)
    rank = problem.preference.rank
    return found if found is not None and rank(found) < rank(plan) else plan


def along_trajectories(
    problem: Problem,
    tours: Sequence[list[int]],
    trajectories: Sequence[Trajectory],
    halt: np.ndarray,
) -> tuple[Trajectory, ...]:
    """Return trajectories of all robots along the smoothed paths of given ones.

    A robot that cannot be helped otherwise drives as before.

    Args:
        problem: the mission.
        tours: numbers of each robot's targets; where it must end comes last.
        trajectories: that visit them.
        halt: shape (1,); smoothing ends soon after it has turned true.

    Returns:
        Empty if there are none.
    """
    targets = problem.mission.targets
    kept = problem.mission.fleet["model"] == USER
    cost_maps = cost_maps_of(problem)
    tasks = []
    for r, (tour, trajectory) in enumerate(zip(tours, trajectories, strict=True)):
        visits = visit_steps(targets, tour, trajectory.state)
        if len(visits) < len(tour):
            return ()
        path = no_path(problem, r)
        if not kept[r]:
            path = path_of(tour, visits, problem.aims(r, tour), trajectory)
        before = Drive(Motion(trajectory.state, trajectory.control), True, np.zeros(0))
        tasks.append(RobotTask(tour, path, cost_maps[r], before))
    return drive_paths(problem, tasks, halt)[0]


def drive_paths(
    problem: Problem,
    tasks: Sequence[RobotTask],
    halt: np.ndarray,
    *,
    soon: bool | None = None,
    rounds: Sequence[Round] = ROUNDS[:1],
) -> tuple[tuple[Trajectory, ...], str]:
    """Smooth paths and drive the fleet along them.

    Each robot drives as if it were alone; where robots get in each other's way, a
    search for motions starts from their paths.

    Args:
        problem: the mission.
        tasks: what each robot drives; changed as its path is.
        halt: shape (1,); driving ends soon after it has turned true.
        soon: whether ways over poses are wanted soon rather than cheap; None to do
            without.
        rounds: of the search for motions.

    Returns:
        Trajectories of all robots, none if it failed; and why it did, in words.
    """
    driven, drives = list[RobotTask](), list[Drive | None]()
    for r, task in enumerate(tasks):
        if halt[0]:
            return (), ""
        failures = []
        for way in _ways(problem, r, task, halt, soon):
            drive, failure = _driven(problem, r, way)
            failures.append(failure)
            if drive is not None or not failure:
                break
        else:
            return (), failures[0]
        driven.append(way)
        drives.append(drive)
    trajectories = coordinated(
        problem,
        [way.tour for way in driven],
        [with_pauses(problem, r, way.path) for r, way in enumerate(driven)],
        halt,
        rounds=rounds,
        drives=drives,
    )
    if trajectories:
        return trajectories, ""
    return (), ROBOTS_MEET


def _ways(
    problem: Problem, r: int, task: RobotTask, halt: np.ndarray, soon: bool | None
) -> Iterator[RobotTask]:
    """Yield what robot r drives, one after another until it gets through.

    That is its path, then a way over poses. Where there is time, a car with headings to
    arrive in begins with the cheaper one: a path has few ways to turn round.
    """
    if soon is None:
        yield task
        return
    over_poses = partial(posed, problem, r, task.cost_map, task.tour, halt, soon=soon)
    car = problem.mission.fleet[r]["model"] == CAR
    if soon or not car or not np.isfinite(task.path.aim).any():
        yield task
        yield from filter(None, [over_poses()])
        return
    ways = filter(None, [task, over_poses()])
    cost_m = partial(smoothed_cost_m, problem, r, task.cost_map)
    yield from sorted(ways, key=lambda one: cost_m(one.path))


def _driven(problem: Problem, r: int, task: RobotTask) -> tuple[Drive | None, str]:
    """Return robot r's drive along its path, put right as often as it takes.

    None, and why, if there is none. None, too, of a robot whose motions are searched
    for, as no path leads it to its targets.
    """
    user = problem.mission.fleet[r]["model"] == USER
    if user or len(task.path.target) < len(task.tour):
        return task.before, ""
    first, cost_map = task.path, task.cost_map
    task.smooth(problem, SPACINGS_M)
    drive, failure = _put_right(problem, r, task)
    task.cost_map = cost_map  # maps that led round places are large
    if drive is task.before:
        task.path = first
    return drive, failure


def _put_right(problem: Problem, r: int, task: RobotTask) -> tuple[Drive | None, str]:
    """Return robot r's drive along its path to all that it leads to, or None, and why.

    Args:
        problem: the mission.
        r: robot.
        task: its path is led round where it finds no room, and deeper into targets.
    """
    targets, robot = problem.mission.targets, problem.scene.robots[r].id
    tour, reason, inflations = task.path.target.tolist(), "", list[np.ndarray]()
    for _ in range(TRIES):
        drive = drive_alone(problem, r, with_pauses(problem, r, task.path))
        end = drive.motion.state[-1]
        if not drive.arrived:
            place = end[:2]
            near = [p for p in inflations if np.hypot(*(p - place)) < NEAR_M]
            reason = f"{robot} finds no room {_on_its_way(problem, task, drive)}"
            if len(near) >= SWERVES:
                break
            inflations.append(place)
            task.cost_map = inflated(task.cost_map, place)
            task.smooth(problem, SPACINGS_M[-1:])
        elif len(visit_steps(targets, tour, drive.motion.state)) < len(tour):
            reason = f"{robot} misses targets of its tour"
            _aim_better(problem, task, drive.motion.state)
        elif targets.finish[r] in tour and not at_target(targets, tour[-1], end):
            reason = f"{robot} does not end where its finish requires"
            if not np.isfinite(task.path.aim[-1]):
                break
            _aim_better(problem, task, drive.motion.state)
        else:
            return drive, ""
    return task.before, reason


def _on_its_way(problem: Problem, task: RobotTask, drive: Drive) -> str:
    """Return in words between which targets a drive ended."""
    ahead = np.flatnonzero(np.isinf(drive.spent_s[task.path.stop]))
    places = problem.scene.targets()
    target = int(task.path.target[ahead[0]]) if len(ahead) else len(places)
    name = places[target].id if target < len(places) else "where it must end"
    return f"on its way to {name}"


def tour_numbers(problem: Problem, plan: Plan) -> list[list[int]]:
    """Return each robot's targets by number; where it must end comes last."""
    number = {target.id: i for i, target in enumerate(problem.scene.targets())}
    robots = problem.scene.robots
    tours = [[number[name] for name in plan.tours[robot.id]] for robot in robots]
    return whole_tours(problem.mission.targets, tours)


def _aim_better(problem: Problem, task: RobotTask, state: np.ndarray) -> None:
    """Lead a path deeper into targets, and to other headings, as much as was missed."""
    path, depth_m = task.path, target_depth_m(problem.scene)
    regions, target = planned_regions(problem.scene), problem.mission.targets.target
    deeper, aim = path.deeper.copy(), path.aim.copy()
    nearest = state[nearest_in_order(state[:, :2], path.node[path.stop])]
    for i, (at, t) in enumerate(zip(nearest, path.target, strict=True)):
        reached = float(regions[t].depth(at[None, :2])[0])
        if reached < depth_m:
            deeper[i] += depth_m - reached + DEEPER_M
        off = remainder(float(at[2] - target["heading"][t]), tau)
        if abs(off) > target["tolerance"][t]:
            aim[i] -= off
    task.path = replace(path, deeper=deeper, aim=aim)
    task.smooth(problem, SPACINGS_M[-1:])


def nearest_in_order(way: np.ndarray, places: np.ndarray) -> list[int]:
    """Return which points of a way are nearest to places that it passes in this order.

    Those whose distances have the least sum; a place may come twice.

    Args:
        way: shape (n, 2).
        places: shape (m, 2).
    """
    sums_m = [np.zeros(len(way))]
    for place in places:
        before = np.minimum.accumulate(sums_m[-1])
        sums_m.append(before + np.hypot(*(way - place).T))
    nearest = [len(way) - 1]
    for sum_m in reversed(sums_m[1:]):
        nearest.append(int(sum_m[: nearest[-1] + 1].argmin()))
    return nearest[:0:-1]
