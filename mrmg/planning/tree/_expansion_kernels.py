"""One expansion of the motion tree: every robot drives for some steps."""

from __future__ import annotations

from math import atan2, hypot

import numba
import numpy as np

from mrmg.compilation import kernel
from mrmg.energy.model import battery_power
from mrmg.motion._kernels import CAR, USER, copy_numbers, steer_user, turn_speed
from mrmg.planning.problem._control_kernels import control_towards, wrap
from mrmg.planning.problem._safety_kernels import (
    braking_control,
    follow_braking,
    gate_is_taken,
    new_commitment,
    present_state,
    try_control,
    write_braking,
)
from mrmg.planning.roadmap._fleet_kernels import space_of
from mrmg.planning.routing._random_kernels import random_unit
from mrmg.planning.tree._finish_kernels import may_stop, turn_at_finish
from mrmg.planning.tree._maneuver_kernels import best_maneuver
from mrmg.planning.tree._mission_kernels import load_height, look_ahead
from mrmg.planning.tree._staying_kernels import note_arrivals
from mrmg.planning.tree._steering_kernels import (
    BACK_OFF,
    RANDOM,
    STEER,
    WAIT,
    pursue,
    sidestep,
)
from mrmg.world._kernels import multiplier_in, turning_multiplier_in

_battery_power = numba.njit(battery_power)

VIEW_M = 25.0
"""How far along its way a robot looks for the farthest point in sight."""

STEER_EVERY = 5
"""Steps between two looks."""

AHEAD = 0.9
"""Bearing up to which a waypoint counts as ahead [rad]."""

BEHIND = 2.4
"""Bearing from which a waypoint counts as behind [rad]."""

QUEUE = 4.0
"""Radii of a robot before a taken station at which it waits for its turn."""

ATTEMPTS = 5
"""Controls tried before a robot brakes as committed."""

HELD_ATTEMPTS = 2
"""The same where a motion is held."""


@kernel
def choose_modes(tree, v, target, params, steer, random, stuck, mode):
    """Draw what each robot does next: steer, or random controls when that has failed.

    Args:
        tree, v: vertex to be expanded.
        target: each robot's next target, -1 for none, shape (R,).
        params: `TreeParams`.
        steer: probability of steering.
        random: state of the generator.
        stuck: receives how stuck each robot is, shape (R,).
        mode: receives what each robot does, shape (R,).
    """
    again = tree.expanded[v] > 1
    blocked = False
    for r in range(len(target)):
        blocked |= target[r] >= 0 and tree.stalled[v, r] > 1
    for r in range(len(target)):
        # Expanded as before, a vertex would only give the same child again.
        stuck[r] = tree.stalled[v, r]
        if again and random_unit(random) < 0.6:
            stuck[r] = max(stuck[r], min(tree.expanded[v], 4))
        draw = random_unit(random)
        if target[r] < 0:
            # A robot without a target gives way only when others are stuck.
            mode[r] = RANDOM if blocked and draw < 0.5 else WAIT
        elif tree.serving[v, r] == target[r]:
            mode[r] = STEER
        elif draw >= steer:
            mode[r] = RANDOM
        elif stuck[r] < 2:
            mode[r] = STEER
        else:
            pick = random_unit(random)
            if pick < 0.5:
                mode[r] = STEER
            elif pick < 0.7:
                mode[r] = BACK_OFF
            elif pick < 0.95 or len(target) == 1:
                mode[r] = RANDOM
            else:
                mode[r] = WAIT


@kernel
def draw_motion(fleet, r, mode, gear, random):
    """Return a random wanted (v, w): any, or one that backs off from where it heads."""
    low, high = fleet[r].limit[0], fleet[r].limit[1]
    unit = random_unit(random)
    side = (2.0 * random_unit(random) - 1.0) * fleet[r].limit[2]
    if fleet[r].model == USER:
        # Nothing is known of its inside: a random control.
        share = side / fleet[r].limit[2]
        return (2.0 * unit - 1.0) * fleet[r].limit[3], share * fleet[r].limit[4]
    if mode == RANDOM:
        return low + unit * (high - low), side
    back = low if gear > 0 else high
    return (0.4 + 0.6 * unit) * back, 0.6 * side


