"""Valid files of all formats that are read, and the commands that read them."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image

from faults.commands import run_process
from mrmg import shipped
from mrmg.scene.loading.yaml_text import dump_yaml

Command = tuple[str, ...]

FIRST_RUN_S = 900.0
"""Time for a run that may compile kernels first."""


@dataclass(frozen=True, kw_only=True)
class Source:
    """A file to damage.

    Attributes:
        format: what is read.
        folder: holds the file and what belongs to it.
        name: of the file in the folder.
        commands: that read it, run in a copy of the folder.
    """

    format: str
    folder: Path
    name: str
    commands: tuple[Command, ...]


def make_corpus(folder: Path) -> list[Source]:
    """Write valid files of every format below a folder, runs included."""
    folder.mkdir(parents=True, exist_ok=True)
    return [
        *_scenes(folder / "scenes"),
        *_robots(folder / "robots"),
        *_maps(folder / "maps"),
        *_runs(folder / "runs"),
        *_others(folder / "others"),
    ]


def _sources(
    format: str, folder: Path, names: Sequence[str], *commands: str
) -> Iterator[Source]:
    """Yield a source for each name, which stands for FILE in the commands."""
    for name in names:
        yield Source(
            format=format,
            folder=folder,
            name=name,
            commands=tuple(
                tuple(name if word == "FILE" else word for word in command.split())
                for command in commands
            ),
        )


def _scenes(folder: Path) -> Iterator[Source]:
    folder.mkdir()
    for path in sorted(shipped.scenes_folder().glob("*.yaml")):
        shutil.copy(path, folder / path.name)
    (folder / "hill.yaml").write_text(_HILL)
    (folder / "curves.yaml").write_text(_CURVES)
    names = sorted(path.name for path in folder.iterdir())
    check = ("scene check FILE",) * 9
    draw = ("scene draw FILE -o a.png", "scene populate FILE -o a.yaml --goals 2")
    yield from _sources("scenes", folder, names, *check, *draw)
    small = ["hill.yaml", "curves.yaml", "quickstart.yaml"] * 4
    yield from _sources("scenes", folder, small, *check)


_HILL = """format: 1
name: hill
bounds: [0, 0, 20, 10]
elevation: {origin: [0, 0], cell: 10, heights: [[0, 1, 1], [0, 1, 1], [0, 0, 0]]}
terrain: [{id: mud, box: {center: [10, 5], size: [4, 4]}, multiplier: 1.5}]
robots: [{id: r1, model: car, pose: [3, 5, 0]}]
goals: [{id: g1, circle: {center: [16, 5], radius: 1}}]
"""

_CURVES = """format: 1
bounds: [0, 0, 40, 20]
time_limit: 300
objective: {energy: 1, makespan: 2}
obstacles:
  - {id: o1, polygon: [[20, 0], [22, 0], [22, 8], [20, 8]], height: 1.5}
  - {id: o2, circle: {center: [30, 15], radius: 1}, blocks: [r1]}
stations: [{id: s1, circle: {center: [10, 15], radius: 1.5}, capacity: 1}]
robots:
  - id: r1
    model: {like: car, mass: 190}
    pose: [3, 5, 0.1]
    start_energy: 0.9
    battery: {capacity_m: 200, reserve: 0.1, charging_power: 900}
    finish: {circle: {center: [35, 5], radius: 1.5}, heading: 0.0}
  - {id: r2, model: diffdrive, pose: [3, 10, 0]}
