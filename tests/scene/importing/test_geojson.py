"""Features, route graphs and layouts become goals, stations and robots."""

from __future__ import annotations

import copy
import json
from itertools import permutations
from pathlib import Path
from typing import Any

import numpy as np
import pyproj
import pytest
import shapely

from mrmg.errors import SceneError
from mrmg.scene.importing.formats.lif import read_lif
from mrmg.scene.importing.importing import import_files
from mrmg.scene.importing.layers import ImportOptions
from mrmg.scene.loading import scene_from_document
from mrmg.scene.types import Scene

NAV2 = Path(__file__).parents[4] / "shared" / "nav2"
BOX = shapely.box(0, 0, 40, 30)


def feature(shape: shapely.Geometry, **properties: Any) -> dict[str, Any]:
    geometry = shapely.geometry.mapping(shape)
    return {"type": "Feature", "properties": properties, "geometry": geometry}


def written(path: Path, features: list[dict[str, Any]], crs: str | None) -> Path:
    document: dict[str, Any] = {"type": "FeatureCollection", "features": features}
    if crs is not None:
        document["crs"] = {"type": "name", "properties": {"name": crs}}
    path.write_text(json.dumps(document))
    return path


def scene_of(*files: Path, **keys: Any) -> Scene:
    found = import_files(files, ImportOptions(**keys))
    return scene_from_document(found.document, source="test")


MISSION = [
    feature(BOX - BOX.buffer(-1), kind="obstacle", id="fence", height=2.0),
    feature(shapely.LineString([(10, 10), (10, 20)]), kind="obstacle"),
    feature(
        shapely.box(20, 5, 30, 15), kind="terrain", id="mud", multiplier=2, turning=1.5
    ),
    feature(shapely.Point(5, 5), kind="goal", id="g1", radius=1.5, dwell=10),
    feature(shapely.box(30, 20, 33, 23), kind="goal", id="pallet 7"),
    feature(shapely.Point(20, 20), kind="station"),
    feature(shapely.Point(15, 5), kind="robot", id="r1", model="car", heading=1.57),
]


def test_every_kind(tmp_path: Path) -> None:
    scene = scene_of(written(tmp_path / "a.geojson", MISSION, "local"))
    assert scene.bounds == (0.0, 0.0, 40.0, 30.0)
    fence, wall = scene.obstacles
    assert (fence.id, fence.height_m, len(fence.shape.interiors)) == ("fence", 2.0, 1)
    assert wall.shape.area == pytest.approx(10 * 0.1, rel=0.02)
    (mud,) = scene.terrain
    assert (mud.multiplier, mud.turning_multiplier) == (2.0, 1.5)
    assert [goal.id for goal in scene.goals] == ["g1", "pallet_7"]
    assert (scene.goals[0].region.radius_m, scene.goals[0].dwell_s) == (1.5, 10.0)
    assert scene.stations[0].id == "station_1"
    assert scene.robots[0].pose == pytest.approx((15.0, 5.0, 1.57))


@pytest.mark.parametrize("crs", ["EPSG:25832", "EPSG:4326", None, "EPSG:3857"])
def test_any_coordinates(crs: str | None, tmp_path: Path) -> None:
    """The same ground in other coordinates is the same scene, in true metres."""
    at = np.array([450_000.0, 5_300_000.0])
    to = pyproj.Transformer.from_crs("EPSG:25832", crs or "EPSG:4326", always_xy=True)

    def moved(points: np.ndarray) -> np.ndarray:
        return np.stack(to.transform(*(points + at).T), axis=1)

    features = [
        feature(
            shapely.transform(shapely.geometry.shape(item["geometry"]), moved),
            **item["properties"],
        )
        for item in MISSION
    ]
    scene = scene_of(written(tmp_path / "a.geojson", features, crs))
    plain = scene_of(written(tmp_path / "b.geojson", MISSION, "local"))
    shift = np.array(scene.bounds[:2])
    for target, wanted in zip(scene.targets(), plain.targets(), strict=True):
        found = target.region.center - shift
        assert found == pytest.approx(wanted.region.center, abs=0.02)
    assert scene.bounds[2] - scene.bounds[0] == pytest.approx(40.0, abs=0.02)


