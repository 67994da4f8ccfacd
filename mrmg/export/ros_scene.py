"""A scene as ROS 2 messages: occupancy grid, and markers for things and robots."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from typing import Any

import numpy as np
import shapely
from shapely.geometry import Polygon

from mrmg.export.ros_messages import RosTypes
from mrmg.scene.types import Goal, Obstacle, Scene, Station
from mrmg.simulation import palette
from mrmg.simulation.convex import numbered, triangles, upright_solid
from mrmg.world.elevation import ground_mesh, height_at, lifted
from mrmg.world.terrain import multiplier_at

MIN_CELL_M = 0.05
MAX_CELLS_PER_SIDE = 500
OCCUPIED, OCCUPIED_FOR_SOME = 100, 50
"""Values of cells that an obstacle touches: one for all robots, one for some."""

MAX_GROUND_CELLS_PER_SIDE = 100
_LIFT_M = 0.02
"""Height of flat things above the ground, so that they are seen."""
_LETTER_M = 0.8
_OPEN_GOAL = (1.0, 1.0, 1.0)
_LINE_M = 0.15
_LINE_STRIP, _TEXT, _TRIANGLES = 4, 9, 11
"""Types of markers."""


def occupancy_grid(ros: RosTypes, scene: Scene) -> Any:
    """Return the obstacles as a grid; a cell counts if an obstacle touches it."""
    x_min, y_min, x_max, y_max = scene.bounds
    longest_m = max(x_max - x_min, y_max - y_min)
    cell_m = max(MIN_CELL_M, longest_m / MAX_CELLS_PER_SIDE)
    columns = int(np.ceil((x_max - x_min) / cell_m - 1e-9))
    rows = int(np.ceil((y_max - y_min) / cell_m - 1e-9))
    x, y = np.meshgrid(
        x_min + cell_m * np.arange(columns), y_min + cell_m * np.arange(rows)
    )
    cells = shapely.STRtree(shapely.box(x, y, x + cell_m, y + cell_m).ravel())
    values = np.zeros(rows * columns, dtype=np.int8)
    for obstacle in scene.barriers:
        touched = cells.query(obstacle.shape, predicate="intersects")
        value = OCCUPIED if obstacle.blocks is None else OCCUPIED_FOR_SOME
        values[touched] = np.maximum(values[touched], value)
    origin = ros.pose((x_min, y_min, 0.0), (0.0, 0.0, 0.0, 1.0))
    loaded = ros.header(0.0).stamp
    about = ros["nav_msgs/MapMetaData"](loaded, cell_m, columns, rows, origin)
    return ros["nav_msgs/OccupancyGrid"](ros.header(0.0), about, values)


def scene_markers(ros: RosTypes, scene: Scene) -> Any:
    """Return bounds, ground or terrain, obstacles and stations."""
    border = shapely.segmentize(shapely.box(*scene.bounds).exterior, 1.0)
    line = lifted(scene, shapely.get_coordinates(border), _LIFT_M)
    markers = [_marker(ros, "bounds", _LINE_STRIP, line, palette.WALL)]
    if scene.elevation is None:
        for area in scene.terrain:
            color = palette.terrain_colour(area.multiplier)
            markers.append(_flat(ros, scene, "terrain", area.shape, color))
    else:
        markers.append(_ground(ros, scene))
    markers += [_solid(ros, scene, obstacle) for obstacle in scene.obstacles]
    for station in scene.stations:
        markers += _target(ros, scene, station, palette.STATION)
    return _array(ros, markers)


def goal_markers(
    ros: RosTypes,
    scene: Scene,
    goals: Collection[str],
    *,
    color: palette.Rgb = _OPEN_GOAL,
    time_s: float = 0.0,
) -> Any:
    """Return the markers of some goals, by id."""
    markers: list[Any] = []
    for goal in scene.goals:
        if goal.id in goals:
            markers += _target(ros, scene, goal, color)
    return _array(ros, markers, time_s)


def robot_markers(ros: RosTypes, scene: Scene, names: Mapping[str, str]) -> Any:
    """Return the robots' bodies and names, which move with their frames.

    Args:
        ros: the message types.
        scene: gives the robots.
        names: name of the frame of each robot, by robot.
    """
    markers = []
    for at, robot in enumerate(scene.robots):
        frame = f"{names[robot.id]}/base_link"
        model = robot.model
        body = _prism(Polygon(model.footprint_m), model.height_m)
        color = palette.robot_colour(at)
        top = np.array([0.0, 0.0, model.height_m + _LETTER_M])
        for marker in (
            _marker(ros, f"{robot.id} body", _TRIANGLES, body, color),
            _text(ros, f"{robot.id} name", top, robot.id),
        ):
            marker.header.frame_id = frame
            marker.frame_locked = True
            markers.append(marker)
    return _array(ros, markers)


def _array(ros: RosTypes, markers: list[Any], time_s: float = 0.0) -> Any:
    for marker in markers:
        marker.header = ros.header(time_s, marker.header.frame_id)
    return ros["visualization_msgs/MarkerArray"](markers)


def _target(
    ros: RosTypes, scene: Scene, target: Goal | Station, color: palette.Rgb
) -> Iterator[Any]:
    """Yield the region of a goal or station, and its name."""
    name = f"{target.kind} {target.id}"
    yield _flat(ros, scene, name, target.region.shape, color)
    above = lifted(scene, target.region.center, _LETTER_M)[0]
    yield _text(ros, f"{name} name", above, target.id)


def _flat(
    ros: RosTypes, scene: Scene, name: str, shape: Polygon, color: palette.Rgb
) -> Any:
    """Return an area that lies on the ground."""
    points, faces = numbered(triangles(shape))
    corners = lifted(scene, points[faces.ravel()], _LIFT_M)
    return _marker(ros, name, _TRIANGLES, corners, color)


def _solid(ros: RosTypes, scene: Scene, obstacle: Obstacle) -> Any:
    """Return an obstacle, from the lowest ground below it to its height above all."""
    for_all = obstacle.blocks is None
    color = palette.OBSTACLE if for_all else palette.PARTIAL_OBSTACLE
    ground_m = height_at(scene, shapely.get_coordinates(obstacle.shape))
    corners = _prism(obstacle.shape, obstacle.height_m + float(np.ptp(ground_m)))
    corners[:, 2] += ground_m.min()
    return _marker(ros, f"obstacle {obstacle.id}", _TRIANGLES, corners, color)


def _ground(ros: RosTypes, scene: Scene) -> Any:
    """Return the ground of a scene with elevation, coloured by its terrain."""
    x_min, y_min, x_max, y_max = scene.bounds
    cell_m = max(x_max - x_min, y_max - y_min) / MAX_GROUND_CELLS_PER_SIDE
    nodes, faces = ground_mesh(scene, (x_min, y_min), (x_max, y_max), cell_m)
    corners = nodes[faces.ravel()]
    middle = corners.reshape(-1, 3, 3).mean(axis=1)[:, :2]
    multipliers, which = np.unique(multiplier_at(scene, middle), return_inverse=True)
    colors = [_color(ros, palette.terrain_colour(value)) for value in multipliers]
    marker = _marker(ros, "ground", _TRIANGLES, corners, palette.terrain_colour(1.0))
    marker.colors = [colors[at] for at in np.repeat(which, 3)]
    return marker


def _prism(shape: Polygon, height_m: float) -> np.ndarray:
    """Return the corners of the triangles round an upright solid, shape (3 n, 3)."""
    corners, faces = upright_solid(triangles(shape), height_m)
    return np.asarray(corners[faces.ravel()])


def _text(ros: RosTypes, name: str, where: np.ndarray, text: str) -> Any:
    marker = _marker(ros, name, _TEXT, np.empty((0, 3)), (0.1, 0.1, 0.1))
    marker.pose.position = ros.point(*where.tolist())
    marker.scale.z = _LETTER_M
    marker.text = text
    return marker


def _marker(
    ros: RosTypes, name: str, kind: int, points: np.ndarray, color: palette.Rgb
) -> Any:
    """Return a marker of the map's frame that stays."""
    scale_m = _LINE_M if kind == _LINE_STRIP else 1.0
    return ros.made(
        "visualization_msgs/Marker",
        header=ros.header(0.0),
        ns=name,
        type=kind,
        pose=ros.pose((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)),
        scale=ros.vector(scale_m, scale_m, scale_m),
        color=_color(ros, color),
        points=[ros.point(*point) for point in points.tolist()],
    )


def _color(ros: RosTypes, color: palette.Rgb) -> Any:
    return ros["std_msgs/ColorRGBA"](*color, 1.0)