goals: [{id: g1, box: {center: [16, 5], size: [2, 2]}, dwell: 3}]
"""


def _robots(folder: Path) -> Iterator[Source]:
    for model in ("car", "diffdrive", "husky"):
        own = folder / model
        shutil.copytree(shipped.models_folder() / model, own / "mine")
        scene = _HILL.replace("model: car", "model: ./mine").replace("elevation", "# ")
        (own / "s.yaml").write_text(scene)
        names = ["mine/robot.yaml"]
        yield from _sources("models", own, names, "scene check s.yaml")
        names = [f"mine/{model}.xml"]
        check = ("scene check s.yaml",) * 6
        imported = "robot import FILE -o new"
        yield from _sources(
            "models", own, names, *check, "robot check mine -o a.png", imported
        )
    (folder / "a.urdf").write_text(URDF)
    (folder / "a.xacro").write_text(URDF.replace("<robot", f"<robot {_XACRO}"))
    names = ["a.urdf", "a.xacro"]
    yield from _sources("models", folder, names, "robot import FILE -o new")


_XACRO = 'xmlns:xacro="http://www.ros.org/wiki/xacro"'


def _urdf() -> str:
    wheel = """<link name="{n}"><collision><origin rpy="1.570796 0 0"/><geometry>
    <cylinder radius="0.165" length="0.1"/></geometry></collision><inertial>
    <mass value="2.5"/>
    <inertia ixx="0.02" iyy="0.04" izz="0.02" ixy="0" ixz="0" iyz="0"/>
    </inertial></link><joint name="{n}_joint" type="continuous"><parent link="base"/>
    <child link="{n}"/><origin xyz="{x} {y} 0.03"/><axis xyz="0 1 0"/>
    <limit velocity="8" effort="20"/></joint>"""
    places = {
        "fl": (0.25, 0.3),
        "fr": (0.25, -0.3),
        "rl": (-0.25, 0.3),
        "rr": (-0.25, -0.3),
    }
    wheels = [wheel.format(n=name, x=x, y=y) for name, (x, y) in places.items()]
    return f"""<robot name="r"><link name="base"><collision><origin xyz="0 0 0.1"/>
    <geometry><box size="0.9 0.5 0.2"/></geometry></collision>
    <inertial><mass value="40"/>
    <inertia ixx="0.6" iyy="1.7" izz="2.0" ixy="0" ixz="0" iyz="0"/></inertial></link>
    {"".join(wheels)}</robot>"""


URDF = _urdf()


def _maps(folder: Path) -> Iterator[Source]:
    folder.mkdir()
    _write_occupancy(folder)
    square = "[SCALE]\n1\n[BORDER]\n0 0\n200 0\n200 150\n0 150\n"
    (folder / "a.txt").write_text(f"{square}[OBSTACLE]\n20 20\n40 20\n40 45\n")
    (folder / "b.txt").write_text(
        "[SCALE]\n0.5\n[MAP_POINTS]\n1 0 0\n2 900 0\n3 900 500\n4 0 500\n5 100 100\n"
        "6 200 100\n7 200 200\n[MAP_BORDER]\n1 2 3 4\n[MAP_OBSTACLE]\n5 6 7\n"
    )
    (folder / "a.tri").write_text(
        "0 0 9 0 9 1\n0 0 0 9 1 9\n3 3 5 3 4 6\n2 2 3 3\n7 7\n"
    )
    (folder / "a.geojson").write_text(json.dumps(_features()))
    (folder / "lif.json").write_text(json.dumps(_LIF))
    (folder / "classes.yaml").write_text("10: {multiplier: 1.5}\n20: obstacle\n")
    _write_tiffs(folder)
    vector = ["a.txt", "b.txt", "a.tri", "a.geojson", "lif.json", "a.yaml"]
    into = "-o new.yaml"
    yield from _sources("maps", folder, vector, f"scene import FILE {into}")
    yield from _sources(
        "maps", folder, ["lif.json", "a.geojson"], f"scene import FILE --lanes 2 {into}"
    )
    pictures = ["a.pgm", "a.png"]
    yield from _sources(
        "maps", folder, pictures[:1], f"scene import a.yaml --keepout k.yaml {into}"
    )
    yield from _sources("maps", folder, pictures[1:], f"scene import k.yaml {into}")
    yield from _sources(
        "maps", folder, ["k.yaml"], f"scene import a.yaml --terrain-mask FILE {into}"
    )
    land = f"scene import e.tif --land-cover c.tif --classes classes.yaml {into}"
    yield from _sources("maps", folder, ["e.tif", "c.tif", "classes.yaml"], land)


def _write_occupancy(folder: Path) -> None:
    grey = np.full((20, 30), 254, dtype=np.uint8)
    grey[:, 12:14], grey[:4] = 0, 205
    stated = {
        "resolution": 0.5,
        "origin": [0.0, 0.0, 0.0],
        "negate": 0,
        "occupied_thresh": 0.65,
        "free_thresh": 0.196,
    }
    for name, picture in (("a", "a.pgm"), ("k", "a.png")):
        Image.fromarray(grey).save(folder / picture)
        (folder / f"{name}.yaml").write_text(dump_yaml({"image": picture, **stated}))


def _write_tiffs(folder: Path) -> None:
    import rasterio
    from rasterio.transform import from_origin

    heights = np.add.outer(np.arange(12.0), np.zeros(16)).astype("float32")
    classes = np.full((12, 16), 10, dtype="uint8")
    classes[3:6, 4:8] = 20
    for name, values in (("e.tif", heights), ("c.tif", classes)):
        rows, columns = values.shape
        shape = {"height": rows, "width": columns, "count": 1, "dtype": values.dtype}
        place = from_origin(0.0, float(rows), 1.0, 1.0)
        path = folder / name
        with rasterio.open(path, "w", driver="GTiff", transform=place, **shape) as file:
            file.write(values, 1)


def _features() -> dict[str, object]:
    shapes = {
        "goal": ("Point", [5.0, 5.0]),
        "obstacle": ("Polygon", [[[10, 10], [14, 10], [14, 14], [10, 10]]]),
        "terrain": ("Polygon", [[[0, 0], [5, 0], [5, 5], [0, 0]]]),
        "station": ("Point", [18.0, 3.0]),
        "lane": ("LineString", [[0, 0], [5, 5], [18, 3]]),
    }
    features = [
        {
            "type": "Feature",
            "properties": {"kind": kind, "id": kind},
            "geometry": {"type": shape, "coordinates": coordinates},
        }
        for kind, (shape, coordinates) in shapes.items()
    ]
    crs = {"type": "name", "properties": {"name": "EPSG:32632"}}
    return {"type": "FeatureCollection", "crs": crs, "features": features}


_LIF = {
    "layouts": [
        {
            "layoutId": "hall",
            "nodes": [
                {"nodeId": "a", "nodePosition": {"x": 1, "y": 2}},
                {"nodeId": "b", "nodePosition": {"x": 11, "y": 2}},
            ],
            "edges": [{"edgeId": "e1", "startNodeId": "a", "endNodeId": "b"}],
            "stations": [{"stationId": "s", "interactionNodeIds": ["b"]}],
        }
    ]
}

_RUN_JSON = [
    "run.json",
    "planning.json",
    "plan.json",
    "log.json",
    "timing.json",
    "verdict.json",
    "audit.json",
    "summary.json",
    "robustness.json",
]

_READING = (
    *("verify RUN", "audit RUN", "report RUN", "compare RUN other -o a.html"),
    *("export RUN --format csv -o new", "export RUN --format geojson -o new"),
    *("export RUN --format vda5050 -o new", "figure RUN --kind energy -o a.svg"),
    *("audit RUN", "report RUN", "figure RUN -o a.svg", "figure RUN --kind timeline"),
)


def _runs(folder: Path) -> Iterator[Source]:
    folder.mkdir()
    (folder / "site.yaml").write_text(SITE)
    for command in (
        "run site.yaml --no-video --out run",
        "robustness run --trials 2",
        "execute run --fault r1@2s --replan --out other",
        "execute run --fault r1@2s --out failed",
    ):
        made = run_process(folder, command.split(), longest_s=FIRST_RUN_S)
        if made.code not in (0, 6):
            raise RuntimeError(f"mrmg {command}: {made.err}")
    shutil.move(folder / "failed" / "capsule.zip", folder / "capsule.zip")
    shutil.rmtree(folder / "failed")
    for run in ("run", "other"):
        reading = [command.replace("RUN", run) for command in _READING]
        reading = [command.replace("run other", "other run") for command in reading]
        for name in sorted(path.name for path in (folder / run).glob("*.json")):
            yield from _sources("run folders", folder, [f"{run}/{name}"], *reading)
        yield from _sources("run folders", folder, [f"{run}/scene.yaml"], *reading)
        format_of = {"plan": "plans", "log": "logs", "driven_plan": "plans"}
        for path in sorted((folder / run).glob("*.npz")):
            kind = format_of[path.stem]
            for _ in range(3):
                yield from _sources(kind, folder, [f"{run}/{path.name}"], *reading)
    trials = (folder / "run" / "trials").rglob("*.json")
    names = [str(path.relative_to(folder)) for path in trials]
    yield from _sources("run folders", folder, names, "robustness run --trials 2")
    yield from _sources("run folders", folder, ["run/robustness.json"], "report run")
    names = ["capsule.zip"] * 4
    yield from _sources("capsules", folder, names, "replay FILE --out new")


SITE = """format: 1
name: site
objective: makespan
bounds: [0, 0, 24, 16]
stations: [{id: s1, circle: {center: [12, 13], radius: 1.5}}]
robots:
  - {id: r1, model: car, pose: [3, 4, 0]}
  - {id: r2, model: diffdrive, pose: [3, 12, 0]}
