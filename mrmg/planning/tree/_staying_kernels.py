"""Staying at goals and stations: for a dwell time, or until the battery is full.

A robot that must stay at its target drives on until braking would end inside, brakes,
stands while its time there counts, and has visited the target when that is over.
"""

from __future__ import annotations

import numpy as np

from mrmg.compilation import kernel
from mrmg.energy.model import CONSUMERS_W
from mrmg.planning.problem._target_kernels import in_target

FULL = 1.0 - 1e-9
"""Share of the capacity from which a battery counts as full."""

ROUNDING_S = 1e-6
"""Rounding of summed steps that is forgiven in how long a robot stays."""

WORTH_M_S = 0.05
"""Way as which each second that must still be stayed counts in rating vertices."""


@kernel
def must_stay(mission, r, t):
    """Tell whether robot r has to stay at target t to visit it."""
    targets = mission.targets
    if t < 0 or t >= targets.places:
        return False
    if targets.dwell[t] > 0.0:
        return True
    return t >= targets.goals and mission.fleet[r].charge < np.inf


@kernel
def has_stayed(mission, r, t, spent, energy):
    """Tell whether `spent` seconds at target t and an energy there are enough."""
    if spent < mission.targets.dwell[t] - ROUNDING_S:
        return False
    robot = mission.fleet[r]
    if t < mission.targets.goals or robot.charge == np.inf:
        return True
    return energy >= FULL * robot.capacity


@kernel
def staying_worth(mission, r, t, spent, energy):
    """Return the energy as which the rest of a stay counts in rating vertices [J].

    It only has to fall while a robot stays, so that the search goes on from there.
    """
    robot = mission.fleet[r]
    left = mission.targets.dwell[t] - spent
    if t >= mission.targets.goals and robot.charge < np.inf:
        power = robot.charge - robot.energy[CONSUMERS_W]
        left = max(left, (robot.capacity - energy) / power)
    return WORTH_M_S * robot.plain * max(left, 0.0)


@kernel
def note_arrivals(mission, state, energy, visited, serving, spent, target):
    """Mark goals that robots have visited, and let stations give what they give.

    Args:
        mission: the problem.
        state: after a step, shape (R, 5).
        energy, visited: changed in place.
        serving: target at which each robot stays, -1 for none; changed in place (R,).
        spent: for how long it has done so [s]; changed in place, shape (R,).
        target: each robot's next target, -1 for none, shape (R,).

    Returns:
        Whether any visit was completed.
    """
    targets, fleet = mission.targets, mission.fleet
    event = False
    for r in range(len(target)):
        x, y = state[r, 0], state[r, 1]
        for g in range(targets.goals):
            passing = not visited[g] and targets.dwell[g] == 0.0
            if passing and in_target(targets, g, x, y):
                visited[g] = True
                event = True
        t = target[r]
        if t < 0 or t >= targets.places or not in_target(targets, t, x, y):
            serving[r] = -1
            spent[r] = 0.0
            continue
        if must_stay(mission, r, t):
            if serving[r] != t:
                serving[r] = t
                spent[r] = 0.0
            else:
                spent[r] += mission.params.dt
                if t >= targets.goals and fleet[r].charge < np.inf:
                    filled = energy[r] + fleet[r].charge * mission.params.dt
                    energy[r] = min(filled, fleet[r].capacity)
            if not has_stayed(mission, r, t, spent[r], energy[r]):
                continue
            event = True
            if t < targets.goals:
                visited[t] = True
        if t >= targets.goals:
            event = True
            if fleet[r].charge == np.inf:
                energy[r] = fleet[r].capacity
    return event


@kernel
def has_visited_station(mission, r, t, state, serving, spent, energy):
    """Tell whether `t` is a station that robot r has now visited."""
    targets = mission.targets
    if t < targets.goals or t >= targets.places:
        return False
    if not in_target(targets, t, state[0], state[1]):
        return False
    if not must_stay(mission, r, t):
        return True
    return serving == t and has_stayed(mission, r, t, spent, energy)


@kernel
def is_queuing(mission, serving, r, t):
    """Tell whether robot r's next target t is a station where another one stays."""
    if t < 0 or mission.targets.gate[t] < 0:
        return False
    taken = False
    for other in range(len(serving)):
        taken |= other != r and serving[other] == t
    return taken
