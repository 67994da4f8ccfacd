"""Batteries whose stations could not fill them within a day."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from mrmg.errors import SceneError
from mrmg.scene.loading import load_scene, scene_from_document
from mrmg.shipped import models_folder


@pytest.mark.parametrize("own", [False, True])
def test_a_station_must_give_more_than_the_robot_draws(
    tmp_path: Path, own: bool
) -> None:
    shutil.copytree(models_folder() / "car", tmp_path / "thirsty")
    model = tmp_path / "thirsty" / "robot.yaml"
    model.write_text(model.read_text().replace("idle_power: 0.0", "idle_power: 8.0"))
    scene = tmp_path / "scene.yaml"

    def written(power_W: float) -> Path:
        battery = f"battery: {{charging_power: {power_W}}}"
        robot = (
            f"id: r, model: ./thirsty, pose: [5, 5, 0]{', ' + battery if own else ''}"
        )
        scene.write_text(
            f"format: 1\nbounds: [0, 0, 20, 10]\nrobots: [{{{robot}}}]\n"
            + ("" if own else battery)
        )
        return scene

    assert load_scene(written(8.5)).robots[0].battery.charging_power_W == 8.5
    where = r"robots\.0\.battery" if own else "battery"
    place = r" \(r\), line 3" if own else ", line 4"
    for given in ("8 W", "8.3 W", "0.001 W"):
        message = rf"{where}\.charging_power{place}: got {given}; r itself draws 8 W"
        with pytest.raises(SceneError, match=rf"{message}.* give at least 8\.\d+ W"):
            load_scene(written(float(given.split()[0])))


@pytest.mark.parametrize("robots", [0, 1, 2])
def test_two_capacities_of_the_fleet_are_one_fault(robots: int) -> None:
    document = {
        "format": 1,
        "name": "field",
        "bounds": [0, 0, 20, 20],
        "battery": {"capacity_J": 1, "capacity_Wh": 1},
        "robots": [
            {"id": f"r{k}", "model": "car", "pose": [5, 5 + 9 * k, 0]}
            for k in range(robots)
        ],
    }
    with pytest.raises(SceneError) as caught:
        scene_from_document(document, source="test")
    (fault,) = caught.value.faults
    assert fault.path == "battery"
    assert fault.message.startswith("has capacity_J and capacity_Wh; expected at most")