goals:
  - {id: g1, circle: {center: [18, 4], radius: 1}}
  - {id: g2, circle: {center: [18, 12], radius: 1}}
"""


_CAMPAIGN = """scenes:
  - s.yaml
  - {scene: s.yaml, name: moved, perturb: {goals: 0.5, starts: 0.3, headings: 10}}
  - {scene: s.yaml, name: short, change: {battery: {capacity_m: 300}}}
  - {scene: s.yaml, name: more, populate: {robots: 1, goals: 2, stations: 1}}
seeds: 0-3
planners: [path_following, guided_tree]
routers: [search, nrpa]
controllers: [mpc, tvlqr]
plants: [default, scrub]
disturbances: [none, default, rolling=+30%, d.yaml]
parameters:
  soc_margin: [0, 0.1]
  battery.capacity_m: [200, 300]
"""


def _others(folder: Path) -> Iterator[Source]:
    """Yield campaigns, disturbances and logs of real robots."""
    folder.mkdir()
    (folder / "s.yaml").write_text(SITE)
    (folder / "d.yaml").write_text("mass: +-5%\nlag: 0..80ms\nstart_x: 2cm\n")
    (folder / "c.yaml").write_text(_CAMPAIGN)
    (folder / "taken").write_text("")
    # The file that is in the way ends a campaign that is valid, before its trials.
    names = ["c.yaml", "c.yaml", "c.yaml", "d.yaml", "s.yaml"]
    yield from _sources("campaigns", folder, names, "campaign c.yaml --out taken")
    time_s = np.arange(0.0, 40.0, 0.2)
    left, right = 0.6 + 0.3 * np.sin(time_s), 0.6 + 0.3 * np.sin(1.3 * time_s)
    power = 40.0 + 90.0 * (left + right) + 20.0 * np.abs(left - right)
    rows = np.column_stack([time_s, left, right, power])
    lines = [",".join(f"{value:.4f}" for value in row) for row in rows]
    for name in ("a.csv", "b.csv"):
        (folder / name).write_text("\n".join(["time,velL,velR,power", *lines]) + "\n")
    fit = "calibrate husky --log a.csv b.csv --terrain mud -o new"
    yield from _sources("logs", folder, ["a.csv", "b.csv"], fit)
