"""The overview: planned and driven paths, visits in their order, contacts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from PIL import Image

from mrmg.plans import Plan
from mrmg.scene.types import Scene
from mrmg.simulation.log import Contact, ExecutionLog
from mrmg.viz import overview, scene_drawing

Maker = Callable[..., Scene]


def mission(make_scene: Maker, make_plan: Callable[..., Plan], straight) -> tuple:
    scene = make_scene(
        stations=[{"id": "s", "circle": {"center": [10, 10], "radius": 1}}]
    )
    plan = make_plan(scene, {"r1": straight(12.0)}, {"r1": ("s", "g")})
    return scene, plan


def test_paths_are_the_plan_s_and_the_log_s(
    make_scene, make_plan, make_log, straight
) -> None:
    scene, plan = mission(make_scene, make_plan, straight)
    log: ExecutionLog = make_log(scene, plan)
    _, axes = scene_drawing.new_map_figure(scene)
    overview.draw_mission(axes, scene, plan, log)
    drawn = [line.get_xydata() for line in axes.lines]
    for states in (plan.trajectories[0].state, log.state[0]):
        assert any(np.array_equal(data, states[:, :2]) for data in drawn)


def test_targets_show_their_rank_in_the_tour(make_scene, make_plan, straight) -> None:
    scene, plan = mission(make_scene, make_plan, straight)
    assert overview.visit_ranks(plan) == {"s": [("r1", 1)], "g": [("r1", 2)]}
    _, axes = scene_drawing.new_map_figure(scene)
    overview.draw_mission(axes, scene, plan, None)
    texts = [text.get_text() for text in axes.texts]
    assert {"1", "2", "g", "⚡s", "r1"} <= set(texts)


def test_contacts_are_marked_where_they_happened(
    make_scene, make_plan, make_log, straight
) -> None:
    scene, plan = mission(make_scene, make_plan, straight)
    contact = Contact(time_s=3.0, robot="r1", other="wall", x_m=12.5, y_m=7.25)
    log = replace(make_log(scene, plan), contacts=(contact,))
    _, axes = scene_drawing.new_map_figure(scene)
    handles = overview.draw_mission(axes, scene, plan, log)
    assert "contact" in [handle.get_label() for handle in handles]
    spots = [line.get_xydata() for line in axes.lines]
    assert (12.5, 7.25) in [tuple(spot[0]) for spot in spots if len(spot) == 1]


def test_pictures_of_bare_scene_and_of_mission_differ(
    make_scene, make_plan, straight, tmp_path: Path
) -> None:
    scene, plan = mission(make_scene, make_plan, straight)
    overview.draw_overview(scene, path=tmp_path / "scene.png")
    overview.draw_overview(scene, plan, path=tmp_path / "plan.png")
    bare = Image.open(tmp_path / "scene.png")
    full = Image.open(tmp_path / "plan.png")
    assert min(*bare.size, *full.size) >= 400
    assert np.asarray(full.convert("RGB")).std() > 5
    assert bare.tobytes() != full.tobytes()
