"""Refinement: paths are smoothed and followed again.

Each robot's path is smoothed (`band`) and followed in closed loop under contingency
braking (`tracking`), so that margins to obstacles and robots, dynamics and limits hold
by construction. What goes wrong is put right, and the
fleet drives again: where a robot does not get along its path (it is stuck in a tight
place, or in the way of another), its path is led farther from obstacles; where it
misses a target, deeper into it; where it has to brake, it arrives more slowly.

A refined plan counts only if it visits the same targets in the same order as deep,
keeps every battery above its reserve, and is better by the scene's objective.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from mrmg.motion._kernels import UNICYCLE, USER
from mrmg.planning.assembly import make_plan
from mrmg.planning.parameters import PlannerParams
from mrmg.planning.path_following._band_kernels import CostMap
from mrmg.planning.path_following.band import SPACINGS_M, Path, path_of, visit_steps
from mrmg.planning.path_following.coordination.coordination import ROUNDS, coordinated
from mrmg.planning.path_following.cost_map import cost_map_of, inflated, smooth_terrain
from mrmg.planning.path_following.pauses import with_pauses
from mrmg.planning.path_following.progress import in_the_way, no_progress
from mrmg.planning.path_following.robot_task import RobotTask
from mrmg.planning.path_following.tracking import Drive, braking_places, redriven
from mrmg.planning.problem._control_kernels import wrap
from mrmg.planning.problem._target_kernels import in_target
from mrmg.planning.problem.problem import Problem
from mrmg.planning.problem.targets import TARGET_MARGIN_M
from mrmg.planning.problem.time_weighting import energy_share
from mrmg.planning.roadmap.vertices import planned_regions
from mrmg.plans import Plan, Trajectory

TRIES = 14
"""Times that driving is repeated with what went wrong put right."""

SLOWER = 3
"""Times that it is repeated only to spare braking."""

DEEPER_M = 0.02
"""How much deeper than it was missed by a target is entered the next time."""

SWERVES = 3
"""Times that a robot's path is led round a place before it drives as before."""

NEAR_M = 3.0
"""How near to each other two places are the same."""

OnFailure = Callable[[str], None]
"""Receives why driving along paths failed, in words."""

REPEATED_S = 4.0
"""How long after the place where a robot got stuck it still drives as before."""


def refine(
    problem: Problem, params: PlannerParams, plan: Plan, halt: np.ndarray
) -> Plan:
    """Return a plan that is better than `plan`, or `plan` itself.

    A robot that cannot be helped otherwise drives as before up to behind the place.

    Args:
        problem: the mission.
        params: parameters.
        plan: a valid plan.
        halt: shape (1,); refinement ends soon after it has turned true.
    """
    best = plan
    rank = problem.preference.rank
    tours = tour_numbers(problem, plan)
    for trajectories in along_trajectories(
        problem, params, tours, plan.trajectories, halt
    ):
        found = make_plan(problem, plan.seed, params, trajectories, plan.tours)
        if found is not None and rank(found) < rank(best):
            best = found
    return best


def along_trajectories(
    problem: Problem,
    params: PlannerParams,
    tours: Sequence[list[int]],
    trajectories: Sequence[Trajectory],
    halt: np.ndarray,
) -> Iterator[tuple[Trajectory, ...]]:
    """Yield trajectories of all robots along the smoothed paths of given ones.

    Args:
        problem: the mission.
        params: parameters.
        tours: numbers of each robot's targets; where it must end comes last.
        trajectories: that visit them.
        halt: shape (1,); smoothing ends soon after it has turned true.
    """
    targets = problem.mission.targets
    kept = problem.mission.fleet["model"] == USER
    cost_maps = cost_maps_of(problem)
    tasks = []
    for r, (tour, trajectory) in enumerate(zip(tours, trajectories, strict=True)):
        visits = visit_steps(targets, tour, trajectory)
        if len(visits) < len(tour):
            return
        repeated = len(trajectory.control) if kept[r] else 0
        stops = len(tour) - problem.steered_home[r]
        path = path_of(tour[:stops], visits[:stops], trajectory, repeated)
        tasks.append(
            RobotTask(tour, path, cost_maps[r], (trajectory, visits), repeated)
        )
    yield from drive_paths(problem, params, tasks, halt)


