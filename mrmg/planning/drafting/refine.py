"""Refinement: robots drive along paths drawn tight.

Each robot's way is drawn tight (`band`) and driven in closed loop under committed
braking (`tracking`), so that margins to obstacles and
robots, dynamics and limits hold by construction. What goes wrong is put right, and the
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
from mrmg.planning.drafting._band_kernels import Surface
from mrmg.planning.drafting.band import (
    SPACINGS_M,
    Path,
    path_of,
    smooth_terrain,
    surface_of,
    visit_steps,
    wary,
)
from mrmg.planning.drafting.coordination.coordination import ROUNDS, coordinated
from mrmg.planning.drafting.errand import Errand
from mrmg.planning.drafting.pauses import missing_charge_s, with_pauses
from mrmg.planning.drafting.tracking import Drive, braking_places, redriven
from mrmg.planning.parameters import PlannerParams
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

CONTACT_M = 0.6
"""How much farther apart than they must be robots may be in each other's way."""

BLOCKING_M = 4.0
"""Distance within which another robot counts as being in the way."""

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
    for trajectories in smoothed(problem, params, tours, plan.trajectories, halt):
        found = make_plan(problem, plan.seed, params, trajectories, plan.tours)
        if found is not None and rank(found) < rank(best):
            best = found
    return best


def smoothed(
    problem: Problem,
    params: PlannerParams,
    tours: Sequence[list[int]],
    trajectories: Sequence[Trajectory],
    halt: np.ndarray,
) -> Iterator[tuple[Trajectory, ...]]:
    """Yield trajectories of all robots along the paths of given ones, drawn tight.

    Args:
        problem: the mission.
        params: parameters.
        tours: numbers of each robot's targets; where it must end comes last.
        trajectories: that visit them.
        halt: shape (1,); smoothing ends soon after it has turned true.
    """
    targets = problem.mission.targets
    kept = problem.mission.fleet["model"] == USER
    surfaces = surfaces_of(problem)
    errands = []
    for r, (tour, trajectory) in enumerate(zip(tours, trajectories, strict=True)):
        visits = visit_steps(targets, tour, trajectory)
        if len(visits) < len(tour):
            return
        repeated = len(trajectory.control) if kept[r] else 0
        stops = len(tour) - problem.steered_home[r]
        path = path_of(tour[:stops], visits[:stops], trajectory, repeated)
        errands.append(Errand(tour, path, surfaces[r], (trajectory, visits), repeated))
    yield from run_errands(problem, params, errands, halt)


def run_errands(
    problem: Problem,
    params: PlannerParams,
    errands: list[Errand],
    halt: np.ndarray,
    on_failure: OnFailure = lambda reason: None,
) -> Iterator[tuple[Trajectory, ...]]:
    """Draw paths tight and drive along them until nothing goes wrong any more.

    `on_failure` receives why driving failed, in words, if it does.

    Yields:
        The trajectories of all robots whenever they visit all targets: the first time,
        and after robots have been slowed down.
    """
    for errand in errands:
        errand.tighten(problem, SPACINGS_M)
    if problem.steered_home.any():
        yield from _coordinated(problem, errands, halt)
        on_failure("no motions were found that end with the headings asked for")
        return
    slower = tries = 0
    while tries < TRIES:
        outcome = redriven(
            problem,
            params,
            _paused(problem, errands),
            [errand.slow for errand in errands],
            [errand.controls() for errand in errands],
            halt,
        )
        if halt[0]:
            return
        if outcome.stuck >= 0 and in_the_way(problem, outcome) >= 0:
            yield from _coordinated(problem, errands, halt)
            on_failure(_no_progress(problem, errands, outcome))
            return
        tries += 1
        if outcome.stuck >= 0:
            if not _put_right(problem, errands[outcome.stuck], outcome.place):
                on_failure(_no_progress(problem, errands, outcome))
                return
            continue
        missed = [
            _led_deeper(problem, errand, trajectory)
            for errand, trajectory in zip(errands, outcome.trajectories, strict=True)
        ]
        slowed = slower < SLOWER and _slowed_down(problem, errands, outcome)
        slower += slowed
        if any(missed):
            continue
        if not _ends_well(problem, outcome):
            on_failure("not every robot ends where its finish asks for")
            return
        if _charged_longer(problem, errands, outcome):
            continue
        yield outcome.trajectories
        if not slowed:
            return
    on_failure(_no_progress(problem, errands, outcome))


def in_the_way(problem: Problem, outcome: Drive) -> int:
    """Return the robot that the stuck one cannot get past, -1 if there is none near."""
    fleet, r = problem.mission.fleet, outcome.stuck
    reach = fleet["radius"] + fleet["radius"][r]
    reach += np.maximum(fleet["spacing"], fleet["spacing"][r]) + CONTACT_M
    turn = np.stack([np.cos(outcome.state[:, 2]), np.sin(outcome.state[:, 2])], axis=1)
    left = np.stack([-turn[:, 1], turn[:, 0]], axis=1)
    offset = fleet["middle"]
    middle = outcome.state[:, :2] + offset[:, :1] * turn + offset[:, 1:] * left
    gap = np.hypot(*(middle - middle[r]).T) - reach
    gap[r] = np.inf
    return int(gap.argmin()) if gap.min() < 0.0 else -1


def _paused(problem: Problem, errands: Sequence[Errand]) -> list[Path]:
    """Return paths with how long robots stand at their stops."""
    return [
        with_pauses(problem, r, errand.path, errand.longer_s)
        for r, errand in enumerate(errands)
    ]


