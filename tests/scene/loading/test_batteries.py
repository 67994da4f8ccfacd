"""Batteries whose stations could never fill them."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from mrmg.errors import SceneError
from mrmg.scene.loading import load_scene
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

    assert load_scene(written(8.1)).robots[0].battery.charging_power_W == 8.1
    where = r"robots\.0\.battery" if own else "battery"
    place = r" \(r\), line 3" if own else ", line 4"
    with pytest.raises(
        SceneError, match=rf"{where}\.charging_power{place}: got 8 W; r itself"
    ):
        load_scene(written(8.0))