def drive_paths(
    problem: Problem,
    params: PlannerParams,
    tasks: list[RobotTask],
    halt: np.ndarray,
    on_failure: OnFailure = lambda reason: None,
) -> Iterator[tuple[Trajectory, ...]]:
    """Smooth paths and drive along them until nothing goes wrong any more.

    `on_failure` receives why driving failed, in words, if it does.

    Yields:
        The trajectories of all robots whenever they visit all targets: the first time,
        and after robots have been slowed down.
    """
    for task in tasks:
        task.smooth(problem, SPACINGS_M)
    if problem.steered_home.any():
        yield from _coordinated(problem, tasks, halt)
        on_failure("no motions were found that end with the headings asked for")
        return
    slower = tries = 0
    while tries < TRIES:
        outcome = redriven(
            problem,
            params,
            _paused(problem, tasks),
            [task.slow for task in tasks],
            [task.controls() for task in tasks],
            halt,
        )
        if halt[0]:
            return
        if outcome.stuck >= 0 and in_the_way(problem, outcome) >= 0:
            yield from _coordinated(problem, tasks, halt)
            on_failure(no_progress(problem, tasks, outcome))
            return
        tries += 1
        if outcome.stuck >= 0:
            if not _inflate(problem, tasks[outcome.stuck], outcome.place):
                on_failure(no_progress(problem, tasks, outcome))
                return
            continue
        missed = [
            _entered_deeper(problem, task, trajectory)
            for task, trajectory in zip(tasks, outcome.trajectories, strict=True)
        ]
        slowed = slower < SLOWER and _slowed_down(problem, tasks, outcome)
        slower += slowed
        if any(missed):
            continue
        if not _ends_well(problem, outcome):
            on_failure("not every robot ends where its finish requires")
            return
        yield outcome.trajectories
        if not slowed:
            return
    on_failure(no_progress(problem, tasks, outcome))


def _paused(problem: Problem, tasks: Sequence[RobotTask]) -> list[Path]:
    """Return paths with how long robots stand at their stops."""
    return [with_pauses(problem, r, task.path) for r, task in enumerate(tasks)]


def _coordinated(
    problem: Problem, tasks: Sequence[RobotTask], halt: np.ndarray
) -> Iterator[tuple[Trajectory, ...]]:
    """Yield trajectories near the robots' paths that do not meet, if there are any."""
    if any(task.repeated for task in tasks):
        return
    paths = _paused(problem, tasks)
    tours = [task.tour for task in tasks]
    trajectories = coordinated(problem, tours, paths, halt, rounds=ROUNDS[:1])
    if trajectories:
        yield trajectories


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


def _inflate(problem: Problem, task: RobotTask, place: np.ndarray) -> bool:
    """Help a robot that got stuck at a place; False if there is no help."""
    near = [p for p in task.inflations if np.hypot(*(p - place)) < NEAR_M]
    if len(near) < SWERVES:
        task.inflations.append(place)
        task.cost_map = inflated(task.cost_map, place)
        task.smooth(problem, SPACINGS_M[-1:])
        return True
    if task.before is None:
        return False
    trajectory, visits = task.before
    behind = _behind(trajectory, place, task.repeated)
    if behind is None:
        return False
    task.repeated = behind
    task.path = path_of(task.tour, visits, trajectory, behind)
    task.smooth(problem, SPACINGS_M)
    return True


def _behind(trajectory: Trajectory, place: np.ndarray, given: int) -> int | None:
    """Return the step up to which a robot that got stuck at a place drives as before.

    None if it did so to the end already.
    """
    n = len(trajectory.control)
    if given >= n:
        return None
    rest = trajectory.state[given + 1 :, :2]
    nearest = int(np.hypot(*(rest - place).T).argmin())
    return min(n, given + 1 + nearest + int(REPEATED_S / trajectory.dt_s))


def _entered_deeper(problem: Problem, task: RobotTask, trajectory: Trajectory) -> bool:
    """Lead a path deeper into the targets that were missed; tell if there were any."""
    targets = problem.mission.targets
    tour, path = task.tour, task.path
    if len(visit_steps(targets, tour, trajectory)) == len(tour):
        return False
    regions = planned_regions(problem.scene)
    state = trajectory.state[task.repeated :, :2]
    deeper = path.deeper.copy()
    passed = 0
    for i, (node, t) in enumerate(zip(path.stop, path.target, strict=True)):
        step = passed + int(np.hypot(*(state[passed:] - path.node[node]).T).argmin())
        reached = float(regions[t].depth(state[step : step + 1])[0])
        if reached < TARGET_MARGIN_M:
            deeper[i] += TARGET_MARGIN_M - reached + DEEPER_M
        passed = step
    task.path = replace(path, deeper=deeper)
    task.smooth(problem, SPACINGS_M[-1:])
    return True


def _ends_well(problem: Problem, outcome: Drive) -> bool:
    """Return whether every robot stands where, and as, it must end."""
    targets = problem.mission.targets
    for state, finish, heading, tolerance in zip(
        outcome.state, targets.finish, targets.heading, targets.tolerance, strict=True
    ):
        if finish >= 0 and not (
            in_target(targets, finish, state[0], state[1])
            and abs(wrap(heading - state[2])) <= tolerance
        ):
            return False
    return True


def _slowed_down(problem: Problem, tasks: Sequence[RobotTask], outcome: Drive) -> bool:
    """Slow robots down before places where they had to brake; tell if any had to."""
    places = [
        braking_places(problem, r, trajectory)
        for r, trajectory in enumerate(outcome.trajectories)
    ]
    for task, found in zip(tasks, places, strict=True):
        task.slow += found
    return any(places)
