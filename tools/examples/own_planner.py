"""Plan with a planner of one's own: robots that turn on the spot, one at a time.

Usage: python own_planner.py FOLDER
"""

import sys
from collections.abc import Iterator
from itertools import pairwise
from math import atan2, hypot, pi
from pathlib import Path

import numpy as np

import mrmg
from mrmg.planning import Attempt, Problem, Request

TURNING_SHARE = 0.4
"""Share by which turning on the spot adds to the energy of driving, at most."""


def from_rest_to_rest(way: float, most: float, rate: float, dt_s: float) -> np.ndarray:
    """Return the accelerations that lead a distance or an angle on soonest."""
    n, plateau = 2, max(int(most / (rate * dt_s)), 1)
    while True:
        rising = np.minimum(np.arange(n + 1), plateau)
        shape = np.minimum(rising, rising[::-1])
        unit = way / (dt_s * shape.sum())
        if abs(unit) <= rate * dt_s:
            return np.diff(unit * shape) / dt_s
        n += 1


def moves(problem: Problem, robot: int, tour: tuple[int, ...]) -> Iterator[np.ndarray]:
    """Yield controls: turn to the next point of the roadmap's path, and drive there."""
    _, v_max, w_max, u1_max, u2_max = problem.mission.fleet[robot]["limit"]
    heading = problem.start[robot, 2]
    for dx, dy in np.diff(problem.path(robot, tour), axis=0):
        turn = (atan2(dy, dx) - heading + pi) % (2.0 * pi) - pi
        heading += turn
        u2 = from_rest_to_rest(turn, w_max, u2_max, problem.dt_s)
        u1 = from_rest_to_rest(hypot(dx, dy), v_max, u1_max, problem.dt_s)
        yield from (np.pad(u2[:, None], ((0, 0), (1, 0))), np.outer(u1, [1.0, 0.0]))


def one_at_a_time(problem: Problem, request: Request) -> Attempt:
    """Return the plan in which each robot waits for those before it."""
    tours = request.tours(problem.with_margin(TURNING_SHARE)).tours
    own = [np.vstack([[0, 0], *moves(problem, r, t)]) for r, t in enumerate(tours)]
    start = np.cumsum([0, *map(len, own)])
    waits = [((a, start[-1] - b), (0, 0)) for a, b in pairwise(start)]
    controls = map(np.pad, own, waits)
    driven = [problem.trajectory(r, each) for r, each in enumerate(controls)]
    plan = request.plan(problem, driven, problem.visits(tours))
    return Attempt([] if plan is None else [plan])


if __name__ == "__main__":
    plan = mrmg.plan(mrmg.load_scene("diffdrive"), planner=one_at_a_time).plan
    print(f"planned by {plan.planner}: {plan.makespan_s:.0f} s")
    plan.save(Path(sys.argv[1]))