def test_route_graph_alone_and_on_its_map() -> None:
    if not NAV2.exists():
        pytest.skip("no shared maps")
    graph, depot = NAV2 / "depot_graph.geojson", NAV2 / "depot.yaml"
    nodes = json.loads(graph.read_text())["features"]
    stated = {
        f"node_{item['properties']['id']}": item["geometry"]["coordinates"]
        for item in nodes
        if item["geometry"]["type"] == "Point"
    }
    alone = scene_of(graph)
    assert {goal.id for goal in alone.goals} == set(stated)
    for goal in alone.goals:
        assert goal.region.center == pytest.approx(stated[goal.id], abs=1e-5)
    lanes = scene_of(depot, graph, lane_width_m=1.2)
    closed = shapely.union_all([wall.shape for wall in lanes.obstacles])
    edges = shapely.union_all(
        [
            shapely.geometry.shape(item["geometry"])
            for item in nodes
            if item["geometry"]["type"] == "LineString"
        ]
    )
    free = shapely.box(*lanes.bounds) - closed
    assert free.buffer(-1e-6).difference(edges.buffer(0.6 + 1e-6)).area < 1e-6
    assert closed.intersection(edges.buffer(0.3)).area < 1.0  # obstacles of the map


def test_land_based_features_need_no_extra(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(__import__("sys").modules, "pyproj", None)
    assert scene_of(written(tmp_path / "a.geojson", MISSION, None), crs="local").goals


@pytest.mark.parametrize("kind", ["obstacle", "terrain"])
def test_areas_that_cross_themselves_count_whole(kind: str, tmp_path: Path) -> None:
    """A bow tie's halves have opposite signs: their sum says nothing of its area."""
    keys = {"kind": kind, "multiplier": 2.0}
    goal = feature(shapely.Point(20, 20), kind="goal")
    bow = shapely.Polygon([(5, 5), (9, 9), (9, 5), (5, 9)])
    path = written(tmp_path / "a.geojson", [feature(bow, **keys), goal], "local")
    found = import_files([path])
    scene = scene_from_document(found.document, source="test")
    areas = scene.obstacles if kind == "obstacle" else scene.terrain
    assert sum(area.shape.area for area in areas) == pytest.approx(8.0)
    assert any("features.0 crossed itself: repaired" in note for note in found.notes)
    ring = [(5, 5), (9, 5), (9, 9), (5, 9)]
    hole = feature(
        shapely.Polygon(ring, [[(7, 7), (11, 7), (11, 11), (7, 11)]]), **keys
    )
    scene = scene_of(written(path, [hole, goal], "local"))
    areas = scene.obstacles if kind == "obstacle" else scene.terrain
    assert sum(area.shape.area for area in areas) == pytest.approx(12.0)
    nothing = feature(shapely.Polygon(ring, [ring]), **keys)
    with pytest.raises(SceneError, match="features.0.geometry: has no area: its holes"):
        scene_of(written(path, [nothing, goal], "local"))


@pytest.mark.parametrize(
    ("shape", "keys", "message"),
    [
        (shapely.Point(1, 1), {"radius": 10**400}, "radius: got 1000.*positive number"),
        (shapely.Point(1e20, 1), {}, "the ground is only 0 x 4 m; check"),
        (shapely.Polygon([(0, 0), (1, 1), (2, 2)]), {}, "0.geometry: has no area"),
        (
            shapely.Point(1, 1),
            {"kind": "robot", "heading": "north"},
            "heading: got 'north'; expected a number",
        ),
    ],
)
def test_numbers_and_shapes_that_mean_nothing(
    shape: shapely.Geometry, keys: dict[str, Any], message: str, tmp_path: Path
) -> None:
    features = [feature(shape, **({"kind": "goal"} | keys))]
    with pytest.raises(SceneError, match=message):
        scene_of(written(tmp_path / "a.geojson", features, "local"))


def test_whole_numbers_of_many_digits(tmp_path: Path) -> None:
    place = feature(shapely.Point(1, 1), kind="goal", radius=10**20)
    with pytest.raises(SceneError, match=r"got 1e\+20; must be <= 1e\+06 \(radius"):
        scene_of(written(tmp_path / "a.geojson", [place], "local"))
    place["geometry"]["coordinates"] = [10**401, 1]
    with pytest.raises(SceneError, match=r"features.0.geometry: got .* a geometry"):
        scene_of(written(tmp_path / "a.geojson", [place], "local"))


@pytest.mark.parametrize("crs", ['LOCAL_CS["x",UNIT["metre",1]]', "EPSG:4978"])
def test_coordinates_of_no_map(crs: str, tmp_path: Path) -> None:
    path = written(tmp_path / "a.geojson", MISSION, crs)
    with pytest.raises(SceneError, match="is neither geographic nor projected; state"):
        scene_of(path)
    assert scene_of(path, crs="local").goals


def test_who_is_blocked(tmp_path: Path) -> None:
    """Obstacles name robots as their file does, whatever these are called then."""
    walls = [
        feature(shapely.box(x, 5, x + 1, 6), kind="obstacle", id=f"w{x}", blocks=names)
        for x, names in ((5, ["r 1"]), (7, ["r 1", "r2"]), (9, ["r2"]), (11, ["r3"]))
    ]
    robots = [
        feature(shapely.Point(*at), kind="robot", id=name, model="car")
        for name, at in (("r 1", (20, 20)), ("r2", (35, 20)))
    ]
    path = written(tmp_path / "a.geojson", [*MISSION[:-1], *walls, *robots], "local")
    found = import_files([path], ImportOptions(crop=(0.0, 0.0, 30.0, 30.0)))
    blocked = {
        wall.get("id"): wall.get("blocks") for wall in found.document["obstacles"]
    }
    assert (blocked["w5"], blocked["w7"], blocked["w11"]) == (["r_1"], ["r_1"], ["r3"])
    assert "w9" not in blocked, "it stops nobody who is left"


def test_obstacles_without_an_id_take_none(tmp_path: Path) -> None:
    goal = feature(shapely.Point(5, 5), kind="goal", id="None")
    path = written(tmp_path / "a.geojson", [*MISSION[1:3], goal], "local")
    assert [goal.id for goal in scene_of(path).goals] == ["None"]


def test_obstacles_alone_leave_no_ground(tmp_path: Path) -> None:
    path = written(tmp_path / "a.geojson", [feature(BOX, kind="obstacle")], "local")
    with pytest.raises(SceneError, match=r"40 x 30 m, which reaches .* --crop") as it:
        scene_of(path)
    assert "--unknown" not in str(it.value)
    assert scene_of(path, crop=(0.0, 0.0, 50.0, 30.0)).obstacles
    small = shapely.affinity.scale(BOX, 1e-6, 1e-6)
    path = written(tmp_path / "a.geojson", [feature(small, kind="obstacle")], "local")
    with pytest.raises(SceneError, match=r"the ground is only 4e-05 x 3e-05 m; check"):
        scene_of(path)


def test_features_without_a_kind(tmp_path: Path) -> None:
    path = written(tmp_path / "a.geojson", [feature(BOX, name="x")], "local")
    with pytest.raises(SceneError, match=r"none has a property 'kind' \(obstacle, ter"):
        scene_of(path)
    found = import_files([written(path, [feature(BOX), *MISSION], "local")])
    assert any("without a property 'kind' (obs" in note for note in found.notes)


@pytest.mark.parametrize("stated", [False, "false", "no", 0, "0", "None"])
def test_what_does_not_charge_is_no_station(stated: Any, tmp_path: Path) -> None:
    points = [
        feature(shapely.Point(9 * n, 5), id=n, charging=value)
        for n, value in enumerate((stated, True))
    ]
    points += [
        feature(shapely.Point(9, 9), id=2, operations={"charge": {"type": "dock"}}),
        feature(shapely.Point(0, 9), id=3, operations=[{"type": "startCharging"}]),
        feature(shapely.Point(5, 15), id=4, tags=[{"key": "charger", "value": stated}]),
    ]
    scene = scene_of(written(tmp_path / "a.geojson", points, "local"))
    assert [goal.id for goal in scene.goals] == ["node_0", "node_4"]
    assert len(scene.stations) == 3
    document = copy.deepcopy(LIF)
    document["layouts"][0]["stations"][0] |= {"stationName": "S", "charging": stated}
    path = tmp_path / "hall.lif"
    path.write_text(json.dumps(document))
    assert [station.id for station in scene_of(path).stations] == ["N3"]


def test_parts_that_are_nested_deeply(tmp_path: Path) -> None:
    deep: dict[str, Any] = {"action": "startCharging"}
    for _ in range(440):
        deep = {"more": deep}
    points = [feature(shapely.Point(9 * n, 5), id=n, metadata=deep) for n in range(2)]
    path = written(tmp_path / "a.geojson", points, "local")
    assert len(scene_of(path).stations) == 2
    document = copy.deepcopy(LIF)
    document["layouts"][0]["stations"][0] |= {"stationName": "S", "metadata": deep}
    properties = document["layouts"][0]["nodes"][0]["vehicleTypeNodeProperties"]
    properties.append({"vehicleTypeId": "agv", "metadata": deep})
    path = tmp_path / "hall.lif"
    path.write_text(json.dumps(document))
    assert [station.id for station in scene_of(path).stations] == ["N1", "N3", "N4"]


def test_lif_nodes_given_twice(tmp_path: Path) -> None:
    document = copy.deepcopy(LIF)
    nodes = document["layouts"][0]["nodes"]
    nodes.append({**nodes[0], "nodePosition": {"x": 5.0, "y": 5.0}})
    path = tmp_path / "hall.lif"
    path.write_text(json.dumps(document))
    message = "nodes.N1: is given more than once in layout 'ground'"
    with pytest.raises(SceneError, match=message):
        scene_of(path)
    (layout,) = LIF["layouts"]
    path.write_text(json.dumps({"layouts": [layout] * 3}))
    with pytest.raises(SceneError, match=message):
        scene_of(path)


def test_local_maps_do_not_fit_geographic_features(
    tmp_path: Path, write_map: Any, write_tiff: Any
) -> None:
    place = feature(shapely.Point(8.3, 47.8), kind="goal")
    path = written(tmp_path / "a.geojson", [place], "EPSG:4326")
    local = write_map(tmp_path, np.full((20, 20), 254))
    heights = write_tiff(tmp_path / "a.tif", np.full((20, 20), 3.0))
    for other in (local, heights):
        with pytest.raises(SceneError, match="metres of its own.*of EPSG:32632.*--crs"):
            scene_of(path, other)
    graph = written(tmp_path / "b.geojson", MISSION, "local")
    with pytest.raises(SceneError, match="b.geojson.*\n.*metres of its own"):
        scene_of(path, graph)
    free, origin = np.full((20, 20), 254), [450_000.0, 5_300_000.0, 0.0]
    surveyed = write_map(tmp_path, free, name="surveyed", origin=origin)
    place = feature(shapely.Point(450_001, 5_300_001), kind="goal")
    metric = written(tmp_path / "c.geojson", [place], "EPSG:32632")
    found = import_files([surveyed, metric])
    assert len(found.document["goals"]) == 1
    wanted = "c.geojson: coordinates of EPSG:32632 taken as metres of the map before it"
    assert wanted in found.notes
    assert scene_of(path, local, crs="local").bounds == (0.0, 0.0, 2.0, 2.0)


def test_geographic_files_do_not_fit_a_local_map(
    tmp_path: Path, write_map: Any, write_tiff: Any
) -> None:
    place = feature(shapely.Point(8.3, 47.8), kind="goal")
    features = written(tmp_path / "a.geojson", [place], "EPSG:4326")
    degrees = {"crs": "EPSG:4326", "corner": (8.3, 47.8), "cell": 1e-4}
    heights = write_tiff(tmp_path / "b.tif", np.full((20, 20), 3.0), **degrees)
    local = write_map(tmp_path, np.full((20, 20), 254))
    for path in (features, heights):
        message = f"{path.name}: 1 fault\n.*the map it goes with is in local metres"
        with pytest.raises(SceneError, match=message):
            scene_of(local, path)


def test_crop_leaves_out_what_lies_beside(tmp_path: Path) -> None:
    path = written(tmp_path / "a.geojson", MISSION, "local")
    found = import_files([path], ImportOptions(crop=(0.0, 0.0, 25.0, 30.0)))
    scene = scene_from_document(found.document, source="test")
    assert scene.bounds == (0.0, 0.0, 25.0, 30.0)
    assert [goal.id for goal in scene.goals] == ["g1"]
    assert any("pallet 7" in note for note in found.notes)
    assert scene.terrain[0].shape.equals(shapely.box(20, 5, 25, 15))


LIF: dict[str, Any] = {
    "metaInformation": {"projectIdentification": "hall", "lifVersion": "1.0.0"},
    "layouts": [
        {
            "layoutId": "ground",
            "layoutVersion": "1",
            "nodes": [
                {
                    "nodeId": name,
                    "nodePosition": {"x": x, "y": y},
                    "vehicleTypeNodeProperties": [
                        {"vehicleTypeId": "agv", "theta": 0.0, "actions": actions}
                    ],
                }
                for name, x, y, actions in [
                    ("N1", 1.0, 2.0, []),
                    ("N2", 11.0, 2.0, [{"actionType": "pick", "blockingType": "HARD"}]),
                    ("N3", 11.0, 9.0, [{"actionType": "startCharging"}]),
                    ("N4", 1.0, 9.0, []),
                ]
            ],
            "edges": [
                {"edgeId": "E1", "startNodeId": "N1", "endNodeId": "N2"},
                {"edgeId": "E2", "startNodeId": "N2", "endNodeId": "N1"},
                {"edgeId": "E3", "startNodeId": "N2", "endNodeId": "N3"},
                {"edgeId": "E4", "startNodeId": "N3", "endNodeId": "N4"},
            ],
            "stations": [
                {
                    "stationId": "S1",
                    "stationName": "Charging bay",
                    "interactionNodeIds": ["N4"],
                    "stationPosition": {"x": 0.0, "y": 9.0},
                }
            ],
        }
    ],
}


def test_lif_layout(tmp_path: Path) -> None:
    path = tmp_path / "hall.lif"
    path.write_text(json.dumps(LIF))
    scene = scene_of(path)
    assert [goal.id for goal in scene.goals] == ["N1", "N2"]
    assert [station.id for station in scene.stations] == ["N3", "N4"]
    assert scene.goals[1].region.center == pytest.approx((11.0, 2.0))
    lanes = scene_of(path, lane_width_m=2.0)
    closed = shapely.union_all([wall.shape for wall in lanes.obstacles])
    assert not closed.covers(shapely.Point(6, 2))
    assert closed.covers(shapely.Point(1, 5))  # no edge goes there


def test_lanes_of_lif_layouts_have_the_order_of_the_file(tmp_path: Path) -> None:
    """What lies beside them has the same corners in every process."""
    (ground,) = LIF["layouts"]
    path = tmp_path / "hall.lif"
    edges = [*ground["edges"], {"edgeId": "E5", "startNodeId": "N4", "endNodeId": "N1"}]
    for order in permutations([edges[0], *edges[2:]]):
        path.write_text(json.dumps({"layouts": [{**ground, "edges": order}]}))
        lanes = read_lif(path, ImportOptions()).lanes
        wanted = [{edge["startNodeId"], edge["endNodeId"]} for edge in order]
        at = {(1.0, 2.0): "N1", (11.0, 2.0): "N2", (11.0, 9.0): "N3", (1.0, 9.0): "N4"}
        assert [{at[point] for point in lane.coords} for lane in lanes] == wanted


def test_lif_layouts_may_use_an_id_again(tmp_path: Path) -> None:
    """Each layout's edges and stations are of its own nodes; a load is no charge."""
    (ground,) = LIF["layouts"]
    actions = [{"vehicleTypeId": "agv", "actions": [{"actionType": "dischargeLoad"}]}]
    nodes = [
        {"nodeId": name, "nodePosition": {"x": x, "y": 50.0}, "edges": None}
        | {"vehicleTypeNodeProperties": actions}
        for name, x in (("N1", 1.0), ("N2", 30.0))
    ]
    edges = [{"edgeId": "E9", "startNodeId": "N1", "endNodeId": "N2"}]
    upper = {"layoutId": "upper", "nodes": nodes, "edges": edges, "stations": None}
    path = tmp_path / "hall.lif"
    path.write_text(json.dumps({"layouts": [ground, upper]}))
    scene = scene_of(path, lane_width_m=2.0)
    assert [goal.id for goal in scene.goals] == ["N1", "N2", "upper_N1", "upper_N2"]
    assert len(scene.stations) == 2
    closed = shapely.union_all([wall.shape for wall in scene.obstacles])
    assert not closed.intersects(shapely.LineString([(1, 50), (30, 50)]))


def test_geometries_of_several_and_null_properties(tmp_path: Path) -> None:
    square = [[[5, 5], [8, 5], [8, 8], [5, 8], [5, 5]]]
    parts = [
        {"type": "Point", "coordinates": [1, 9]},
        {"type": "MultiPolygon", "coordinates": [square]},
        {"type": "LineString", "coordinates": [[1, 1], [4, 1]]},
    ]
    features = [
        ({"type": "MultiPoint", "coordinates": [[2, 3], [9, 3]]}, "goal"),
        ({"type": "GeometryCollection", "geometries": parts}, "obstacle"),
    ]
    nothing = dict.fromkeys(("radius", "height", "blocks", "dwell", "id"))
    path = tmp_path / "site.geojson"
    path.write_text(
        json.dumps(
            {
                "type": "FeatureCollection",
                "features": [
                    {
                        "type": "Feature",
                        "geometry": shape,
                        "properties": {"kind": kind, **nothing},
                    }
                    for shape, kind in features
                ],
            }
        )
    )
    scene = scene_of(path, crs="local")
    centers = [list(goal.region.center) for goal in scene.goals]
    assert centers == [[2.0, 3.0], [9.0, 3.0]]
    assert len(scene.obstacles) == 3
    assert max(wall.shape.area for wall in scene.obstacles) == pytest.approx(9.0)
