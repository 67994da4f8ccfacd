"""Driving manoeuvres in MuJoCo, and what the drive worked on each leg of them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import shapely

from mrmg.energy.ledger import EnergyLedger
from mrmg.energy.model import GRAVITY_M_S2
from mrmg.errors import UsageError
from mrmg.motion.dynamics import DERIVATIVES, TURN_SPEEDS
from mrmg.plans import Plan, Trajectory
from mrmg.scene.robot_model import RobotModel
from mrmg.scene.types import Scene, TerrainArea
from mrmg.simulation.log import ExecutionLog
from mrmg.simulation.plants import DEFAULT_PLANT
from mrmg.simulation.simulation import simulate
from mrmg.studies.calibration.manoeuvres import STEP_S, Manoeuvre

UNITS = {
    "rolling_coefficient": "1",
    "turning_coefficient": "1",
    "effective_mass_kg": "kg",
    "yaw_inertia_kg_m2": "kg m^2",
}
PARAMETERS = tuple(UNITS)
"""What the power of a leg is linear in. The energy model leaves out the last one."""

_ROBOT = "r1"
_MARGIN_M = 8.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Leg:
    """One piece of a manoeuvre as it was driven.

    Attributes:
        manoeuvre: which it is.
        piece: name of the piece.
        duration_s: how long it took.
        power_W: mean power of the drive, braking counted as negative.
        features: means that the parameters multiply, in the order of `PARAMETERS`,
            shape (4,).
    """

    manoeuvre: Manoeuvre
    piece: str
    duration_s: float
    power_W: float
    features: np.ndarray


def drive_legs(
    model: RobotModel, manoeuvre: Manoeuvre, plant: str = DEFAULT_PLANT
) -> Iterator[Leg]:
    """Drive a manoeuvre and yield its legs in which the robot moves.

    Raises:
        UsageError: if the robot cannot drive it.
    """
    log = drive(model, manoeuvre, plant)
    ends = STEP_S * np.cumsum([piece.steps for piece in manoeuvre.pieces])
    ticks = np.searchsorted(log.clock_s, [0.0, *(ends - 1e-6)])
    features = step_features(model, log)
    work_J = log.work_J[0].sum(axis=1)
    for piece, first, last in zip(manoeuvre.pieces, ticks, ticks[1:], strict=False):
        if piece.name == "steer":
            continue
        duration_s = float(log.time_s[last] - log.time_s[first])
        yield Leg(
            manoeuvre=manoeuvre,
            piece=piece.name,
            duration_s=duration_s,
            power_W=float(work_J[first:last].sum()) / duration_s,
            features=features[first:last].sum(axis=0) / duration_s,
        )


def drive(
    model: RobotModel, manoeuvre: Manoeuvre, plant: str = DEFAULT_PLANT
) -> ExecutionLog:
    """Drive a manoeuvre, alone on a plain of one terrain.

    Raises:
        UsageError: if the robot loses its way.
    """
    states = manoeuvre.states(model)
    scene = _plain(model, manoeuvre.multiplier, float(np.abs(states[:, :2]).max()))
    log = simulate(scene, _plan(scene, manoeuvre, states), plant=plant)
    if not log.completed:
        raise UsageError(f"model '{model.name}' cannot drive a {manoeuvre.name}")
    return log


def step_features(model: RobotModel, log: ExecutionLog) -> np.ndarray:
    """Return what the parameters multiply to give the work of each tick, (n, 4) [J]."""
    state = log.state[0]
    middle = 0.5 * (state[:-1] + state[1:])
    speed, second = middle[:, 3], middle[:, 4]
    duration_s = np.diff(log.time_s)
    weight_N = model.mass_kg * GRAVITY_M_S2
    turn_speed = TURN_SPEEDS[model.motion_model](np.tan)(speed, second, model.track_m)
    return np.stack(
        [
            weight_N * log.multiplier[0, :-1] * np.abs(speed) * duration_s,
            weight_N * turn_speed * duration_s,
            0.5 * np.diff(state[:, 3] ** 2),
            0.5 * np.diff(yaw_rate(model, state) ** 2),
        ],
        axis=1,
    )


def yaw_rate(model: RobotModel, state: np.ndarray) -> np.ndarray:
    """Return theta' by the motion model [rad/s], shape (n, 5) -> (n,)."""
    derivative = DERIVATIVES[model.motion_model](np.sin, np.cos, np.tan)
    _, _, heading, speed, second = state.T
    return np.asarray(
        derivative(heading, speed, second, 0.0, 0.0, model.wheelbase_m)[2]
    )


def _plain(model: RobotModel, multiplier: float, reach_m: float) -> Scene:
    scene = Scene.around(model, reach_m + _MARGIN_M)
    ground = shapely.box(*scene.bounds)
    area = TerrainArea(id="plain", shape=ground, multiplier=multiplier)
    return replace(scene, terrain=(area,))


def _plan(scene: Scene, manoeuvre: Manoeuvre, states: np.ndarray) -> Plan:
    return Plan(
        scene_name=scene.name,
        scene_digest=scene.digest,
        seed=0,
        profile="calibration",
        parameters_digest="",
        versions={},
        dt_s=STEP_S,
        trajectories=(
            Trajectory(
                robot=_ROBOT, dt_s=STEP_S, state=states, control=manoeuvre.control
            ),
        ),
        tours={_ROBOT: ()},
        visits=(),
        ledger=EnergyLedger(()),
    )