@kernel
def choose_motion(mission, r, target, state, waypoint, stuck, gear, random, motion):
    """Decide how a robot sets out for its waypoint; return whether to hold `motion`.

    Ahead and not stuck, it pursues the waypoint. Else it looks for a maneuver; one that
    leaves backwards with the way behind becomes pursuit in reverse gear.
    """
    off = abs(wrap(atan2(waypoint[1] - state[1], waypoint[0] - state[0]) - state[2]))
    gear[r] = 1
    if mission.fleet[r].model != CAR:
        return False
    if off < AHEAD and stuck == 0:
        return False
    if not best_maneuver(mission, r, target, state, stuck, random, motion):
        return False
    gear[r] = 1 if motion[0] > 0.0 else -1
    return not (motion[0] < 0.0 and off > BEHIND and stuck < 2)


@kernel
def attempt_control(fleet, r, state, v, w, attempt, dt):
    """Return the control of the n-th attempt to get on: ever slower and wider.

    The wanted motion; slower; slower and straighter; slower and swinging out; and last
    braking while steering.
    """
    if attempt == 1:
        v *= 0.5
    elif attempt == 2:
        v *= 0.4
        w *= 0.4
    elif attempt == 3:
        v *= 0.4
        w *= -0.5
    elif attempt == 4:
        v = 0.0
    return control_towards(fleet, r, state, v, w, dt)


@kernel
def attempt_user_control(fleet, r, state, wx, wy, held, attempt, dt):
    """Return the n-th attempt of a user's model: a held control, or ever slower."""
    if held:
        return wx, wy
    share = 1.0 if attempt == 0 else (0.5 if attempt == 1 else 0.25)
    return steer_user(fleet[r], state, wx, wy, share, dt)


@kernel
def drive_step(mission, commitment, decided, r, v, w, held, attempts):
    """Drive one robot one step as near to (v, w) as is safe.

    For a user's model (v, w) is the waypoint, or the control that is held.

    Returns:
        The control (u1, u2); that of its commitment where none was safe.
    """
    dt = mission.params.dt
    state = present_state(commitment, r).copy()
    for attempt in range(attempts):
        if mission.fleet[r].model == USER:
            u1, u2 = attempt_user_control(
                mission.fleet, r, state, v, w, held, attempt, dt
            )
        else:
            u1, u2 = attempt_control(mission.fleet, r, state, v, w, attempt, dt)
        if try_control(
            mission.fleet, mission.spaces, commitment, decided, r, u1, u2, dt
        ):
            return u1, u2
    follow_braking(commitment, r)
    return braking_control(mission.fleet, r, state, dt)


@kernel
def step_energy(mission, r, before, after, u1):
    """Return the battery energy of one step [J], charged at its midpoint."""
    robot = mission.fleet[r]
    v = 0.5 * (before[3] + after[3])
    x = 0.5 * (before[0] + after[0])
    y = 0.5 * (before[1] + after[1])
    k = multiplier_in(mission.terrain, x, y)
    acceleration = u1
    if robot.model == USER:
        acceleration = (after[3] - before[3]) / mission.params.dt
        turn = robot.track * abs(after[2] - before[2]) / mission.params.dt
    else:
        turn = turn_speed(robot.model, v, 0.5 * (before[4] + after[4]), robot.track)
    climb = 0.0
    if mission.terrain.height.shape[0] > 0:
        rise = load_height(mission, r, after) - load_height(mission, r, before)
        climb = rise / mission.params.dt
    return mission.params.dt * _battery_power(
        v,
        acceleration,
        turning_multiplier_in(mission.terrain, x, y) * turn,
        k,
        climb,
        robot.energy,
    )


@kernel
def must_queue(mission, commitment, r, target, state):
    """Tell whether robot r is near a station that another one has taken."""
    if target < 0 or mission.targets.gate[target] < 0:
        return False
    center = mission.targets.center[target]
    limit = mission.fleet[r].limit
    braking = 0.5 * state[3] * state[3] / limit[3]
    room = mission.targets.reach[target] + QUEUE * mission.fleet[r].radius + braking
    if hypot(state[0] - center[0], state[1] - center[1]) > room:
        return False
    return gate_is_taken(commitment, mission.targets.gate[target], r)


