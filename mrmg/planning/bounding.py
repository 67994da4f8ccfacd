"""The bounds of a mission's plans, proven on a thread beside the search."""

from __future__ import annotations

import math
from concurrent.futures import Future
from contextlib import suppress
from dataclasses import replace

import numpy as np

from mrmg.background import in_background
from mrmg.planning.bound.bound import ROUNDS, lower_bound_J
from mrmg.planning.bound.joint_bound import Divisions
from mrmg.planning.bound.makespan_bound import makespan_bound_s
from mrmg.planning.bound.relaxation import CELLS, FINER
from mrmg.planning.consumers import without_consumers
from mrmg.planning.halting import NEVER, Halted
from mrmg.planning.preference import Preference
from mrmg.planning.statistics import Bounds, Statistics
from mrmg.scene.objective import ENERGY
from mrmg.scene.types import Scene

COARSE_CELLS = 1000
"""Cells of the grid of a first bound where time is limited: a tenth of the work."""


def bounds_of(
    scene: Scene,
    step_s: float,
    *,
    cells: int = CELLS,
    rounds: int = ROUNDS,
    finer: int = FINER,
    halt: np.ndarray = NEVER,
) -> Bounds:
    """Return what no plan of a mission undercuts, as far as its objective needs it.

    Args:
        scene: the mission.
        step_s: time step of the plans.
        cells: of the grid; more take longer and bring the bound nearer to the truth.
        rounds: how often the ways of the cheapest tours are tightened; as `cells`.
        finer: parts into which cells are cut in the end; as `cells`.
        halt: shape (1,); bounds are given up once it has turned true.

    Raises:
        Halted: if they were given up.
    """
    objective, limit_s = scene.objective, scene.time_limit_s
    energy_J = makespan_s = blend = divisions = None
    driving = Preference.of(scene).driving
    timed = driving.makespan_weight > 0.0 or math.isfinite(limit_s)
    if objective.energy_weight and timed:
        bare = without_consumers(scene)
        divisions = Divisions.of(bare, step_s=step_s, cells=cells, halt=halt)
    if objective.makespan_weight and divisions is not None:
        makespan_s = divisions.makespan_s
    elif objective.makespan_weight:
        makespan_s = makespan_bound_s(scene, step_s=step_s, cells=cells, halt=halt)
    if objective.energy_weight:
        energy_J = lower_bound_J(
            scene, step_s=step_s, cells=cells, rounds=rounds, finer=finer, halt=halt
        )
        if divisions is not None:
            energy = Preference.of(replace(scene, objective=ENERGY)).driving
            energy_J = max(energy_J, divisions.value(energy, limit_s))
            if objective.makespan_weight:
                blend = divisions.value(driving, limit_s)
    return Bounds(energy_J=energy_J, makespan_s=makespan_s, blend=blend)


def bounds_beside(
    scene: Scene,
    step_s: float,
    statistics: Statistics,
    *,
    anytime: bool,
    halt: np.ndarray,
) -> Future[None]:
    """Prove bounds in the background, and return what is done once the best are proven.

    Args:
        scene: the mission.
        step_s: time step of the plans.
        statistics: receives the bounds.
        anytime: prove coarse bounds first, as there may be no time for better ones.
        halt: shape (1,); what is not proven is given up once it has turned true.
    """

    def prove() -> None:
        with suppress(Halted):
            coarse = [(COARSE_CELLS, 0), (COARSE_CELLS, ROUNDS)] if anytime else []
            for cells, rounds in [*coarse, (CELLS, ROUNDS)]:
                found = bounds_of(scene, step_s, cells=cells, rounds=rounds, halt=halt)
                statistics.bounds = statistics.bounds.raised_by(found)

    return in_background(prove)
