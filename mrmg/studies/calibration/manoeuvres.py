"""What a robot drives to be calibrated: straights, cycles, circles, turns on the spot.

A manoeuvre is a course of pieces with constant controls, on ground of one terrain
multiplier; it starts and ends at rest. Its speeds and accelerations are shares of the
limits the planner uses, so that a model is measured where it will be driven.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from mrmg.motion.dynamics import NX
from mrmg.motion.user_motion import plain_step
from mrmg.scene.robot_model import Limits, RobotModel

STEP_S = 0.1
"""Length of a control step, as in plans."""

CRUISE_S = 6.0
"""How long a speed is held."""

MULTIPLIERS = (1.0, 2.0, 4.0)
_SPEEDS = (0.3, 0.6, 1.0)
_ACCELERATIONS = (0.3, 0.6, 1.0)
_TURNS = (0.25, 0.5, 0.75, 1.0)
_CIRCLE_SPEEDS = (0.5, 1.0)


@dataclass(frozen=True, slots=True)
class Piece:
    """A stretch of constant controls.

    Attributes:
        name: such as "speed up" or "cruise".
        control: (u1, u2), held.
        steps: number of control steps.
    """

    name: str
    control: tuple[float, float]
    steps: int


@dataclass(frozen=True)
class Manoeuvre:
    """A course to drive.

    Attributes:
        name: unique among a robot's manoeuvres.
        kind: "straight", "cycle", "circle" or "spin".
        multiplier: of the terrain it is driven on.
        pieces: in order of time.
    """

    name: str
    kind: str
    multiplier: float
    pieces: tuple[Piece, ...]

    @cached_property
    def control(self) -> np.ndarray:
        """Controls of all steps, shape (n, 2)."""
        return np.concatenate(
            [np.tile(piece.control, (piece.steps, 1)) for piece in self.pieces]
        )

    def states(self, model: RobotModel) -> np.ndarray:
        """Return the states of the motion model from rest at the origin, (n + 1, 5)."""
        step = plain_step(model)
        state = [(0.0,) * NX]
        for u1, u2 in self.control:
            state.append(step(state[-1], (u1, u2), model.wheelbase_m, STEP_S))
        return np.array(state)


def manoeuvres_of(model: RobotModel) -> tuple[Manoeuvre, ...]:
    """Return everything a robot of `model` drives to be calibrated."""
    limits = model.planned_limits
    straights = [
        _straight(limits, share * limits.v_max_m_s, multiplier)
        for multiplier in MULTIPLIERS
        for share in _SPEEDS
    ]
    if limits.v_min_m_s < 0.0:
        straights.append(_straight(limits, limits.v_min_m_s, 1.0))
    cycles = [_cycle(limits, share * limits.u1_max_m_s2) for share in _ACCELERATIONS]
    circles = [
        circle(model, limits, share * limits.v_max_m_s, sign * turn * limits.w_max)
        for share in _CIRCLE_SPEEDS
        for turn, sign in zip(_TURNS, (1.0, -1.0, 1.0, -1.0), strict=True)
    ]
    spins = (
        [_spin(limits, turn * limits.w_max) for turn in _TURNS]
        if model.motion_model == "unicycle"
        else []
    )
    return (*straights, *cycles, *circles, *spins)


def circle(
    model: RobotModel, limits: Limits, speed_m_s: float, second: float
) -> Manoeuvre:
    """Return a circle that `model` drives, its radius the same from start to end.

    Args:
        model: a unicycle turns in proportion to its speed; others steer at rest.
        limits: of its ramps.
        speed_m_s: while cruising.
        second: psi [rad] or omega [rad/s] while cruising.
    """
    name = f"circle at {speed_m_s:.2f} m/s"
    if model.motion_model == "unicycle":
        pieces = _there_and_back((speed_m_s, second), limits)
        return Manoeuvre(f"{name}, turning {second:+.2f} rad/s", "circle", 1.0, pieces)
    pieces = (
        _ramp("steer", (0.0, second), limits),
        *_there_and_back((speed_m_s, 0.0), limits),
        _ramp("steer", (0.0, -second), limits),
    )
    return Manoeuvre(f"{name}, steering {second:+.2f} rad", "circle", 1.0, pieces)


def _straight(limits: Limits, speed: float, multiplier: float) -> Manoeuvre:
    return Manoeuvre(
        f"straight at {speed:.2f} m/s, terrain x{multiplier:g}",
        "straight",
        multiplier,
        _there_and_back((speed, 0.0), limits),
    )


def _spin(limits: Limits, turn_rate: float) -> Manoeuvre:
    """Turn on the spot."""
    pieces = _there_and_back((0.0, turn_rate), limits)
    return Manoeuvre(f"spin at {turn_rate:.2f} rad/s", "spin", 1.0, pieces)


def _cycle(limits: Limits, acceleration: float) -> Manoeuvre:
    """Speed up and brake between a third of the top speed and all of it."""
    gentle = replace(limits, u1_max_m_s2=acceleration)
    high = limits.v_max_m_s
    low = high / 3.0
    swing = (
        _ramp("brake", (low - high, 0.0), gentle),
        _ramp("speed up", (high - low, 0.0), gentle),
    )
    return Manoeuvre(
        f"cycle at {acceleration:.2f} m/s²",
        "cycle",
        1.0,
        (
            _ramp("speed up", (high, 0.0), gentle),
            *swing,
            *swing,
            _ramp("brake", (-high, 0.0), gentle),
        ),
    )


def _there_and_back(speeds: tuple[float, float], limits: Limits) -> tuple[Piece, ...]:
    """Speed up from rest to (v, w), cruise, brake."""
    first, second = speeds
    return (
        _ramp("speed up", speeds, limits),
        Piece("cruise", (0.0, 0.0), round(CRUISE_S / STEP_S)),
        _ramp("brake", (0.0 - first, 0.0 - second), limits),
    )


def _ramp(name: str, change: tuple[float, float], limits: Limits) -> Piece:
    """Return the quickest piece of whole steps that changes (v, w) by `change`."""
    bounds = (limits.u1_max_m_s2, limits.u2_max)
    slowest_s = max(abs(by) / bound for by, bound in zip(change, bounds, strict=True))
    steps = math.ceil(slowest_s / STEP_S - 1e-9)
    first, second = (by / (steps * STEP_S) for by in change)
    return Piece(name, (first, second), steps)