@kernel
def expand(
    mission, state, energy, visited, serving, spent, target, mode, gear, stuck, order,
    random, control,
):  # fmt: skip
    """Drive all robots for up to k steps; ends early when a target is visited.

    Args:
        mission: the problem.
        state, energy, visited, serving, spent: of the vertex; changed in place to those
            at the end.
        target: each robot's next target, -1 for none, shape (R,).
        mode: what each robot does, shape (R,).
        gear: each robot's gear; changed in place, shape (R,).
        stuck: how stuck each robot is, shape (R,).
        order: robots in order of right of way, shape (R,).
        random: state of the generator.
        control: receives the controls, shape (k, R, 2).

    Returns:
        (steps made, whether a target was reached, whether all stayed above reserve).
    """
    fleet, params = mission.fleet, mission.params
    robots = len(target)
    commitment = new_commitment(fleet, mission.gates, params.dt)
    wanted = np.zeros((robots, 2))
    held = np.zeros(robots, np.bool_)
    for r in range(robots):
        write_braking(fleet, r, state[r], params.dt, commitment, 0)
        if mode[r] == RANDOM or mode[r] == BACK_OFF:
            held[r] = True
            wanted[r, 0], wanted[r, 1] = draw_motion(fleet, r, mode[r], gear[r], random)
    waypoint = np.zeros((robots, 2))
    decided = np.zeros(robots, np.bool_)
    for n in range(params.steps):
        for r in range(robots):
            decided[r] = False
        for i in range(robots):
            r = order[i]
            before = present_state(commitment, r).copy()
            if mode[r] == STEER and (
                may_stop(mission, r, target[r], before)
                or must_queue(mission, commitment, r, target[r], before)
            ):
                mode[r] = WAIT
            if mode[r] == WAIT:
                u1, u2 = braking_control(fleet, r, before, params.dt)
                follow_braking(commitment, r)
            else:
                if mode[r] == STEER and n % STEER_EVERY == 0 and not held[r]:
                    _look(mission, r, target[r], state, waypoint[r])
                    if n == 0:
                        held[r] = choose_motion(
                            mission, r, target[r], before, waypoint[r], stuck[r], gear,
                            random, wanted[r],
                        )  # fmt: skip
                if not held[r]:
                    set_out(mission, r, target[r], before, waypoint[r], gear, wanted[r])
                u1, u2 = drive_step(
                    mission, commitment, decided, r, wanted[r, 0], wanted[r, 1],
                    held[r], HELD_ATTEMPTS if held[r] else ATTEMPTS,
                )  # fmt: skip
            decided[r] = True
            after = present_state(commitment, r)
            energy[r] -= step_energy(mission, r, before, after, u1)
            control[n, r, 0], control[n, r, 1] = u1, u2
        for r in range(robots):
            copy_numbers(present_state(commitment, r), state[r])
            if energy[r] < fleet[r].reserve:
                return n + 1, False, False
        if note_arrivals(mission, state, energy, visited, serving, spent, target):
            return n + 1, True, True
    return params.steps, False, True


@kernel
def set_out(mission, r, target, state, waypoint, gear, wanted):
    """Write what a steering robot wants: (v, w), or a user's model's waypoint."""
    if mission.fleet[r].model == USER:
        copy_numbers(waypoint, wanted)
    elif not turn_at_finish(mission, r, target, state, wanted):
        wanted[0], wanted[1] = pursue(
            mission.fleet, r, state, waypoint[0], waypoint[1], gear[r]
        )


@kernel
def _look(mission, r, target, state, waypoint):
    """Write the point robot r drives at: its way's, or aside of a robot in the way."""
    ahead = np.empty(2)
    if look_ahead(mission, r, target, state[r], VIEW_M, ahead) == np.inf:
        copy_numbers(mission.targets.center[target], ahead)
    space = space_of(mission.spaces, mission.fleet[r].space)
    sidestep(mission.fleet, r, state[r], space, state, ahead[0], ahead[1], waypoint)
