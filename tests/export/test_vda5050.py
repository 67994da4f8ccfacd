"""Orders and states against the official schemas, and against plan and drive."""

from __future__ import annotations

import json
import re
import shutil
from itertools import pairwise
from pathlib import Path

import jsonschema
import numpy as np
import pytest

from mrmg.errors import UsageError
from mrmg.export.exporting import export_run
from mrmg.plans import Plan
from mrmg.scene.loading import load_scene
from mrmg.simulation.log import ExecutionLog

SCHEMAS = Path(__file__).parents[3] / "shared/vda5050"
FILES = ("order.json", "states.jsonl")
VERSIONS = ("2.1.0", "3.0.0")


def schema(kind: str, version: str) -> jsonschema.Draft202012Validator:
    """Return the schema of a message; that of orders 3.0.0 has a comma too many."""
    path = SCHEMAS / f"{kind}-{version}.schema"
    if not path.exists():
        pytest.skip(f"{path} is not there")
    text = re.sub(r",(\s*[}\]])", r"\1", path.read_text())
    checker = jsonschema.FormatChecker()
    return jsonschema.Draft202012Validator(json.loads(text), format_checker=checker)


def states_of(folder: Path) -> list[dict]:
    return [json.loads(line) for line in (folder / "states.jsonl").open()]


@pytest.fixture(scope="module")
def exported(quickstart_run: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("export")
    export_run(quickstart_run, "vda5050", out=folder)
    return folder / "vda5050"


@pytest.mark.parametrize("version", VERSIONS)
def test_messages_follow_the_official_schema(exported: Path, version: str) -> None:
    orders = sorted((exported / version).glob("*/order.json"))
    assert [path.parent.name for path in orders] == ["r1", "r2"]
    for path in orders:
        order = json.loads(path.read_text())
        assert [*schema("order", version).iter_errors(order)] == []
        assert order["version"] == version
        states = states_of(path.parent)
        assert len(states) > 10
        validator = schema("state", version)
        assert [
            error for state in states for error in validator.iter_errors(state)
        ] == []


@pytest.mark.parametrize("version", VERSIONS)
def test_nodes_and_edges_alternate_and_join(exported: Path, version: str) -> None:
    for path in (exported / version).glob("*/order.json"):
        order = json.loads(path.read_text())
        nodes, edges = order["nodes"], order["edges"]
        assert [node["sequenceId"] for node in nodes] == [*range(0, 2 * len(nodes), 2)]
        assert [edge["sequenceId"] for edge in edges] == [*range(1, 2 * len(edges), 2)]
        for edge, (start, end) in zip(edges, pairwise(nodes), strict=True):
            points = edge["trajectory"]["controlPoints"]
            knots = edge["trajectory"]["knotVector"]
            assert len(knots) == len(points) + edge["trajectory"]["degree"] + 1
            assert knots == sorted(knots)
            for node, point in ((start, points[0]), (end, points[-1])):
                at = node["nodePosition"]
                assert (point["x"], point["y"]) == (at["x"], at["y"])


def test_every_tour_is_ordered_with_its_actions(
    exported: Path, quickstart_run: Path
) -> None:
    scene, plan = load_scene(quickstart_run / "scene.yaml"), Plan.load(quickstart_run)
    kinds = {"visit": "goal", "startCharging": "station"}
    regions = {target.id: target.region for target in scene.targets()}
    for robot, tour in plan.tours.items():
        order = json.loads((exported / f"2.1.0/{robot}/order.json").read_text())
        visits = []
        for node in order["nodes"]:
            at = node["nodePosition"]
            for action in node["actions"]:
                key, target = action["actionParameters"][0].values()
                if action["actionType"] in kinds:
                    assert key == f"{kinds[action['actionType']]}Id"
                    visits.append(target)
                    depth_m = regions[target].depth(np.array([at["x"], at["y"]]))
                    assert depth_m[0] >= at["allowedDeviationXY"] - 1e-3
        assert visits == [*tour]


def test_states_follow_the_drive(exported: Path, quickstart_run: Path) -> None:
    log = ExecutionLog.load(quickstart_run)
    for index, robot in enumerate(log.robots):
        folder = exported / "3.0.0" / robot
        order = json.loads((folder / "order.json").read_text())
        states = states_of(folder)
        for state in states:
            minutes, seconds = state["timestamp"][14:-1].split(":")
            tick = round((60 * int(minutes) + float(seconds)) / log.control_period_s)
            at = state["mobileRobotPosition"]
            driven = log.state[index, tick]
            assert (at["x"], at["y"]) == pytest.approx(driven[:2], abs=1e-4)
            assert np.cos(at["theta"] - driven[2]) == pytest.approx(1.0)
            remaining = [node["sequenceId"] for node in state["nodeStates"]]
            ahead = [node["sequenceId"] for node in order["nodes"]]
            assert remaining == [
                number for number in ahead if number > state["lastNodeSequenceId"]
            ]
        first, last = states[0], states[-1]
        assert first["lastNodeSequenceId"] == 0
        assert last["nodeStates"] == last["edgeStates"] == []
        assert {each["actionStatus"] for each in last["actionStates"]} <= {"FINISHED"}
        assert not last["driving"]


def test_one_version_can_be_asked_for(quickstart_run: Path, tmp_path: Path) -> None:
    files = export_run(quickstart_run, "vda5050", out=tmp_path, version="2.1.0")
    assert {path.relative_to(tmp_path).parts[1] for path in files} == {"2.1.0"}


def test_robots_of_another_mission_do_not_stay(
    quickstart_run: Path, tmp_path: Path
) -> None:
    """Nothing but files of an export is removed, and only if asked."""
    export_run(quickstart_run, "vda5050", out=tmp_path)
    folder = tmp_path / "vda5050" / "2.1.0"
    for name in ("r8", "r9"):
        shutil.copytree(folder / "r1", folder / name)
    (folder / "r9" / "notes.txt").write_text("mine")
    (folder / "r7").mkdir()
    (folder / "r7" / "order.json").write_text('{"manufacturer": "another"}')
    for name in ("r1", "r2"):
        shutil.rmtree(folder / name)
    with pytest.raises(UsageError, match=r"r8/order.json exists; --overwrite"):
        export_run(quickstart_run, "vda5050", out=tmp_path, version="2.1.0")
    export_run(quickstart_run, "vda5050", out=tmp_path, version="2.1.0", overwrite=True)
    found = {str(path.relative_to(folder)) for path in folder.rglob("*.*")}
    written = {f"{name}/{file}" for name in ("r1", "r2") for file in FILES}
    assert found == {*written, "r7/order.json", "r9/notes.txt"}
    assert not (folder / "r8").exists()
    assert (tmp_path / "vda5050" / "3.0.0" / "r1").exists()
