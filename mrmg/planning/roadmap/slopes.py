"""What slopes cost on the roadmap, in metres of plain ground.

A piece of way of weighted length w that rises by h takes m = w + c h at steady speed,
with c the weight over the rolling force. Where m is negative the drive brakes, and of
that it feeds back the share p, regeneration times drive efficiency. So the battery's
cost is f(m) = max(m, p m), which is negative where much is fed back.

Shortest ways need costs that are not. Heights are a potential: f(m) - p c h is

    max(w + (1 - p) c h, p w) >= 0,

and along any way the parts p c h add up to p c times the difference of heights. The
roadmap's edges and fields are these reduced costs; energies of whole legs get the
potential back, and count 0 where that makes them negative, as a full battery may be
unable to take it.
"""

from __future__ import annotations

from typing import NamedTuple

import shapely

from mrmg.scene.robot_model import RobotModel
from mrmg.scene.types import Robot, Scene

DESCENT_SHARE = 0.1
"""Least cost of a descent, as a share of its weighted length: rolling down is not quite
free, since it takes turns and speed to be regained, and equal ways would be endless."""


class SlopeCost(NamedTuple):
    """How one robot's costs depend on heights.

    Attributes:
        price: reduced cost per metre of rise, (1 - p) c.
        floor: least reduced cost, as a share of the weighted length.
        refund: potential per metre of height, p c.
    """

    price: float = 0.0
    floor: float = 0.0
    refund: float = 0.0

    @staticmethod
    def of(scene: Scene, model: RobotModel) -> SlopeCost:
        """Return the slope cost of a robot model; on flat ground that of any other."""
        if scene.elevation is None:
            return SlopeCost()
        energy = model.energy_model
        climb = energy.weight_N / energy.rolling_force_N
        regained = energy.regeneration_efficiency * energy.drive_efficiency
        return SlopeCost(
            price=(1.0 - regained) * climb,
            floor=max(regained, DESCENT_SHARE),
            refund=regained * climb,
        )


def height_span_m(
    scene: Scene, robot: Robot, place: shapely.Geometry
) -> tuple[float, float]:
    """Return bounds of the heights a robot can be at in a place [m].

    Its reference point is in the place; what climbs is its centre of mass.
    """
    if scene.elevation is None:
        return 0.0, 0.0
    around = place.buffer(abs(robot.model.center_of_mass_m))
    return scene.elevation.span_within(around.bounds)


def climb_J(robot: Robot, rise_m: float) -> float:
    """Return the battery energy of climbing by `rise_m`, negative downhill.

    The battery gives at least the mechanical power over the efficiency at any time: all
    of it where the drive pulls, and where it brakes, feeding a part back beats feeding
    all of it back without a loss. So over any way the sum of rolling, turning, gain of
    kinetic energy and this is a lower bound.
    """
    return rise_m * robot.model.energy_model.weight_N / robot.model.drive_efficiency
