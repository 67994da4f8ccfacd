"""What a second is worth to robots that drive along paths.

Driving slower than top speed never saves energy on the way, but two things do that take
time: rolling to a stop instead of braking, and ways round dear ground.
"""

from __future__ import annotations

import numpy as np

from mrmg.planning.motion_tree import Problem


def energy_shares(problem: Problem) -> np.ndarray:
    """Return the share of energy in the worth of a plain metre at top speed, (R,).

    The rest is the time it takes. It is 1 where only energy counts, 0 where only the
    makespan does.
    """
    objective = problem.preference.objective
    power_W = problem.mission.fleet["plain"] * problem.mission.fleet["limit"][:, 1]
    energy = objective.energy_weight * power_W
    return np.asarray(energy / (energy + objective.makespan_weight))


def brakes_hard(problem: Problem) -> np.ndarray:
    """Tell which robots brake instead of rolling to a stop, shape (R,).

    Rolling saves the power of driving for as long as it takes longer.
    """
    return np.asarray(problem.hurried | (energy_shares(problem) < 0.5))
