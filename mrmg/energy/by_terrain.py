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
    planned = _by_class(
        scene,
        plan.trajectories,
        _model_energy(scene, plan.trajectories, plan.rolling_factor),
    )
    if log is None:
        return tuple(
            TerrainEnergy(multiplier=key, planned_m=way_m, planned_J=energy_J)
            for key, (way_m, energy_J) in sorted(planned.items())
        )
    driven, rolling = measured_curves(scene, plan, log), believed_rolling(plan, log)
    metered = _by_class(scene, driven, _model_energy(scene, driven, rolling))
    drawn_J = [curve.drawn_J.sum(axis=1) for curve in driven]
    measured = _by_class(scene, driven, drawn_J)
    return tuple(
        TerrainEnergy(
            multiplier=key,
            planned_m=planned[key][0],
            planned_J=planned[key][1],
            driven_m=metered[key][0],
            metered_J=metered[key][1],
            measured_J=measured[key][1],
        )
        for key in sorted({*planned, *metered})
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
    by_ground: dict[tuple[float, float, float], float] = defaultdict(float)
    for motion in plan.trajectories:
        if motion.robot not in robots:
            continue
        factor = plan.rolling_factor.get(motion.robot)
        energy_J = step_energy_parts(scene, motion, factor).sum(axis=1)
        points = motion.state[:, :2]
        areas = area_at(scene, 0.5 * (points[:-1] + points[1:]))
        for number in np.unique(areas):
            area = scene.terrain[number - 1] if number else None
            key = (
                (area.multiplier, area.turning_multiplier, area.energy_spread)
                if area
                else (1.0, 1.0, 0.0)
            )
            by_ground[key] += float(energy_J[areas == number].sum())
    total_J = sum(by_ground.values())
    deviation_J = float(
        np.hypot.reduce([0.0, *(k[2] * e for k, e in by_ground.items())])
    )
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


def _by_class(
    scene: Scene, motions: Iterable[Motion], energies_J: Sequence[np.ndarray]
) -> dict[float, tuple[float, float]]:
    """Return (way [m], energy [J]) of all motions by multiplier; 0 of any other one."""
    sums: dict[float, tuple[float, float]] = defaultdict(lambda: (0.0, 0.0))
    for motion, energy_J in zip(motions, energies_J, strict=True):
        points = motion.state[:, :2]
        ground = multiplier_at(scene, 0.5 * (points[:-1] + points[1:]))
        way_m = np.hypot(*np.diff(points, axis=0).T)
        for key in np.unique(ground).tolist():
            on = ground == key
            sum_m, sum_J = sums[key]
            sums[key] = (
                sum_m + float(way_m[on].sum()),
                sum_J + float(energy_J[on].sum()),
            )
    return sums
