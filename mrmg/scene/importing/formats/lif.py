"""Layouts of fleet managers: the Layout Interchange Format (LIF) of the VDMA.

Nodes become goals; nodes with a charging action, of their own or of a station that they
serve, become stations; edges become lanes.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import shapely
from pydantic import Field, ValidationError

from mrmg.errors import Fault, SceneError
from mrmg.scene.importing.frames import Frame
from mrmg.scene.importing.layers import ImportOptions, Layer
from mrmg.scene.importing.registry import Format, Head, read_json
from mrmg.scene.loading.faults import faults_of
from mrmg.scene.loading.shape_schema import Number, Strict

NODE_RADIUS_M = 0.5
"""Radius of goals and stations: LIF states none."""

_CHARGING = "charg"
"""What names of charging actions and stations have in them, as startCharging."""


class _Open(Strict):
    """Part of a layout, which may say more than is read."""

    model_config = {**Strict.model_config, "extra": "ignore"}


class PositionEntry(_Open):
    """Where a node is."""

    x: Number = Field(description="metres")
    y: Number = Field(description="metres")


class NodeEntry(_Open):
    """A node."""

    nodeId: Annotated[str, Field(min_length=1)]
    nodePosition: PositionEntry
    vehicleTypeNodeProperties: list[dict[str, Any]] = []


class EdgeEntry(_Open):
    """An edge."""

    edgeId: str
    startNodeId: str
    endNodeId: str


class StationEntry(Strict):
    """A station: nodes at which vehicles interact with it, and its actions."""

    model_config = {**Strict.model_config, "extra": "allow"}

    stationId: Annotated[str, Field(min_length=1)]
    interactionNodeIds: list[str] = []


class LayoutEntry(_Open):
    """One layout, a floor or an area."""

    layoutId: str = ""
    nodes: list[NodeEntry]
    edges: list[EdgeEntry] = []
    stations: list[StationEntry] = []


class LifDocument(_Open):
    """The content of a LIF file."""

    layouts: Annotated[list[LayoutEntry], Field(min_length=1)]


def read_lif(path: Path, options: ImportOptions) -> Layer:
    """Read the layouts of a LIF file; they share one frame, in metres."""
    document = read_json(path)
    try:
        layouts = LifDocument.model_validate(document).layouts
    except ValidationError as error:
        raise SceneError(str(path), faults_of(error, LifDocument)) from error
    nodes = {node.nodeId: node for layout in layouts for node in layout.nodes}
    edges = [edge for layout in layouts for edge in layout.edges]
    stations = [station for layout in layouts for station in layout.stations]
    faults = [
        Fault(f"edges.{edge.edgeId}", f"names the unknown node '{end}'")
        for edge in edges
        for end in (edge.startNodeId, edge.endNodeId)
        if end not in nodes
    ]
    faults += [
        Fault(f"stations.{station.stationId}", f"names the unknown node '{node}'")
        for station in stations
        for node in station.interactionNodeIds
        if node not in nodes
    ]
    if faults:
        raise SceneError(str(path), faults)
    charging = {name for name, node in nodes.items() if _charges(node)}
    for station in stations:
        if _charges(station):
            charging |= {*station.interactionNodeIds}
    places = {name: _place(name, node) for name, node in nodes.items()}
    ways = {frozenset((edge.startNodeId, edge.endNodeId)) for edge in edges}
    notes = [
        f"{len(layouts)} layouts: {len(nodes) - len(charging)} nodes became goals, "
        f"{len(charging)} charging ones stations, of radius {NODE_RADIUS_M} m",
        "headings, loads, and limits of vehicle types were left out",
    ]
    if edges:
        notes.append(
            f"{len(edges)} edges are lanes: robots keep to them with --lanes WIDTH, in "
            "either direction; otherwise they were left out"
        )
    return Layer(
        frame=options.frame or Frame(),
        goals=[entry for name, entry in places.items() if name not in charging],
        stations=[entry for name, entry in places.items() if name in charging],
        lanes=[
            shapely.LineString([places[end]["circle"]["center"] for end in way])
            for way in ways
            if len(way) == 2
        ],
        notes=notes,
    )


def _place(name: str, node: NodeEntry) -> dict[str, Any]:
    center = [float(node.nodePosition.x), float(node.nodePosition.y)]
    return {"id": name, "circle": {"center": center, "radius": NODE_RADIUS_M}}


def _charges(part: NodeEntry | StationEntry) -> bool:
    actions = part.vehicleTypeNodeProperties if isinstance(part, NodeEntry) else part
    return _CHARGING in str(actions).lower()


def _recognises(head: Head) -> bool:
    return head.kind == "json" and "layouts" in head.mapping


FORMAT = Format(
    kind="lif",
    title="VDMA LIF layout (JSON)",
    recognises=_recognises,
    read=read_lif,
)
