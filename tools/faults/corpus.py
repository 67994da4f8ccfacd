"""Valid files of all formats that are read, and the commands that read them."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from faults.runs import SITE, make_runs, run_command
from faults.sources import Source, sources_of
from faults.valid_maps import map_sources
from mrmg import shipped


def make_corpus(folder: Path) -> list[Source]:
    """Write valid files of every format below a folder, runs included."""
    folder.mkdir(parents=True, exist_ok=True)
    return [
        *_scenes(folder / "scenes"),
        *_robots(folder / "robots"),
        *map_sources(folder / "maps"),
        *_runs(folder / "runs"),
        *_others(folder / "others"),
    ]


def _scenes(folder: Path) -> Iterator[Source]:
    folder.mkdir()
    for path in sorted(shipped.scenes_folder().glob("*.yaml")):
        shutil.copy(path, folder / path.name)
    (folder / "hill.yaml").write_text(_HILL)
    (folder / "curves.yaml").write_text(_CURVES)
    names = sorted(path.name for path in folder.iterdir())
    check = ("scene check FILE",) * 9
    draw = ("scene draw FILE -o a.png", "scene populate FILE -o a.yaml --goals 2")
    yield from sources_of("scenes", folder, names, *check, *draw)
    small = ["hill.yaml", "curves.yaml", "quickstart.yaml"] * 4
    yield from sources_of("scenes", folder, small, *check)


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
        yield from sources_of("models", own, names, "scene check s.yaml")
        names = [f"mine/{model}.xml"]
        check = ("scene check s.yaml",) * 6
        imported = "robot import FILE -o new"
        yield from sources_of(
            "models", own, names, *check, "robot check mine -o a.png", imported
        )
    (folder / "a.urdf").write_text(URDF)
    (folder / "a.xacro").write_text(XACRO)
    names = ["a.urdf", "a.xacro"]
    yield from sources_of("models", folder, names, "robot import FILE -o new")


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

XACRO = URDF.replace("<robot", '<robot xmlns:xacro="http://www.ros.org/wiki/xacro"')


_READING = (
    *("verify RUN", "audit RUN", "report RUN", "compare RUN other -o a.html"),
    *("export RUN --format csv -o new", "export RUN --format geojson -o new"),
    *("export RUN --format vda5050 -o new", "figure RUN --kind energy -o a.svg"),
    *("audit RUN", "report RUN", "figure RUN -o a.svg", "figure RUN --kind timeline"),
)


def _runs(folder: Path) -> Iterator[Source]:
    make_runs(folder)
    run_command(folder, "execute run --fault r1@2s --out failed")
    shutil.move(folder / "failed" / "capsule.zip", folder / "capsule.zip")
    shutil.rmtree(folder / "failed")
    for run in ("run", "other"):
        reading = [command.replace("RUN", run) for command in _READING]
        reading = [command.replace("run other", "other run") for command in reading]
        for name in sorted(path.name for path in (folder / run).glob("*.json")):
            yield from sources_of("run folders", folder, [f"{run}/{name}"], *reading)
        yield from sources_of("run folders", folder, [f"{run}/scene.yaml"], *reading)
        format_of = {"plan": "plans", "log": "logs", "driven_plan": "plans"}
        for path in sorted((folder / run).glob("*.npz")):
            kind = format_of[path.stem]
            for _ in range(3):
                yield from sources_of(kind, folder, [f"{run}/{path.name}"], *reading)
    trials = (folder / "run" / "trials").rglob("*.json")
    names = [str(path.relative_to(folder)) for path in trials]
    yield from sources_of("run folders", folder, names, "robustness run --trials 2")
    yield from sources_of("run folders", folder, ["run/robustness.json"], "report run")
    names = ["capsule.zip"] * 4
    yield from sources_of("capsules", folder, names, "replay FILE --out new")


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
    yield from sources_of("campaigns", folder, names, "campaign c.yaml --out taken")
    time_s = np.arange(0.0, 40.0, 0.2)
    left, right = 0.6 + 0.3 * np.sin(time_s), 0.6 + 0.3 * np.sin(1.3 * time_s)
    power = 40.0 + 90.0 * (left + right) + 20.0 * np.abs(left - right)
    rows = np.column_stack([time_s, left, right, power])
    lines = [",".join(f"{value:.4f}" for value in row) for row in rows]
    for name in ("a.csv", "b.csv"):
        (folder / name).write_text("\n".join(["time,velL,velR,power", *lines]) + "\n")
    fit = "calibrate husky --log a.csv b.csv --terrain mud -o new"
    yield from sources_of("logs", folder, ["a.csv", "b.csv"], fit)
