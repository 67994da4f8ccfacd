"""Layouts of fleet managers: the Layout Interchange Format (LIF) of the VDMA.

Nodes become goals; nodes with a charging action, of their own or of a station that they
serve, become stations; edges become lanes.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import shapely
from pydantic import Field

from mrmg.counted import counted
from mrmg.errors import Fault, SceneError
from mrmg.scene.importing.charging import charges
from mrmg.scene.importing.layers import ImportOptions, Layer, lanes_note
from mrmg.scene.importing.registry import Format, Head, read_json
from mrmg.scene.loading.faults import validated
from mrmg.scene.loading.shape_schema import Number, Strict

NODE_RADIUS_M = 0.5
"""Radius of goals and stations: LIF states none."""


class _Open(Strict):
    """Part of a layout, which may say more than is read."""

    model_config = {**Strict.model_config, "extra": "ignore"}


class PositionEntry(_Open):
    """Where a node is."""

    x: Number
    """metres"""
    y: Number
    """metres"""


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

    @property
    def ends(self) -> list[str]:
        """Ids of its nodes."""
        return [self.startNodeId, self.endNodeId]


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
    layouts = validated(LifDocument, read_json(path), str(path)).layouts
    charging: set[str] = set()
    pairs: dict[tuple[str, ...], None] = {}  # in the order of the file
    nodes, keys, faults = _nodes_of(layouts)
    everywhere = {node.nodeId: key for key, node in reversed(nodes.items())}
    for layout, own in zip(layouts, keys, strict=True):
        key_of = everywhere | own
        named = [(f"edges.{edge.edgeId}", edge.ends) for edge in layout.edges]
        for station in layout.stations:
            named.append((f"stations.{station.stationId}", station.interactionNodeIds))
        faults += [
            Fault(place, f"names the unknown node '{name}'")
            for place, names in named
            for name in names
            if name not in key_of
        ]
        if faults:
            continue
        for edge in layout.edges:
            pairs[tuple(sorted(key_of[name] for name in edge.ends))] = None
        for station in layout.stations:
            if charges(dict(station)):
                charging |= {key_of[name] for name in station.interactionNodeIds}
    if faults:
        raise SceneError(str(path), faults)
    charging |= {
        key for key, node in nodes.items() if charges(node.vehicleTypeNodeProperties)
    }
    places = {name: _place(name, node) for name, node in nodes.items()}
    notes = [
        f"{counted(len(layouts), 'layout')}: radius {NODE_RADIUS_M} m for stations at "
        f"charging nodes ({len(charging)}), goals at {len(nodes) - len(charging)} more",
        "headings, loads, and limits of vehicle types were left out",
    ]
    if pairs:
        notes.append(lanes_note(len(pairs)))
    return Layer(
        goals=[entry for name, entry in places.items() if name not in charging],
        stations=[entry for name, entry in places.items() if name in charging],
        lanes=[
            shapely.LineString([places[end]["circle"]["center"] for end in pair])
            for pair in pairs
            if pair[0] != pair[1]
        ],
        notes=notes,
    )


def _place(name: str, node: NodeEntry) -> dict[str, Any]:
    center = [float(node.nodePosition.x), float(node.nodePosition.y)]
    return {"id": name, "circle": {"center": center, "radius": NODE_RADIUS_M}}


def _nodes_of(
    layouts: Sequence[LayoutEntry],
) -> tuple[dict[str, NodeEntry], list[dict[str, str]], list[Fault]]:
    """Return nodes by keys of their own, the keys by ids for each layout, and faults.

    Another layout may use an id again; one that does so itself has a fault.
    """
    nodes: dict[str, NodeEntry] = {}
    keys: list[dict[str, str]] = []
    faults: dict[str, Fault] = {}
    for layout in layouts:
        known = set(nodes)
        keys.append({})
        for node in layout.nodes:
            name = node.nodeId
            key = f"{layout.layoutId}_{name}" if name in known else name
            if key in nodes:
                message = (
                    f"is given more than once in layout '{layout.layoutId}'; the ids "
                    "of its nodes must differ"
                )
                faults[key] = Fault(f"nodes.{name}", message)
            keys[-1][name] = key
            nodes[key] = node
    return nodes, keys, list(faults.values())


def _recognises(head: Head) -> bool:
    return head.kind == "json" and "layouts" in head.mapping


FORMAT = Format(
    kind="lif",
    title="VDMA LIF layout (JSON)",
    recognises=_recognises,
    read=read_lif,
)
