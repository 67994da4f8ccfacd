"""Whether the robots of a scene can hold and climb its slopes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely

from mrmg.energy import GRAVITY_M_S2
from mrmg.errors import Fault
from mrmg.scene.elevation import Elevation
from mrmg.scene.robot_model import RobotModel
from mrmg.scene.types import Obstacle, Robot, TerrainArea


def slope_faults(
    elevation: Elevation,
    robots: Sequence[Robot],
    obstacles: Sequence[Obstacle],
    terrain: Sequence[TerrainArea],
) -> list[Fault]:
    """Return the steepest place, if any, that a robot may get to but not climb."""
    slope = elevation.steepest().ravel()
    x, y = elevation.cell_centres().reshape(-1, 2).T
    multiplier = np.ones(len(slope))
    for area in terrain:
        multiplier[shapely.contains_xy(area.shape, x, y)] = area.multiplier
    faults = []
    for robot in robots:
        walls = [wall.shape for wall in obstacles if wall.stops(robot.id)]
        open_ground = ~shapely.contains_xy(shapely.union_all(walls), x, y)
        allowed = steepest_climb(robot.model, multiplier)
        excess = np.where(open_ground, slope - np.maximum(allowed, 0.0), -np.inf)
        worst = int(np.argmax(excess))
        if excess[worst] <= 0.0:
            continue
        message = (
            f"rises by {100 * slope[worst]:.0f} % at ({x[worst]:.1f}, {y[worst]:.1f}), "
            f"where {robot.id} climbs at most {100 * max(allowed[worst], 0.0):.0f} % "
            f"(friction {robot.model.friction_coefficient:g}, terrain "
            f"x{multiplier[worst]:g}); flatten it, or put an obstacle there"
        )
        faults.append(Fault("elevation", message))
    return faults


def steepest_climb(model: RobotModel, multiplier: np.ndarray) -> np.ndarray:
    """Return the slope up which a robot can do what is planned for it, shape (n,).

    Its driven axle transmits grip enough for slope, rolling resistance and the planned
    acceleration together.
    """
    acceleration = model.planning_share * model.limits.u1_max_m_s2 / GRAVITY_M_S2
    grip = model.usable_grip
    return np.asarray(grip - model.rolling_coefficient * multiplier - acceleration)
