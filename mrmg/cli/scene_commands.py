"""The verbs that make, check, draw, import and populate scenes."""

from __future__ import annotations

import argparse
import json
import math
import os
import shlex
import sys
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mrmg import storage
from mrmg.cli import terminal
from mrmg.counted import counted
from mrmg.errors import Fault, FileError, UsageError

if TYPE_CHECKING:
    from mrmg.scene.types import Scene


def new(options: argparse.Namespace) -> None:
    """Write a commented scene to begin with."""
    from mrmg.scene.new_scene import new_scene

    given = options.name.removesuffix(".yaml")
    if Path(given).name in ("", "..") or not given.isprintable():
        raise UsageError(f"NAME: got '{options.name}'; expected a name such as farm")
    out = options.out or Path(f"{given}.yaml")
    if os.path.lexists(out):
        raise UsageError(f"{out} is there already; give another name, or -o FILE")
    storage.write_text(out, new_scene(Path(given).name))
    print(f"{out}\nnext:")
    for verb in ("scene check", "scene draw", "run"):
        print(f"  mrmg {verb} {shlex.quote(str(out))}")


def list_(options: argparse.Namespace) -> None:
    """List the shipped scenes with their figures and what they are for."""
    from mrmg import shipped
    from mrmg.scene.loading.yaml_text import parse_yaml

    print(f"{'scene':<12}{'robots':>7}{'goals':>7}{'stations':>10}{'size [m]':>12}")
    for name in shipped.scene_names():
        text = (shipped.scenes_folder() / f"{name}.yaml").read_text(encoding="utf-8")
        scene = parse_yaml(text, source=name)
        x_min, y_min, x_max, y_max = scene["bounds"]
        counts = [len(scene.get(key, [])) for key in ("robots", "goals", "stations")]
        why = text.splitlines()[0].removeprefix("# Why: ")
        print(
            "{:<12}{:>7}{:>7}{:>10}".format(name, *counts)
            + f"{f'{x_max - x_min:g} x {y_max - y_min:g}':>12}  {why}"
        )


def check(options: argparse.Namespace) -> None:
    """Report what `mrmg run` would refuse of a scene, and what it warns of."""
    from mrmg.planning.feasibility import mission_warnings
    from mrmg.planning.problem.little_room import little_room
    from mrmg.planning.roadmap.fleet import margins_of
    from mrmg.runs.pipeline import rehearse
    from mrmg.scene.loading import load_scene
    from mrmg.scene.loading.hints import heading_hints
    from mrmg.scene.margins import STATES_NONE, sentences_on_margins
    from mrmg.scene.slopes import bend_warnings

    warnings = heading_hints(options.scene)
    try:
        scene = load_scene(options.scene, trust_code=options.trust_code)
        notes = [Fault("", message) for message in rehearse(scene)]
    except FileError as error:
        if options.json:
            terminal.print_json(_findings(error.faults, warnings, []))
        else:
            terminal.print_warnings(warnings)
        raise
    warnings += bend_warnings(scene)
    found = mission_warnings(scene) or little_room(scene, STATES_NONE)
    warnings += [Fault("", message) for message in found]
    counts = {
        "robot": len(scene.robots),
        "goal": len(scene.goals),
        "station": len(scene.stations),
        "obstacle": len(scene.obstacles),
        "terrain area": len(scene.terrain),
    }
    held = ", ".join(counted(n, name) for name, n in counts.items())
    kept = {robot.id: margins_of(robot, STATES_NONE) for robot in scene.robots}
    lines = [
        f"{scene.name}: valid; {held}",
        *(f"  warning: {warning}" for warning in warnings),
        *(f"  margins: {text}" for text in sentences_on_margins(scene.robots, kept)),
        *(f"  note: {note}" for note in notes),
    ]
    terminal.print_result(options, _findings([], warnings, notes), lines)


def _findings(*lists: Sequence[Fault]) -> dict[str, list[dict[str, Any]]]:
    named = zip(("faults", "warnings", "notes"), lists, strict=True)
    return {name: [asdict(item) for item in items] for name, items in named}


def draw(options: argparse.Namespace) -> None:
    """Draw a scene into a picture."""
    from mrmg.scene.loading import load_scene
    from mrmg.viz.figures import require_format
    from mrmg.viz.overview import draw_overview

    scene = load_scene(options.scene, trust_code=options.trust_code)
    picture = options.out or Path(f"{scene.name}.png")
    require_format(picture)
    draw_overview(scene, path=picture)
    print(picture)


