"""Which slopes the robots of a scene can hold and climb, and which stop them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely

from mrmg.compared import compared
from mrmg.energy.model import GRAVITY_M_S2
from mrmg.errors import Fault
from mrmg.scene.elevation import Elevation
from mrmg.scene.robot_model import RobotModel
from mrmg.scene.types import Obstacle, Robot, Scene, TerrainArea

STEEP = "steep_ground"
"""What the names of steep ground begin with."""

LARGEST_BEND = 0.1
"""Change of slope from cell to cell up to which energies are modelled: measured ones
were within 2 % of plans up to 0.1, and 3 % up to 0.2 (slopes of 17 %)."""


def slope_faults(
    elevation: Elevation,
    robots: Sequence[Robot],
    obstacles: Sequence[Obstacle],
    terrain: Sequence[TerrainArea],
) -> list[Fault]:
    """Return for each robot the steepest place, if any, that stops it on open ground.

    Each is a fault: the place where the slope exceeds most what the robot climbs, among
    those that no obstacle keeps it off.
    """
    slope, multiplier = elevation.steepest().ravel(), _multiplier(elevation, terrain)
    x, y = elevation.cell_centres().reshape(-1, 2).T
    faults = []
    for robot in robots:
        walls = [wall.shape for wall in obstacles if wall.stops(robot.id)]
        open_ground = ~shapely.contains_xy(shapely.union_all(walls), x, y)
        allowed = steepest_climb(robot.model, multiplier)
        excess = np.where(open_ground, slope - allowed, -np.inf)
        worst = int(np.argmax(excess))
        if excess[worst] <= 0.0:
            continue
        rise, most = compared(100 * slope[worst], 100 * allowed[worst])
        message = (
            f"rises by {rise} % at ({x[worst]:.1f}, {y[worst]:.1f}), where {robot.id} "
            f"climbs at most {most} % (friction {robot.model.friction_coefficient:g}, "
            f"terrain x{multiplier[worst]:g}); flatten it, put an obstacle there, or "
            "let robots avoid what they cannot climb: add 'slope: avoid' to it"
        )
        faults.append(Fault("elevation", message))
    return faults


def bend_warnings(scene: Scene) -> list[Fault]:
    """Return the sharpest bend of the ground if it exceeds what energies are good for.

    Where the ground bends, chassis pitch and wheels lift, which the energy model does
    not know.
    """
    elevation = scene.elevation
    if elevation is None:
        return []
    bends, (x, y) = elevation.bends(), elevation.nodes_m
    walls = shapely.union_all([wall.shape for wall in scene.barriers])
    bends[shapely.intersects_xy(walls, *np.meshgrid(x, y))] = 0.0
    row, column = np.unravel_index(int(np.argmax(bends)), bends.shape)
    if bends[row, column] <= LARGEST_BEND:
        return []
    message = (
        f"the slope changes by {100 * bends[row, column]:.0f} % at ({x[column]:.1f}, "
        f"{y[row]:.1f}); where it changes by more than {100 * LARGEST_BEND:.0f} % from "
        "cell to cell, robots take more energy than planned: smooth the ground"
    )
    return [Fault("elevation", message)]


def avoided_ground(
    elevation: Elevation | None,
    robots: Sequence[Robot],
    terrain: Sequence[TerrainArea],
) -> tuple[Obstacle, ...]:
    """Return ground too steep to climb, as obstacles for the robots that cannot.

    It covers the cells of the elevation that are too steep, and up to half a cell
    around them, which rounds the steps of its outline. There is none but with
    `slope: avoid`.
    """
    if elevation is None or not elevation.avoid_steep:
        return ()
    slope, multiplier = elevation.steepest().ravel(), _multiplier(elevation, terrain)
    stopped: dict[bytes, list[str]] = {}
    for robot in robots:
        steep = slope > steepest_climb(robot.model, multiplier)
        stopped.setdefault(steep.tobytes(), []).append(robot.id)
    ground = [
        (part, tuple(names))
        for mask, names in stopped.items()
        for part in _outlines(elevation, np.frombuffer(mask, dtype=bool))
    ]
    return tuple(
        Obstacle(id=f"{STEEP}_{number}", shape=shape, height_m=0.0, blocks=names)
        for number, (shape, names) in enumerate(ground, start=1)
    )


def steepest_climb(model: RobotModel, multiplier: np.ndarray) -> np.ndarray:
    """Return the slope up which a robot can do what is planned for it, shape (n,).

    Its driven axle transmits grip enough for slope, rolling resistance and the planned
    acceleration together; 0 where it does not even on level ground.
    """
    acceleration = model.planning_share * model.limits.u1_max_m_s2 / GRAVITY_M_S2
    rolling = model.rolling_coefficient * multiplier
    return np.maximum(model.usable_grip - rolling - acceleration, 0.0)


def _multiplier(elevation: Elevation, terrain: Sequence[TerrainArea]) -> np.ndarray:
    """Return the terrain multiplier in the middle of each cell, flat."""
    x, y = elevation.cell_centres().reshape(-1, 2).T
    multiplier = np.ones(len(x))
    for area in terrain:
        multiplier[shapely.contains_xy(area.shape, x, y)] = area.multiplier
    return multiplier


def _outlines(elevation: Elevation, steep: np.ndarray) -> list[shapely.Polygon]:
    if not steep.any():
        return []
    x, y = elevation.nodes_m
    row, column = np.nonzero(steep.reshape(len(y) - 1, len(x) - 1))
    cells = shapely.box(x[column], y[row], x[column + 1], y[row + 1])
    half_m = 0.5 * min(elevation.cell_m)
    grown = shapely.coverage_union_all(cells).buffer(half_m, join_style="mitre")
    # A ring that is simplified by less than it was grown by still encloses the cells.
    smooth = shapely.simplify(grown, 0.99 * half_m)
    return [shapely.Polygon(part) for part in shapely.get_parts(smooth)]
