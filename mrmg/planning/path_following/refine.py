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

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import chain

import numpy as np

from mrmg.motion._kernels import UNICYCLE, USER
from mrmg.planning.assembly import make_plan
from mrmg.planning.parameters import PlannerParams
from mrmg.planning.path_following._band_kernels import CostMap
from mrmg.planning.path_following.band import SPACINGS_M, path_of, visit_steps
from mrmg.planning.path_following.coordination.coordination import coordinated
from mrmg.planning.path_following.coordination.rounds import ROUNDS, Round
from mrmg.planning.path_following.coordination.tasks import no_path
from mrmg.planning.path_following.cost_map import cost_map_of, inflated, smooth_terrain
from mrmg.planning.path_following.pauses import with_pauses
from mrmg.planning.path_following.robot_task import RobotTask
from mrmg.planning.path_following.tracking import Drive, Motion, drive_alone
from mrmg.planning.problem._control_kernels import wrap
from mrmg.planning.problem._target_kernels import at_target
from mrmg.planning.problem.problem import Problem
from mrmg.planning.problem.targets import target_depth_m
from mrmg.planning.problem.time_weighting import energy_share
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


@dataclass(frozen=True, slots=True)
class FleetDrive:
    """What driving the fleet along its paths gave.

    Attributes:
        trajectories: of all robots; empty if it failed.
        failure: why it did, in words.
    """

    trajectories: tuple[Trajectory, ...]
    failure: str = ""


def refine(
    problem: Problem, params: PlannerParams, plan: Plan, halt: np.ndarray
) -> Plan:
    """Return a plan that is better than `plan`, or `plan` itself.

    Args:
        problem: the mission.
        params: parameters.
        plan: a valid plan.
        halt: shape (1,); refinement ends soon after it has turned true.
    """
    tours = tour_numbers(problem, plan)
    trajectories = along_trajectories(problem, tours, plan.trajectories, halt)
    if not trajectories:
        return plan
    found = make_plan(problem, plan.seed, params, trajectories, plan.tours)
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
    return drive_paths(problem, tasks, halt).trajectories


def drive_paths(
    problem: Problem,
    tasks: Sequence[RobotTask],
    halt: np.ndarray,
    others: Callable[[int], Iterable[RobotTask]] = lambda r: (),
    *,
    rounds: Sequence[Round] = ROUNDS[:1],
) -> FleetDrive:
    """Smooth paths and drive the fleet along them.

    Each robot drives as if it were alone; where robots get in each other's way, a
    search for motions starts from their paths.

    Args:
        problem: the mission.
        tasks: what each robot drives; changed as its path is.
        halt: shape (1,); driving ends soon after it has turned true.
        others: what a robot that does not get through may drive instead.
        rounds: of the search for motions.
    """
    tasks, drives = list(tasks), []
    for r in range(len(tasks)):
        drive, failures = None, list[str]()
        for task in chain([tasks[r]], others(r)):
            if halt[0]:
                return FleetDrive(())
            cost_map = task.cost_map
            drive, failure = _driven(problem, r, task)
            task.cost_map = cost_map  # maps that led round places are large
            failures.append(failure)
            if drive is not None or not failure:
                tasks[r] = task
                break
        else:
            return FleetDrive((), failures[0])
        drives.append(drive)
    trajectories = coordinated(
        problem,
        [task.tour for task in tasks],
        [with_pauses(problem, r, task.path) for r, task in enumerate(tasks)],
        halt,
        rounds=rounds,
        drives=drives,
    )
    if trajectories:
        return FleetDrive(trajectories)
    return FleetDrive((), ROBOTS_MEET)


def _driven(problem: Problem, r: int, task: RobotTask) -> tuple[Drive | None, str]:
    """Return robot r's drive along its path, put right as often as it takes.

    None, and why, if there is none. None, too, of a robot whose motions are searched
    for.
    """
    if task.searched:
        return None, ""
    if problem.mission.fleet[r]["model"] == USER:
        return task.before, ""
    first = task.path
    task.smooth(problem, SPACINGS_M)
    drive, failure = _put_right(problem, r, task)
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
    tour, reason = task.path.target.tolist(), ""
    for _ in range(TRIES):
        drive = drive_alone(problem, r, with_pauses(problem, r, task.path))
        end = drive.motion.state[-1]
        if not drive.arrived:
            place = end[:2]
            near = [p for p in task.inflations if np.hypot(*(p - place)) < NEAR_M]
            reason = f"{robot} finds no room {_on_its_way(problem, task, drive)}"
            if len(near) >= SWERVES:
                break
            task.inflations.append(place)
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


def cost_maps_of(problem: Problem) -> list[CostMap]:
    """Return what each robot's paths are priced on."""
    smooth = smooth_terrain(problem.mission.terrain.multiplier)
    fleet = problem.mission.fleet
    # A radian of robots that slow down for it takes as long as so much way.
    top, rate = fleet["limit"][:, 1], fleet["limit"][:, 2]
    turning_m = np.where(fleet["model"] == UNICYCLE, top / rate, 0.0)
    cost_maps = []
    for r, robot in enumerate(problem.scene.robots):
        share = energy_share(problem.scene.objective, robot)
        cost_map = cost_map_of(problem, r, smooth)
        if share < 1.0:
            worth = share * cost_map.multiplier + (1.0 - share)
            scrub = float(share * cost_map.scrub + (1.0 - share) * turning_m[r])
            cost_map = cost_map._replace(multiplier=worth, scrub=scrub)
        cost_maps.append(cost_map)
    return cost_maps


def tour_numbers(problem: Problem, plan: Plan) -> list[list[int]]:
    """Return each robot's targets by number; where it must end comes last."""
    number = {target.id: i for i, target in enumerate(problem.scene.targets())}
    finish = problem.mission.targets.finish
    return [
        [number[name] for name in plan.tours[trajectory.robot]] + [int(f)] * int(f >= 0)
        for trajectory, f in zip(plan.trajectories, finish, strict=True)
    ]


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
        off = wrap(float(at[2] - target["heading"][t]))
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