def roadmap(options: argparse.Namespace) -> None:
    """Write a scene's roadmap as GraphML, for analysis with other tools."""
    import networkx as nx

    from mrmg.planning import PlannerParams
    from mrmg.planning.frame import Frame
    from mrmg.planning.problem.problem import state_mission
    from mrmg.scene.loading import load_scene

    scene = load_scene(options.scene, trust_code=options.trust_code)
    if not scene.robots:
        raise UsageError(f"{scene.name} has no robots, whose width decides the roadmap")
    frame = Frame.of(scene)
    planned = state_mission(frame.scene(scene), options.seed, PlannerParams()).roadmap
    graph = planned.graph()
    for _, place in graph.nodes(data=True):
        place["x_m"], place["y_m"] = frame.on_the_map((place["x_m"], place["y_m"]))
        if "z_m" in place:
            place["z_m"] *= frame.unit_m
    for _, _, edge in graph.edges(data=True):
        edge["weight"] *= frame.unit_m
    out = options.out or Path(f"{scene.name}.graphml")
    with storage.atomic_path(out) as temporary:
        nx.write_graphml(graph, temporary)
    parts = nx.number_connected_components(graph.to_undirected(as_view=True))
    print(
        f"{out}: {counted(graph.number_of_nodes(), 'vertex', 'vertices')}, "
        f"{counted(graph.number_of_edges(), 'edge')}, "
        f"{counted(parts, 'connected part')}"
    )


def schema(options: argparse.Namespace) -> None:
    """Print the JSON Schema of scenes, robot models, campaigns or summaries."""
    from mrmg.runs.summary_model import summary_schema
    from mrmg.scene.loading.json_schema import robot_schema, scene_schema
    from mrmg.studies.campaigns.schema import campaign_schema

    made = {
        "scene": scene_schema,
        "robot": robot_schema,
        "campaign": campaign_schema,
        "summary": summary_schema,
    }
    print(json.dumps(made[options.kind](), indent=2))


def import_(options: argparse.Namespace) -> None:
    """Read maps, layouts and features of other tools as a scene."""
    from mrmg.scene.importing.importing import import_files
    from mrmg.scene.importing.layers import ImportOptions
    from mrmg.scene.loading import scene_from_document

    _require_absent(options)
    found = import_files(
        options.files,
        ImportOptions(
            unknown=options.unknown,
            tolerance=options.tolerance,
            crs=options.crs,
            crop=options.crop and _box(options.crop),
            longest_side_m=options.longest_side,
            classes=options.classes,
            lane_width_m=options.lanes,
        ),
        kind=options.kind,
        keepout=options.keepout,
        terrain_mask=options.terrain_mask,
        land_cover=options.land_cover,
    )
    source = ", ".join(str(file) for file in options.files)
    scene = scene_from_document(found.document, source=source)
    _write(scene, options.out, found.notes)


def _box(words: Sequence[str]) -> tuple[float, float, float, float]:
    try:
        numbers = [float(word) for word in ",".join(words).split(",")]
        x_min, y_min, x_max, y_max = numbers
    except ValueError:
        x_min = x_max = y_min = y_max = 0.0
    is_finite = all(map(math.isfinite, (x_min, y_min, x_max, y_max)))
    if not (is_finite and x_min < x_max and y_min < y_max):
        message = f"--crop: got '{' '.join(words)}'; expected X_MIN Y_MIN X_MAX Y_MAX"
        raise UsageError(message)
    return x_min, y_min, x_max, y_max


def populate(options: argparse.Namespace) -> None:
    """Place robots, goals and stations in a scene."""
    from mrmg.scene.loading import load_scene
    from mrmg.scene.populating.populate import populate as populated

    _require_absent(options)
    scene = populated(
        load_scene(options.scene, trust_code=options.trust_code),
        robots=options.robots,
        goals=options.goals,
        stations=options.stations,
        seed=options.seed,
        model=options.model,
        trust_code=options.trust_code,
    )
    _write(scene, options.out)


def _require_absent(options: argparse.Namespace) -> None:
    from mrmg.runs.replacing import require_absent

    if options.out is not None:  # a scene may have been edited by hand
        require_absent(options.out, overwrite=options.overwrite)


def _write(scene: Scene, out: Path | None, notes: Sequence[str] = ()) -> None:
    from mrmg.scene.loading import dump_scene

    text = "".join(f"# {note}\n" for note in notes) + dump_scene(scene)
    for note in notes:
        print(f"mrmg: {note}", file=sys.stderr)
    if out is None:
        sys.stdout.buffer.write(text.encode())  # as it would be in a file
    else:
        storage.write_text(out, text)
        print(out)
