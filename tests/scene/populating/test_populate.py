"""Populated maps hold missions that are feasible, and only with recharging."""

from __future__ import annotations

import math
import re
import shutil
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
import yaml
from places import import_map, nearest

from mrmg.errors import UsageError
from mrmg.scene.loading import load_scene, scene_from_document
from mrmg.scene.loading.models import model_folder
from mrmg.scene.margins import STATES_NONE
from mrmg.scene.populating.ground import Ground
from mrmg.scene.populating.populate import populate
from mrmg.scene.robot_figures import figure_lines
from mrmg.scene.types import Scene
from mrmg.shipped import models_folder

MAPS = Path(__file__).parents[4] / "shared" / "maps"
FLEET_MAPS = (
    "warehouse.txt",
    "gaps.txt",
    pytest.param("complex3-big.txt", marks=pytest.mark.ci),
    pytest.param("triangles.tri", marks=pytest.mark.ci),
)
PAIR_MAPS = (
    "potholes.txt",
    "dense.tri",
    *(
        pytest.param(name, marks=pytest.mark.ci)
        for name in ("complex2.txt", "geometry-reduced.txt", "warehouse2.txt")
    ),
)

FIELD: dict[str, Any] = {
    "format": 1,
    "name": "field",
    "bounds": [0, 0, 60, 40],
    "obstacles": [{"id": "barn", "box": {"center": [30, 20], "size": [12, 6]}}],
    "terrain": [{"circle": {"center": [45, 10], "radius": 6}, "multiplier": 2}],
}


def placed(document: dict[str, Any], **wanted: Any) -> Scene:
    return populate(scene_from_document(document, source="test"), **wanted)


def check_mission(scene: Scene, robots: int, goals: int) -> None:
    """What every populated scene must keep."""
    assert (len(scene.robots), len(scene.goals)) == (robots, goals)
    model = scene.robots[0].model
    ground = Ground.over(
        scene.bounds,
        [wall.shape for wall in scene.obstacles],
        [(area.shape, area.multiplier) for area in scene.terrain],
        margin_m=model.half_width_m + 0.2,
    )
    places = [robot.pose[:2] for robot in scene.robots]
    places += [tuple(target.region.center) for target in scene.targets()]
    road = ground.distances([nearest(ground, p) for p in places])[
        :, [nearest(ground, p) for p in places]
    ]
    battery = scene.robots[0].battery
    usable_J = battery.capacity_J - battery.reserve_J
    usable_m = usable_J / model.energy_model.plain_ground_J_per_m()
    start, sites, posts = np.split(np.arange(len(places)), [robots, robots + goals])

    # Every place can be reached, every goal is within half a battery of a station, and
    # the stations form a chain.
    assert np.isfinite(road).all()
    assert road[np.ix_(sites, posts)].min(axis=1).max() <= 0.45 * usable_m
    assert road[np.ix_(start, posts)].min(axis=1).max() <= 0.7 * usable_m
    assert _chained(road[np.ix_(posts, posts)] <= 0.9 * usable_m)
    # No plan does without recharging.
    farthest_m = road[np.ix_(start, sites)].min(axis=0).max()
    assert farthest_m > usable_m or _forest_m(road, robots, goals) > robots * usable_m
    # Places are apart from each other.
    gaps = [np.hypot(*np.subtract(a, b)) for a, b in combinations(places, 2)]
    assert min(gaps) > 1.0


def _chained(near: np.ndarray) -> bool:
    reached = near[0]
    for _ in near:
        reached = near[reached].any(axis=0) | reached
    return bool(reached.all())


def _forest_m(road: np.ndarray, robots: int, goals: int) -> float:
    """Return the least spanning forest of the goals, rooted at the robots (Prim)."""
    inside, outside = list(range(robots)), list(range(robots, robots + goals))
    total = 0.0
    while outside:
        legs = road[np.ix_(inside, outside)]
        total += legs.min()
        inside.append(outside.pop(int(legs.min(axis=0).argmin())))
    return total


@pytest.mark.quick("potholes.txt")
@pytest.mark.parametrize("name", PAIR_MAPS)
def test_two_robots_on_shared_map(name: str) -> None:
    path = MAPS / name
    if not path.exists():
        pytest.skip(f"{name} is not here")
    check_mission(placed(import_map(path)), 2, 14)


@pytest.mark.quick("gaps.txt")
@pytest.mark.parametrize("name", FLEET_MAPS)
def test_fleet_on_shared_map(name: str) -> None:
    path = MAPS / name
    if not path.exists():
        pytest.skip(f"{name} is not here")
    check_mission(placed(import_map(path), robots=4, goals=20), 4, 20)


@pytest.mark.slow
def test_map_too_narrow_for_the_robot() -> None:
    path = MAPS / "jf-pb2.txt"
    if not path.exists():
        pytest.skip("jf-pb2.txt is not here")
    with pytest.raises(UsageError, match=r"join only \d+ % .* scale the map up"):
        placed(import_map(path))
    check_mission(placed(import_map(path, 300.0)), 2, 14)


@pytest.mark.quick("0", "1")
@pytest.mark.parametrize("seed", range(4))
def test_seeds(seed: int) -> None:
    scene = placed(FIELD, goals=6, stations=3, seed=seed)
    check_mission(scene, 2, 6)
    assert scene == placed(FIELD, goals=6, stations=3, seed=seed)


def test_large_fleet() -> None:
    check_mission(placed(FIELD, robots=8, goals=120, stations=30), 8, 120)