def _charged_longer(
    problem: Problem, errands: Sequence[Errand], outcome: Drive
) -> bool:
    """Prolong stays after which batteries ran low; tell if there were any."""
    prolonged = False
    for r, (errand, trajectory) in enumerate(
        zip(errands, outcome.trajectories, strict=True)
    ):
        missing_s = missing_charge_s(problem, r, errand.tour, trajectory)
        errand.longer_s = errand.longer_s + missing_s
        prolonged |= bool(missing_s.any())
    return prolonged


def _coordinated(
    problem: Problem, errands: Sequence[Errand], halt: np.ndarray
) -> Iterator[tuple[Trajectory, ...]]:
    """Yield trajectories near the robots' paths that do not meet, if there are any."""
    if any(errand.repeated for errand in errands):
        return
    paths = _paused(problem, errands)
    tours = [errand.tour for errand in errands]
    trajectories = coordinated(problem, tours, paths, halt, rounds=ROUNDS[:1])
    if trajectories:
        yield trajectories


def _no_progress(problem: Problem, errands: Sequence[Errand], outcome: Drive) -> str:
    """Return which robot made no progress in words, and where; "" if none did."""
    r = outcome.stuck
    if r < 0:
        return "robots miss targets of their tours"
    scene, path = problem.scene, errands[r].path
    ahead = np.flatnonzero(path.way[path.stop] > outcome.driven[r])
    target = int(path.target[ahead[0]]) if len(ahead) else -1
    places = [one.id for one in scene.targets()]
    where = (
        f"on its way to {places[target]}" if 0 <= target < len(places) else "at last"
    )
    apart_m = np.hypot(*(outcome.state[:, :2] - outcome.place).T)
    apart_m[r] = np.inf
    other = int(apart_m.argmin())
    near = apart_m[other] < BLOCKING_M
    by = f", with {scene.robots[other].id} in its way" if near else ""
    return f"{scene.robots[r].id} makes no progress {where}{by}"


def surfaces_of(problem: Problem) -> list[Surface]:
    """Return what each robot's paths are priced on."""
    smooth = smooth_terrain(problem.mission.terrain.multiplier)
    fleet = problem.mission.fleet
    # A radian of robots that slow down for it takes as long as so much way.
    top, rate = fleet["limit"][:, 1], fleet["limit"][:, 2]
    turning_m = np.where(fleet["model"] == UNICYCLE, top / rate, 0.0)
    surfaces = []
    for r, robot in enumerate(problem.scene.robots):
        share = energy_share(problem.scene.objective, robot)
        surface = surface_of(problem, r, smooth)
        if share < 1.0:
            worth = share * surface.multiplier + (1.0 - share)
            scrub = float(share * surface.scrub + (1.0 - share) * turning_m[r])
            surface = surface._replace(multiplier=worth, scrub=scrub)
        surfaces.append(surface)
    return surfaces


def tour_numbers(problem: Problem, plan: Plan) -> list[list[int]]:
    """Return each robot's targets by number; where it must end comes last."""
    number = {target.id: i for i, target in enumerate(problem.scene.targets())}
    finish = problem.mission.targets.finish
    return [
        [number[name] for name in plan.tours[trajectory.robot]] + [int(f)] * int(f >= 0)
        for trajectory, f in zip(plan.trajectories, finish, strict=True)
    ]


def _put_right(problem: Problem, errand: Errand, place: np.ndarray) -> bool:
    """Help a robot that got stuck at a place; False if there is no help."""
    near = [p for p in errand.swerves if np.hypot(*(p - place)) < NEAR_M]
    if len(near) < SWERVES:
        errand.swerves.append(place)
        errand.surface = wary(errand.surface, place)
        errand.tighten(problem, SPACINGS_M[-1:])
        return True
    if errand.before is None:
        return False
    trajectory, visits = errand.before
    behind = _behind(trajectory, place, errand.repeated)
    if behind is None:
        return False
    errand.repeated = behind
    errand.path = path_of(errand.tour, visits, trajectory, behind)
    errand.tighten(problem, SPACINGS_M)
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


def _led_deeper(problem: Problem, errand: Errand, trajectory: Trajectory) -> bool:
    """Lead a path deeper into the targets that were missed; tell if there were any."""
    targets = problem.mission.targets
    tour, path = errand.tour, errand.path
    if len(visit_steps(targets, tour, trajectory)) == len(tour):
        return False
    regions = planned_regions(problem.scene)
    state = trajectory.state[errand.repeated :, :2]
    deeper = path.deeper.copy()
    passed = 0
    for i, (node, t) in enumerate(zip(path.stop, path.target, strict=True)):
        step = passed + int(np.hypot(*(state[passed:] - path.node[node]).T).argmin())
        reached = float(regions[t].depth(state[step : step + 1])[0])
        if reached < TARGET_MARGIN_M:
            deeper[i] += TARGET_MARGIN_M - reached + DEEPER_M
        passed = step
    errand.path = replace(path, deeper=deeper)
    errand.tighten(problem, SPACINGS_M[-1:])
    return True


def _ends_well(problem: Problem, outcome: Drive) -> bool:
    """Tell whether every robot stands where, and as, it must end."""
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


def _slowed_down(problem: Problem, errands: Sequence[Errand], outcome: Drive) -> bool:
    """Slow robots down before places where they had to brake; tell if any had to."""
    places = [
        braking_places(problem, r, trajectory)
        for r, trajectory in enumerate(outcome.trajectories)
    ]
    for errand, found in zip(errands, places, strict=True):
        errand.slow += found
    return any(places)
