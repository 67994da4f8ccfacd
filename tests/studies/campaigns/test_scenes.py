"""Scenes of trials: the same on every machine, valid, and no farther off than asked."""

from __future__ import annotations

import math
import shutil
from pathlib import Path

import numpy as np
import pytest
from shapely.affinity import translate

from mrmg import shipped
from mrmg.errors import FileError
from mrmg.scene.loading import load_scene
from mrmg.studies.campaigns.reading import read_campaign
from mrmg.studies.campaigns.scenes import perturbed

REACH = {"goals": 1.5, "stations": 1.0, "starts": 0.8, "headings": 20.0}


@pytest.mark.parametrize("seed", range(3))
def test_perturbed_scenes_stay_within_reach(seed: int) -> None:
    scene = load_scene("scene1")
    found = perturbed(scene, {**REACH, "obstacles": 0.5}, seed)
    assert found == perturbed(scene, {**REACH, "obstacles": 0.5}, seed)
    assert found.digest != scene.digest
    moved_m = []
    for name in ("goals", "stations"):
        pairs = zip(getattr(scene, name), getattr(found, name), strict=True)
        for before, after in pairs:
            moved_m.append(math.dist(before.region.center, after.region.center))
            assert moved_m[-1] <= REACH[name] + 1e-9
    assert np.mean(moved_m) > 0.3
    for robot, again in zip(scene.robots, found.robots, strict=True):
        assert math.dist(robot.pose[:2], again.pose[:2]) <= REACH["starts"] + 1e-9
        assert abs(robot.pose[2] - again.pose[2]) <= math.radians(20.0) + 1e-9
    for wall, again in zip(scene.obstacles, found.obstacles, strict=True):
        by = np.subtract(again.shape.centroid.coords[0], wall.shape.centroid.coords[0])
        assert np.hypot(*by) <= 0.5 + 1e-9
        same = translate(wall.shape, *by).symmetric_difference(again.shape)
        assert same.area < 1e-6


def test_scenes_carry_their_models_to_other_machines(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copytree(shipped.models_folder() / "car", tmp_path / "mine")
    file = tmp_path / "sweep.yaml"
    file.write_text(
        "scenes: {scene: quickstart, populate: {goals: 3, model: ./mine}}\nseeds: 0-1\n"
    )
    trials = read_campaign(file).trials
    here = [each.source.scene(each.order.arguments.seed, {}) for each in trials]
    shutil.rmtree(tmp_path / "mine")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "elsewhere"))
    there = [each.source.scene(each.order.arguments.seed, {}) for each in trials]
    assert [scene.digest for scene in there] == [scene.digest for scene in here]
    assert here[0].digest != here[1].digest


def test_code_of_robots_runs_only_when_it_is_trusted(tmp_path: Path) -> None:
    model = tmp_path / "mine"
    shutil.copytree(shipped.models_folder() / "car", model)
    text = (model / "robot.yaml").read_text()
    kind = next(line for line in text.splitlines() if line.startswith("motion_model"))
    (model / "robot.yaml").write_text(text.replace(kind, "motion_model: own.py"))
    ran = tmp_path / "ran"
    (model / "own.py").write_text(f"open({str(ran)!r}, 'w').close()\n")
    file = tmp_path / "sweep.yaml"
    file.write_text("scenes: {scene: quickstart, populate: {model: ./mine}}\n")
    with pytest.raises(FileError, match="--trust-code"):
        read_campaign(file)
    assert not ran.exists()
