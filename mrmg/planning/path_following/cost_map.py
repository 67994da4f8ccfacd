"""Cost maps of paths: terrain, clearance and curvature, for each robot."""

from __future__ import annotations

import numpy as np

from mrmg.motion._kernels import UNICYCLE
from mrmg.planning.path_following._band_kernels import CostMap
from mrmg.planning.problem.problem import Problem
from mrmg.planning.problem.time_weighting import energy_share

DISCS_SHARE = 0.4
"""Distance of the discs that cover a footprint, at most, as a share of its width."""

INFLATION_REACH_M = 4.0
"""How far around a place a path is led farther from obstacles ..."""

INFLATION_M = 0.06
"""... and how much farther, at the place."""

ROOM_SHARE = 0.24
"""Room beyond the margin that a path leaves, as a share of the margin, for what driving
it may be off: it costs next to nothing, and robots seldom get stuck."""

CURVATURE_SHARE = 0.92
"""Share of the steering that a path uses."""


def cost_maps_of(problem: Problem) -> list[CostMap]:
    """Return what each robot's paths are priced on."""
    smooth = smooth_terrain(problem.mission.terrain.multiplier)
    return [_cost_map(problem, r, smooth) for r in range(len(problem.scene.robots))]


def _cost_map(problem: Problem, r: int, smooth: np.ndarray) -> CostMap:
    """Return the cost map of robot r's paths; `smooth` is `smooth_terrain`."""
    robot = problem.mission.fleet[r]
    spaces = problem.mission.spaces
    model = problem.scene.robots[r].model
    outline = robot["corner"][: robot["corners"]]
    low, high = outline.min(axis=0), outline.max(axis=0)
    half = max(-low[1], high[1])
    pieces = max(1, int(np.ceil((high[0] - low[0]) / (DISCS_SHARE * 2.0 * half))))
    length = (high[0] - low[0]) / pieces
    limit, margin_m = robot["limit"], (1.0 + ROOM_SHARE) * float(robot["margin"])
    if robot["model"] == UNICYCLE:
        rate = 4.0 * limit[4] / limit[1] ** 2
        turning_room_m = model.circumscribed_radius_m + margin_m
    else:
        rate = limit[4] / (float(robot["wheelbase"]) * limit[1])
        turning_room_m = 0.0
    share = energy_share(problem.preference.driving, problem.scene.robots[r])
    return CostMap(
        x_min=spaces.x_min,
        y_min=spaces.y_min,
        cell=spaces.cell,
        distance=spaces.distance[robot["space"]],
        multiplier=smooth if share == 1.0 else share * smooth + (1.0 - share),
        disc=low[0] + length * (np.arange(pieces) + 0.5),
        length=float(high[0] - low[0]),
        room=float(np.hypot(0.5 * length, half) + margin_m),
        turning_room=turning_room_m,
        curvature=path_curvature(robot),
        curvature_rate=float(CURVATURE_SHARE * rate),
        scrub=radian_m(problem, r),
    )


def radian_m(problem: Problem, r: int) -> float:
    """Return what turning by one radian is worth to robot r [m of plain ground]."""
    robot, limit = problem.mission.fleet[r], problem.mission.fleet[r]["limit"]
    energy = problem.scene.robots[r].model.energy_model
    arm_m, turning_m = float(robot["wheelbase"]), 0.0
    if robot["model"] == UNICYCLE:
        # A radian takes as long as so much way, for which the robot slows down.
        arm_m, turning_m = float(robot["track"]), limit[1] / limit[2]
    scrub_m = arm_m * energy.turning_force_N / max(energy.rolling_force_N, 1e-9)
    share = energy_share(problem.preference.driving, problem.scene.robots[r])
    return float(share * scrub_m + (1.0 - share) * turning_m)


def path_curvature(robot: np.ndarray) -> float:
    """Return the curvature of the sharpest turn of a robot's paths [1/m].

    Args:
        robot: a record of FLEET.
    """
    limit, radius = robot["limit"], float(robot["turning_radius"])
    if robot["model"] == UNICYCLE:
        # Sharper than it can turn at full speed: it slows down there.
        return float(CURVATURE_SHARE * 2.0 * limit[2] / limit[1])
    return CURVATURE_SHARE / radius if radius > 0.0 else np.inf  # a user's motion


def inflated(cost_map: CostMap, place: np.ndarray) -> CostMap:
    """Return the cost map with obstacles counted as nearer around a place."""
    distance = cost_map.distance.copy()
    x, y = (
        least + (np.arange(count) + 0.5) * cost_map.cell - at
        for least, count, at in zip(
            (cost_map.x_min, cost_map.y_min), distance.shape[::-1], place, strict=True
        )
    )
    columns, rows = (np.flatnonzero(np.abs(off) < INFLATION_REACH_M) for off in (x, y))
    far = np.hypot(x[None, columns], y[rows, None]) / INFLATION_REACH_M
    distance[np.ix_(rows, columns)] -= INFLATION_M * np.maximum(0.0, 1.0 - far)
    return cost_map._replace(distance=distance)


def smooth_terrain(multiplier: np.ndarray) -> np.ndarray:
    """Return the terrain with its borders blurred over about a metre."""
    weights = np.array([1.0, 4.0, 6.0, 4.0, 1.0]) / 16.0
    for axis in (0, 1):
        width = [(2, 2) if a == axis else (0, 0) for a in (0, 1)]
        padded = np.pad(multiplier, width, "edge")
        windows = np.lib.stride_tricks.sliding_window_view(padded, 5, axis=axis)
        multiplier = windows @ weights
    return np.ascontiguousarray(multiplier)
