"""The verbs that check, draw, import and populate scenes."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

from mrmg import storage
from mrmg.errors import ExitCode, UsageError


def check(options: argparse.Namespace) -> int:
    """Load a scene; every fault of it is in the error that loading raises."""
    from mrmg.scene.loading import load_scene

    scene = load_scene(options.scene, trust_code=options.trust_code)
    print(
        f"{scene.name}: valid; {len(scene.robots)} robots, {len(scene.goals)} goals, "
        f"{len(scene.stations)} stations, {len(scene.obstacles)} obstacles, "
        f"{len(scene.terrain)} terrain areas"
    )
    return ExitCode.OK


def draw(options: argparse.Namespace) -> int:
    """Draw a scene into a picture."""
    from mrmg.results.scene_drawing import draw_scene
    from mrmg.scene.loading import load_scene

    scene = load_scene(options.scene, trust_code=options.trust_code)
    picture = options.out or Path(f"{scene.name}.png")
    draw_scene(scene, picture)
    print(picture)
    return ExitCode.OK


def roadmap(options: argparse.Namespace) -> int:
    """Write a scene's roadmap as GraphML, for analysis with other tools."""
    import networkx as nx

    from mrmg import seeding
    from mrmg.planning import PlannerParams
    from mrmg.planning.roadmap.roadmap import build_roadmap
    from mrmg.scene.loading import load_scene
    from mrmg.world.world import World

    scene = load_scene(options.scene, trust_code=options.trust_code)
    if not scene.robots:
        raise UsageError(f"{scene.name} has no robots, whose width decides the roadmap")
    params = PlannerParams()
    graph = build_roadmap(
        scene,
        World.from_scene(scene),
        samples=params.samples,
        neighbours=params.neighbours,
        margin_m=params.obstacle_margin_m,
        rng=seeding.stream(options.seed, "roadmap", 0),
    ).graph()
    out = options.out or Path(f"{scene.name}.graphml")
    with storage.atomic_path(out) as temporary:
        nx.write_graphml(graph, temporary)
    parts = nx.number_connected_components(graph.to_undirected(as_view=True))
    print(
        f"{out}: {graph.number_of_nodes()} vertices, {graph.number_of_edges()} edges, "
        f"{parts} connected parts"
    )
    return ExitCode.OK


def schema(options: argparse.Namespace) -> int:
    """Print the JSON Schema of scene files or of robot models."""
    from mrmg.scene.loading import robot_schema, scene_schema

    found = robot_schema() if options.robot else scene_schema()
    print(json.dumps(found, indent=2))
    return ExitCode.OK


def import_(options: argparse.Namespace) -> int:
    """Read a map drawn elsewhere into a scene without robots and goals."""
    from mrmg.authoring import import_map

    _require_absent(options)
    document = import_map(options.map, longest_side_m=options.longest_side)
    _write(document, options.out)
    return ExitCode.OK


def populate(options: argparse.Namespace) -> int:
    """Place robots, goals and stations in a scene."""
    from mrmg.authoring import populate as populated
    from mrmg.scene.loading import load_scene

    _require_absent(options)
    document = populated(
        load_scene(options.scene, trust_code=options.trust_code).document,
        robots=options.robots,
        goals=options.goals,
        stations=options.stations,
        seed=options.seed,
    )
    _write(document, options.out)
    return ExitCode.OK


def _require_absent(options: argparse.Namespace) -> None:
    from mrmg.replacing import require_absent

    if options.out is not None:  # a scene may have been edited by hand
        require_absent(options.out, overwrite=options.overwrite)


def _write(document: dict[str, Any], out: Path | None) -> None:
    from mrmg.scene.loading import dump_scene, scene_from_document

    text = dump_scene(scene_from_document(document, source=document["name"]))
    if out is None:
        sys.stdout.write(text)
    else:
        storage.write_text(out, text)
        print(out)
