"""Energy of the fleet by terrain class: planned, metered and measured."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mrmg.energy.audit import believed_rolling, measured_step_energy
from mrmg.energy.metering import Motion, step_energy_parts
from mrmg.plans import Plan
from mrmg.scene.types import Scene
from mrmg.simulation.log import ExecutionLog
from mrmg.world.terrain import multiplier_at


@dataclass(frozen=True, slots=True, kw_only=True)
class TerrainEnergy:
    """What the fleet spent on ground of one multiplier.

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
    driven, rolling = log.driven_motions(), believed_rolling(plan, log)
    metered = _by_class(scene, driven, _model_energy(scene, driven, rolling))
    work_J = [
        measured_step_energy(scene.robot(robot), log, index).sum(axis=1)
        for index, robot in enumerate(log.robots)
    ]
    measured = _by_class(scene, driven, work_J)
    nothing = (0.0, 0.0)
    return tuple(
        TerrainEnergy(
            multiplier=key,
            planned_m=planned.get(key, nothing)[0],
            planned_J=planned.get(key, nothing)[1],
            driven_m=metered.get(key, nothing)[0],
            metered_J=metered.get(key, nothing)[1],
            measured_J=measured.get(key, nothing)[1],
        )
        for key in sorted({*planned, *metered})
    )


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
    """Return (way [m], energy [J]) of all motions by multiplier."""
    sums: dict[float, tuple[float, float]] = {}
    for motion, energy_J in zip(motions, energies_J, strict=True):
        points = motion.state[:, :2]
        ground = multiplier_at(scene, 0.5 * (points[:-1] + points[1:]))
        way_m = np.hypot(*np.diff(points, axis=0).T)
        for key in np.unique(ground):
            on = ground == key
            before = sums.get(float(key), (0.0, 0.0))
            sums[float(key)] = (
                before[0] + float(way_m[on].sum()),
                before[1] + float(energy_J[on].sum()),
            )
    return sums
