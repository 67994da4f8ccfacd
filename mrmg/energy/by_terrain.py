"""Energy of the fleet by terrain class: planned, metered and measured."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np

from mrmg.energy.audit import believed_rolling
from mrmg.energy.battery_curves import measured_curves
from mrmg.energy.metering import Motion, step_energy_parts
from mrmg.plans import Plan
from mrmg.scene.types import Scene
from mrmg.simulation.log import ExecutionLog
from mrmg.world.terrain import area_at, multiplier_at

INTERVAL_SHARE = 0.9
"""Probability that the energy of a mission lies in its interval."""

_PLANNED, _DRIVEN = ("planned_m", "planned_J"), ("driven_m", "metered_J", "measured_J")

_Rows = dict[float, dict[str, float]]
"""Sums by multiplier and attribute of `TerrainEnergy`."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TerrainEnergy:
    """What the fleet used on ground of one multiplier.

    Attributes:
        multiplier: of the ground.
        planned_m, driven_m: way.
        planned_J, metered_J, measured_J: energy by the three meters of the audit; None,
            like `driven_m`, where nothing was driven.
    """

    multiplier: float
    planned_m: float
    planned_J: float
    driven_m: float | None = None
    metered_J: float | None = None
    measured_J: float | None = None


def energy_by_terrain(
    scene: Scene, plan: Plan, log: ExecutionLog | None
) -> tuple[TerrainEnergy, ...]:
    """Return the energy of the whole fleet by terrain class, from easy to hard.

    Each interval belongs to the ground under its middle, as in the energy model.
    """
    names = _PLANNED if log is None else _PLANNED + _DRIVEN
    rows: _Rows = defaultdict(lambda: dict.fromkeys(names, 0.0))
    planned = plan.trajectories
    planned_J = _model_energy(scene, planned, plan.rolling_factor)
    _add(rows, scene, planned, _PLANNED, planned_J)
    if log is not None:
        driven, rolling = measured_curves(scene, plan, log), believed_rolling(plan, log)
        metered_J = _model_energy(scene, driven, rolling)
        measured_J = [curve.drawn_J.sum(axis=1) for curve in driven]
        _add(rows, scene, driven, _DRIVEN, metered_J, measured_J)
    return tuple(
        TerrainEnergy(multiplier=key, **row) for key, row in sorted(rows.items())
    )


def planned_interval_J(
    scene: Scene, plan: Plan, robots: Iterable[str]
) -> tuple[float, float] | None:
    """Return the interval of what robots take together, by the spreads of the terrain.

    What runs take on one ground differs by a common factor, whose logarithm has the
    ground's `energy_spread` as its standard deviation; different grounds are
    independent. The sum is taken to be log-normal.

    Returns:
        Its ends [J]; None where the terrain states no spread, or nothing is taken.
    """
    grounds = [(1.0, 1.0, 0.0)] + [
        (area.multiplier, area.turning_multiplier, area.energy_spread)
        for area in scene.terrain
    ]
    by_ground: dict[tuple[float, float, float], float] = defaultdict(float)
    own = [motion for motion in plan.trajectories if motion.robot in robots]
    energies_J = _model_energy(scene, own, plan.rolling_factor)
    for motion, energy_J in zip(own, energies_J, strict=True):
        areas = area_at(scene, _middles(motion))
        for number in np.unique(areas):
            by_ground[grounds[number]] += float(energy_J[areas == number].sum())
    total_J = sum(by_ground.values())
    deviation_J = math.hypot(*(k[2] * e for k, e in by_ground.items()))
    if deviation_J == 0.0 or total_J <= 0.0:
        return None
    quantile = NormalDist().inv_cdf(0.5 + 0.5 * INTERVAL_SHARE)
    reach = quantile * deviation_J / total_J
    return total_J * math.exp(-reach), total_J * math.exp(reach)


def _model_energy(
    scene: Scene, motions: Iterable[Motion], rolling: Mapping[str, np.ndarray]
) -> list[np.ndarray]:
    return [
        step_energy_parts(scene, motion, rolling.get(motion.robot)).sum(axis=1)
        for motion in motions
    ]


def _middles(motion: Motion) -> np.ndarray:
    """Return the middles of a motion's intervals [m], shape (n, 2)."""
    points = motion.state[:, :2]
    return np.asarray(0.5 * (points[:-1] + points[1:]))


def _add(
    rows: _Rows,
    scene: Scene,
    motions: Sequence[Motion],
    names: Sequence[str],
    *energies_J: Sequence[np.ndarray],
) -> None:
    """Add way and energies of all intervals to the sums of the ground below them.

    Args:
        rows: sums by multiplier and name.
        scene: gives the terrain.
        motions: of the robots.
        names: of the sums of ways and of each of the energies.
        *energies_J: of the intervals of each motion, shape (n,) each.
    """
    for motion, *own_J in zip(motions, *energies_J, strict=True):
        ground = multiplier_at(scene, _middles(motion))
        way_m = np.hypot(*np.diff(motion.state[:, :2], axis=0).T)
        for key in np.unique(ground).tolist():
            for name, values in zip(names, (way_m, *own_J), strict=True):
                rows[key][name] += float(values[ground == key].sum())
