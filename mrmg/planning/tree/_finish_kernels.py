"""Where a robot must end: finish regions, reached at rest and with a heading."""

from __future__ import annotations

from math import hypot

import numpy as np

from mrmg.compilation import kernel
from mrmg.motion._kernels import UNICYCLE, copy_numbers, step
from mrmg.planning.problem._control_kernels import wrap
from mrmg.planning.problem._safety_kernels import braking_control, stands
from mrmg.planning.problem._target_kernels import in_target
from mrmg.planning.tree._staying_kernels import must_stay

MOST_BRAKING_STEPS = 200
"""Steps after which a robot that still moves is taken to be at rest."""


@kernel
def resting_state(mission, r, state):
    """Return the state in which a robot comes to rest if it brakes now, shape (5,)."""
    here = state.copy()
    after = np.empty(5)
    for _ in range(MOST_BRAKING_STEPS):
        if stands(mission.fleet, r, here):
            break
        u1, u2 = braking_control(mission.fleet, r, here, mission.params.dt)
        step(mission.fleet[r], here, u1, u2, mission.params.dt, after)
        copy_numbers(after, here)
    return here


@kernel
def _rests_inside(mission, r, target, state):
    """Return (whether braking ends in a target, the heading a finish lacks [rad])."""
    targets = mission.targets
    dx = state[0] - targets.center[target, 0]
    dy = state[1] - targets.center[target, 1]
    braking = 0.5 * state[3] * state[3] / mission.fleet[r].limit[3]
    if hypot(dx, dy) > targets.reach[target] + 2.0 * braking + 0.5:
        return False, 0.0
    rest = resting_state(mission, r, state)
    lacking = wrap(targets.heading[r] - rest[2])
    return in_target(targets, target, rest[0], rest[1]), lacking


@kernel
def at_finish(mission, r, target, state):
    """Tell whether `target` is a finish and the robot, braking now, ends there."""
    if target < mission.targets.places:
        return False
    inside, lacking = _rests_inside(mission, r, target, state)
    return inside and abs(lacking) <= mission.targets.tolerance[r]


@kernel
def may_stop(mission, r, target, state):
    """Tell whether the robot, braking now, rests where it must stay or end."""
    if must_stay(mission, r, target):
        inside, _ = _rests_inside(mission, r, target, state)
        return inside
    return at_finish(mission, r, target, state)


@kernel
def turn_at_finish(mission, r, target, state, wanted):
    """Write the (v, w) that turns a robot to its finish's heading, if it is there.

    Only a robot that turns on the spot can; returns whether it does.
    """
    if mission.fleet[r].model != UNICYCLE or target < mission.targets.places:
        return False
    inside, lacking = _rests_inside(mission, r, target, state)
    if not inside:
        return False
    limit = mission.fleet[r].limit
    wanted[0] = 0.0
    wanted[1] = max(-limit[2], min(limit[2], lacking))
    return True


@kernel
def all_finished(mission, state):
    """Tell whether every robot that must end somewhere does so if all brake now."""
    for r in range(len(state)):
        finish = mission.targets.finish[r]
        if finish >= 0 and not at_finish(mission, r, finish, state[r]):
            return False
    return True
