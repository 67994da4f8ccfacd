"""What the paper's method does not know, and refuses by name."""

from __future__ import annotations

import math

from mrmg.errors import UsageError
from mrmg.scene.types import Scene


def refuse_unknown_features(scene: Scene) -> None:
    """Refuse a scene with features that the paper lacks.

    Raises:
        UsageError: naming every such feature and where the scene has it.
    """
    unknown = unknown_features(scene)
    if unknown:
        raise UsageError(
            f"{scene.name}: planner guided_tree (profile paper) does not know "
            f"{'; '.join(unknown)}. Remove that from the scene, or plan it with "
            "--planner path_following (profile default)"
        )


def unknown_features(scene: Scene) -> list[str]:
    """Return the features of a scene that the paper lacks, each with its place."""
    places = {
        "dwell times": [item.id for item in scene.targets() if item.dwell_s > 0.0],
        "goals with headings": [
            goal.id for goal in scene.goals if goal.heading_rad is not None
        ],
        "stations for one robot at a time": [
            station.id for station in scene.stations if station.one_at_a_time
        ],
        "recharging that takes time": [
            robot.id for robot in scene.robots if robot.battery.takes_time_to_fill
        ],
        "finishes": [robot.id for robot in scene.robots if robot.finish],
        "custom motion models": [
            robot.id for robot in scene.robots if robot.model.has_custom_motion
        ],
    }
    found = [f"{name} ({', '.join(ids)})" for name, ids in places.items() if ids]
    if math.isfinite(scene.time_limit_s):
        found.append(f"time limits ({scene.time_limit_s:g} s)")
    if scene.objective.makespan_weight:
        found.append(f"objectives other than energy ({scene.objective.name})")
    if scene.elevation is not None:
        found.append("elevation")
    return found