def test_seeds_differ() -> None:
    scenes = [placed(FIELD, goals=6, stations=3, seed=seed) for seed in range(3)]
    assert len({scene.digest for scene in scenes}) == 3


def test_batteries_feed_what_consumers_draw_on_the_way(tmp_path: Path) -> None:
    folder = tmp_path / "own"
    shutil.copytree(models_folder() / "car", folder)
    stated = (folder / "robot.yaml").read_text()
    drawing = re.sub("(?m)^idle_power: .*$", "idle_power: 100.0", stated)
    (folder / "robot.yaml").write_text(drawing)
    quickstart = load_scene("quickstart")
    plain, own = populate(quickstart), populate(quickstart, model=str(folder))
    model = own.robots[0].model
    top_m_s = model.planning_share * model.limits.v_max_m_s
    share = 1.0 + 100.0 / (model.energy_model.plain_ground_J_per_m() * top_m_s)
    ratio = own.robots[0].battery.capacity_J / plain.robots[0].battery.capacity_J
    assert ratio == pytest.approx(share, abs=0.01)
    reach = next(line for line in figure_lines(model) if line.startswith("battery"))
    plain_J = model.energy_model.plain_ground_J_per_m()
    least_m = model.battery_capacity_J / (plain_J * share)
    assert f", {least_m:.0f} m with what its consumers draw at top speed" in reach


def test_map_is_kept_and_mission_replaced() -> None:
    before = load_scene("quickstart").with_(margins={"obstacle": 0.4})
    after = populate(before, robots=1, goals=3, stations=2)
    for part in ("name", "bounds", "obstacles", "terrain"):
        assert after.document[part] == before.document[part]
    assert after.robots[0].margins == STATES_NONE
    check_mission(after, 1, 3)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"robots": 0}, "cannot place 0 robots; ask for at least 1"),
        ({"goals": -1}, "cannot place -1 goals"),
        ({"stations": 0}, "cannot place 0 stations"),
        ({"model": "cra"}, "unknown model 'cra' .did you mean 'car'"),
        ({"goals": 500}, "506 are wanted; ask for fewer, or scale the map up"),
        ({"stations": 1, "robots": 99}, "no place where 99 robots can start"),
    ],
)
def test_what_cannot_be_placed(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(UsageError, match=message):
        placed(FIELD, **{"robots": 1, "stations": 5, **changes})


def test_robot_bound_obstacles_are_refused() -> None:
    wall = {"box": {"center": [10, 10], "size": [2, 2]}, "blocks": ["r1"]}
    robot = {"id": "r1", "model": "car", "pose": [5, 5, 0]}
    with pytest.raises(UsageError, match="remove 'blocks'"):
        placed({**FIELD, "obstacles": [wall], "robots": [robot]})


def test_roads_of_small_robots_are_narrow(tmp_path: Path) -> None:
    """A robot of 0.3 m among posts 0.8 m apart."""
    shipped = model_folder("diffdrive", None) / "robot.yaml"
    entry = yaml.safe_load(shipped.read_text())
    for key in ("mjcf", "tracking_error"):
        del entry[key]
    entry["footprint"] = [[0.4 * x, 0.4 * y] for x, y in entry["footprint"]]
    for key in ("height", "wheelbase", "track", "center_of_mass"):
        entry[key] *= 0.4
    entry["wheel"]["radius"] *= 0.4
    for key in ("v_min", "v_max", "u1_max"):
        entry["limits"][key] *= 0.2
    (tmp_path / "robot.yaml").write_text(yaml.safe_dump(entry))
    posts = [
        {"box": {"center": [x, y], "size": [0.2, 0.2]}}
        for x in np.arange(0.5, 6.0, 1.0).tolist()
        for y in np.arange(0.5, 6.0, 1.0).tolist()
    ]
    hall = {"format": 1, "name": "hall", "bounds": [0, 0, 6, 6], "obstacles": posts}
    scene = placed(hall, model=str(tmp_path), robots=1, goals=5, stations=2)
    assert len(scene.goals) == 5


def test_no_room_at_all() -> None:
    with pytest.raises(UsageError, match="scale the map up"):
        placed({"format": 1, "name": "box", "bounds": [0, 0, 1, 1]})


def test_a_mission_that_need_not_recharge_is_better_than_none() -> None:
    scene = placed(FIELD, robots=20, goals=3, stations=1)
    assert (len(scene.robots), len(scene.goals)) == (20, 3)


def test_small_robots_get_small_places() -> None:
    scene = placed(FIELD, goals=5, stations=2, model="diffdrive")
    assert {robot.model.name for robot in scene.robots} == {"diffdrive"}
    radii = [goal.region.radius_m for goal in scene.goals]
    assert radii == pytest.approx([math.hypot(0.55, 0.35)] * 5, abs=1e-3)


def test_slopes_are_kept_and_steep_ground_left_out() -> None:
    """Nothing is placed on a ridge that cars cannot climb, nor beyond what they can."""
    ridge = {
        "hills": [{"center": [20, 20], "height": 6, "radius": 9}],
        "slope": "avoid",
    }
    scene = placed({**FIELD, "elevation": ridge}, goals=6, stations=2)
    assert scene.elevation is not None
    steep = shapely.union_all(
        [wall.shape for wall in scene.barriers if wall.is_steep_ground]
    )
    assert steep.area > 10.0
    for target in scene.targets():
        assert not steep.contains(shapely.Point(target.region.center))
